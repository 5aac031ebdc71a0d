//! `metrics`: what a scraper is told, without the page.

use std::process::ExitCode;
use std::sync::Arc;
use std::thread;

use bench_dragon::metrics;
use bench_dragon::observe::{Observer, Scene};
use bench_dragon::stop::StopFlag;
use bench_dragon_ipc::Domain;
use tokio::sync::watch;

use crate::cli::MetricsArgs;
use crate::command::listening;

/// Scenes a second: scrapers come far less often, but the least clearance is that of all scenes.
const SCENES_HZ: u32 = 10;

pub(crate) fn run(args: &MetricsArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let site = listening::open(args.listen, &args.site)?;
    let address = site.address();
    listening::announce(args.format.format, "listening on ", listening::url(address, "metrics"), address)?;
    let (scenes, newest) = watch::channel(Arc::new(Scene::default()));
    let stopped = stop.clone();
    let observing = thread::Builder::new().name("observer".to_owned()).spawn(move || {
        let show = |scene| {
            scenes.send_replace(Arc::new(scene));
        };
        Observer::new(domain, "metrics", SCENES_HZ).run(stopped.as_atomic(), show);
    })?;
    site.serve(metrics::router(newest), &stop, &watch::Sender::new(false))?;
    observing.join().expect("the observer does not panic");
    Ok(ExitCode::SUCCESS)
}

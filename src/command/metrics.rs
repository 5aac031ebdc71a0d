//! `metrics`: what a scraper is told, without the page.

use std::process::ExitCode;
use std::sync::Arc;

use bench_dragon_ipc::Domain;
use tokio::sync::watch;

use crate::cli::MetricsArgs;
use crate::command::listening;
use crate::command::observing::observe_while;
use crate::display::metrics;
use crate::display::observe::{Observer, Scene};
use crate::system::stop::StopFlag;

/// Scenes a second: scrapers come far less often, but the least clearance is that of all scenes.
const SCENES_HZ: u32 = 10;

pub(crate) fn run(args: &MetricsArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let site = listening::open(args.listen, &args.site)?;
    let address = site.address();
    listening::announce(args.format.format, "listening on ", listening::url(address, "metrics"), address)?;
    let (scenes, newest) = watch::channel(Arc::new(Scene::default()));
    let show = |scene| {
        scenes.send_replace(Arc::new(scene));
    };
    let observer = Observer::new(domain, "metrics", SCENES_HZ);
    let serve = || Ok(site.serve(metrics::router(newest), &stop, &watch::Sender::new(false))?);
    observe_while(&observer, stop.as_atomic(), show, serve)?;
    Ok(ExitCode::SUCCESS)
}

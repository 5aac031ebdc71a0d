//! `view` and `metrics`: processes that observe the bus and serve what they see over HTTP.

use std::env::{self, VarError};
use std::io::{self, ErrorKind};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use anyhow::{Context as _, anyhow};
use bench_dragon_ipc::Domain;
use serde::{Deserialize, Serialize};
use tokio::sync::watch;

use crate::cli::{BadInput, Format, MetricsArgs, SiteArgs, ViewArgs};
use crate::command::print::{complain, print_report};
use crate::display::metrics;
use crate::display::observe::{Observer, Snapshot};
use crate::display::view::{Token, TokenError, View, ViewSettings};
use crate::display::web::Site;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// Snapshots a second on the page: those of most screens.
const VIEW_SNAPSHOTS_HZ: u32 = 60;
/// The token of one's own, where it is set.
pub(super) const TOKEN_VARIABLE: &str = "BENCH_DRAGON_TOKEN";

pub(super) fn view(args: &ViewArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let token = token()?;
    let stop = StopFlag::on_signals()?;
    let site = listen(args.listen, &args.site)?;
    let address = site.address();
    announce_page(args, &token, address)?;
    let settings = ViewSettings { token, is_read_only: args.read_only, address: address.ip() };
    let view = View::open(domain.clone(), settings)?;
    let observer = Observer::new(domain, "view", VIEW_SNAPSHOTS_HZ).with_plan();
    let serve = || {
        site.serve(view.router(), &stop, view.closing())?;
        view.close();
        Ok(())
    };
    observe_while(&observer, stop.as_atomic(), |snapshot| view.show(snapshot), serve)?;
    Ok(ExitCode::SUCCESS)
}

fn token() -> anyhow::Result<Token> {
    match env::var(TOKEN_VARIABLE) {
        Ok(text) => {
            text.parse().map_err(|error| BadInput(format!("the environment's {TOKEN_VARIABLE} {error}")).into())
        }
        Err(VarError::NotUnicode(_)) => {
            Err(BadInput(format!("the environment's {TOKEN_VARIABLE} {TokenError}")).into())
        }
        Err(VarError::NotPresent) => Ok(Token::random().context("the kernel has no random numbers")?),
    }
}

fn announce_page(args: &ViewArgs, token: &Token, address: SocketAddr) -> anyhow::Result<()> {
    let fragment =
        if args.read_only && address.ip().is_loopback() { String::new() } else { format!("#token={}", token.secret()) };
    announce(args.format.format, "", url(address, &fragment), address)?;
    if !address.ip().is_loopback() {
        complain("whoever has this address and its token can look, and steer unless --read-only; it is not encrypted");
    }
    Ok(())
}

/// Snapshots a second: scrapers come far less often, but the least clearance is that of all snapshots.
const METRICS_SNAPSHOTS_HZ: u32 = 10;

pub(super) fn metrics(args: &MetricsArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let site = listen(args.listen, &args.site)?;
    let address = site.address();
    announce(args.format.format, "listening on ", url(address, "metrics"), address)?;
    let (snapshots, newest) = watch::channel(Arc::new(Snapshot::default()));
    let show = |snapshot| {
        snapshots.send_replace(Arc::new(snapshot));
    };
    let observer = Observer::new(domain, "metrics", METRICS_SNAPSHOTS_HZ);
    let serve = || Ok(site.serve(metrics::router(newest), &stop, &watch::Sender::new(false))?);
    observe_while(&observer, stop.as_atomic(), show, serve)?;
    Ok(ExitCode::SUCCESS)
}

/// What is printed once there is something to open.
#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "type", rename = "listening")]
pub(super) struct ListeningLine {
    pub(super) url: String,
    pub(super) address: SocketAddr,
}

fn listen(address: SocketAddr, args: &SiteArgs) -> anyhow::Result<Site> {
    let name = rustix::system::uname();
    let machine = name.nodename().to_str().ok();
    Site::open(address, machine, &args.allowed_hosts).map_err(|error| cannot_listen(address, &error))
}

/// The error of an address that cannot be had.
pub(super) fn cannot_listen(listen: SocketAddr, error: &io::Error) -> anyhow::Error {
    let remedy = if error.kind() == ErrorKind::AddrInUse { "; port 0 takes a free one" } else { "" };
    anyhow!("cannot listen on {listen}: {error}{remedy}")
}

/// The address of a page, by which others reach it too where it listens to them.
pub(crate) fn url(address: SocketAddr, page: &str) -> String {
    let reached = SocketAddr::new(reachable(address.ip()), address.port());
    format!("http://{reached}/{page}")
}

/// Tells people in these words, and machines in a line of JSON, that a page can be opened.
pub(crate) fn announce(format: Format, words: &str, url: String, address: SocketAddr) -> anyhow::Result<()> {
    let text = format!("{words}{url}");
    print_report(format, &ListeningLine { url, address }, text)
}

/// The address by which others reach a machine that listens on all of its own.
fn reachable(ip: IpAddr) -> IpAddr {
    if !ip.is_unspecified() {
        return ip;
    }
    // Where there is no network to be found, there is this machine.
    outward_address().unwrap_or(IpAddr::V4(Ipv4Addr::LOCALHOST))
}

/// The address that packets leave from. None is sent: 192.0.2.0/24 is nobody's.
fn outward_address() -> io::Result<IpAddr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9))?;
    Ok(socket.local_addr()?.ip())
}

/// Observes on a thread of its own and shows snapshot after snapshot, while this thread serves until the flag is set.
///
/// When the observing ends, also by a panic, the flag is set: a process that shows what nobody sees any more had better be
/// started again, by `show` or by a service manager. The first snapshot, of nothing, is shown before anything is served.
///
/// # Errors
/// What the serving failed with, or that the observer panicked.
pub(crate) fn observe_while(
    observer: &Observer,
    stop: &AtomicBool,
    mut show: impl FnMut(Snapshot) + Send,
    serve: impl FnOnce() -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    show(Snapshot::empty(monotonic_ns()));
    thread::scope(|scope| {
        let observe = || {
            let _ends = SetAtEnd(stop);
            observer.run(stop, show);
        };
        let observing = thread::Builder::new().name("observer".to_owned()).spawn_scoped(scope, observe)?;
        let ends = SetAtEnd(stop);
        let served = serve();
        drop(ends);
        observing.join().map_err(|_| anyhow!("the observer panicked"))?;
        served
    })
}

/// Sets a flag when it is dropped, however that comes.
struct SetAtEnd<'a>(&'a AtomicBool);

impl Drop for SetAtEnd<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use anyhow::{bail, ensure};
    use bench_dragon_ipc::{Domain, Instance};
    use std::sync::atomic::AtomicU32;
    use std::time::{Duration, Instant};

    use super::*;

    fn observer() -> Observer {
        let instance = Instance::new("nobody-serves-this").expect("the name has only allowed characters");
        Observer::new(Domain::new(instance).expect("XDG_RUNTIME_DIR is short, or unset"), "test", 1000)
    }

    fn wait_for(stop: &AtomicBool) -> anyhow::Result<()> {
        let patience = Instant::now() + Duration::from_mins(1);
        while !stop.load(Ordering::Relaxed) {
            ensure!(Instant::now() < patience, "nothing has ended the process");
            thread::yield_now();
        }
        Ok(())
    }

    #[test]
    fn an_observer_that_panics_ends_the_process_as_failed() {
        let stop = AtomicBool::new(false);
        let mut snapshots = 0;
        let show = |_| {
            snapshots += 1;
            assert!(snapshots < 3, "this panic is part of a test");
        };
        let error = observe_while(&observer(), &stop, show, || wait_for(&stop)).expect_err("it panicked");
        assert_eq!(error.to_string(), "the observer panicked");
    }

    #[test]
    fn a_process_that_serves_no_more_observes_no_more() {
        let (stop, snapshots) = (AtomicBool::new(false), AtomicU32::new(0));
        let show = |snapshot: Snapshot| {
            assert!(snapshot.seen_ns > 0);
            snapshots.fetch_add(1, Ordering::Relaxed);
        };
        let serve = || {
            assert!(snapshots.load(Ordering::Relaxed) > 0, "there is something to show at once");
            bail!("no socket can be had")
        };
        let error = observe_while(&observer(), &stop, show, serve).expect_err("serving failed");
        assert_eq!(error.to_string(), "no socket can be had");
    }
}

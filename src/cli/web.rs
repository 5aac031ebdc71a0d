//! `view` and `metrics`: processes that observe the bus and serve its state over HTTP.

use std::env::{self, VarError};
use std::io::{self, BufRead as _, ErrorKind};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use anyhow::{Context as _, anyhow};
use clap::Args;
use serde::{Deserialize, Serialize};
use tokio::sync::watch;

use crate::cli::flags::{BadInput, BusArgs, Format, FormatArgs, listen_address};
use crate::cli::print::{print_report, print_to_stderr};
use crate::display::metrics;
use crate::display::observe::{Observer, Snapshot};
use crate::display::view::{ShowOutcome, Token, TokenError, View};
use crate::display::web::Site;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// The flag for the host names of a site.
#[derive(Clone, Debug, Args)]
pub(crate) struct SiteArgs {
    /// Further host name by which browsers may open this machine, besides its addresses and its own name; may be repeated.
    #[arg(long = "allow-host", value_name = "NAME", value_parser = host_name)]
    pub(crate) allowed_hosts: Vec<String>,
}

/// Serve a page that shows the show in a browser, and steers it.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon view                              prints the address to open
  bench-dragon view --listen 0.0.0.0:8223        for tablets in the house, with the printed token
  bench-dragon view --read-only --instance main

A browser on this machine needs no token to watch. Steering, and watching from another machine, need the token in the printed \
address. The token is new at each start, unless the environment variable BENCH_DRAGON_TOKEN contains one. The connection is \
not encrypted: in a network that you do not trust use a tunnel, `ssh -L 8223:localhost:8223 booth`.")]
pub(crate) struct ViewArgs {
    /// Address and port of the page; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8223", value_parser = listen_address)]
    pub(crate) listen: SocketAddr,
    #[command(flatten)]
    pub(crate) site: SiteArgs,
    /// Serve a page without controls, and accept no commands.
    #[arg(long)]
    pub(crate) read_only: bool,
    /// Read the outcome of the show from stdin, as a line of JSON, and send it to the pages.
    #[arg(long, hide = true)]
    pub(crate) outcome_from_stdin: bool,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Serve the metrics of the show to Prometheus, without a page.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon metrics                           at http://127.0.0.1:9223/metrics
  bench-dragon metrics --listen 0.0.0.0:9223     for a scraper on another machine
  curl http://127.0.0.1:9223/metrics

`view` serves the same metrics at /metrics. Anyone who can reach the address can read them, but can do nothing else. \
docs/reference/metrics.md describes all of them.")]
pub(crate) struct MetricsArgs {
    /// Address and port of the metrics; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:9223", value_parser = listen_address)]
    pub(crate) listen: SocketAddr,
    #[command(flatten)]
    pub(crate) site: SiteArgs,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

pub(super) fn host_name(name: &str) -> Result<String, String> {
    let is_name = !name.is_empty() && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"-._".contains(&byte));
    if is_name { Ok(name.to_owned()) } else { Err("must be a host name without a port".to_owned()) }
}

/// Snapshots per second on the page: the refresh rate of most screens.
const VIEW_SNAPSHOTS_HZ: u32 = 60;
/// Environment variable with a user-defined token.
pub(super) const TOKEN_VARIABLE: &str = "BENCH_DRAGON_TOKEN";

pub(super) fn view(args: &ViewArgs) -> anyhow::Result<ExitCode> {
    let domain = args.bus.domain()?.for_operators();
    let token = token()?;
    let stop = StopFlag::on_signals()?;
    let site = listen(args.listen, &args.site)?;
    let address = site.address;
    announce_page(args, &token, address)?;
    let view = View::open(domain.clone(), token, args.read_only, address.ip())?;
    if args.outcome_from_stdin {
        read_outcome(&view)?;
    }
    let observer = Observer::new(domain, "view", VIEW_SNAPSHOTS_HZ).with_plan().with_memory();
    let serve = || {
        site.serve(view.router(), &stop, view.closing())?;
        view.close();
        Ok(())
    };
    observe_while(&observer, stop.as_atomic(), |snapshot| view.show(snapshot), serve)?;
    Ok(ExitCode::SUCCESS)
}

/// Reads the outcome of the show in a thread, which ends with the process. The end of stdin without an outcome is the end of a
/// show that could not report one.
fn read_outcome(view: &View) -> anyhow::Result<()> {
    view.await_outcome();
    let view = view.clone();
    let read = move || {
        let mut line = String::new();
        let read = io::stdin().lock().read_line(&mut line).ok();
        let outcome = read.and_then(|_| serde_json::from_str(&line).ok());
        view.end_show(outcome.unwrap_or_else(ShowOutcome::unreported));
    };
    thread::Builder::new().name("outcome".to_owned()).spawn(read).context("cannot read the outcome of the show")?;
    Ok(())
}

pub(super) fn token() -> anyhow::Result<Token> {
    match env::var(TOKEN_VARIABLE) {
        Ok(text) => {
            text.parse().map_err(|error| BadInput(format!("the environment's {TOKEN_VARIABLE} {error}")).into())
        }
        Err(VarError::NotUnicode(_)) => {
            Err(BadInput(format!("the environment's {TOKEN_VARIABLE} {TokenError}")).into())
        }
        Err(VarError::NotPresent) => Ok(Token::random().context("cannot read random numbers from the kernel")?),
    }
}

fn announce_page(args: &ViewArgs, token: &Token, address: SocketAddr) -> anyhow::Result<()> {
    let fragment =
        if args.read_only && address.ip().is_loopback() { String::new() } else { format!("#token={}", token.secret()) };
    announce(args.format.format, "", url(address, &fragment), address)?;
    if !address.ip().is_loopback() {
        print_to_stderr(
            "anyone with this address and token can watch, and steer unless --read-only; nothing is encrypted",
        );
    }
    Ok(())
}

/// Snapshots per second. Scrapers read far less often, but the least clearance covers all snapshots.
const METRICS_SNAPSHOTS_HZ: u32 = 10;

pub(super) fn metrics(args: &MetricsArgs) -> anyhow::Result<ExitCode> {
    let domain = args.bus.domain()?.for_operators();
    let stop = StopFlag::on_signals()?;
    let site = listen(args.listen, &args.site)?;
    let address = site.address;
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

/// The line that reports the address of a site that is ready.
#[derive(Debug, Serialize, Deserialize)]
#[serde(tag = "type", rename = "listening")]
pub(super) struct ListeningLine {
    pub(super) url: String,
    pub(super) address: SocketAddr,
}

pub(super) fn listen(address: SocketAddr, args: &SiteArgs) -> anyhow::Result<Site> {
    let name = rustix::system::uname();
    let machine = name.nodename().to_str().ok();
    Site::open(address, machine, &args.allowed_hosts).map_err(|error| cannot_listen(address, &error))
}

/// The error of an address that cannot be bound.
pub(super) fn cannot_listen(listen: SocketAddr, error: &io::Error) -> anyhow::Error {
    let remedy = if error.kind() == ErrorKind::AddrInUse { "; port 0 takes a free one" } else { "" };
    anyhow!("cannot listen on {listen}: {error}{remedy}")
}

/// The URL of a page. If the page listens on all addresses, other machines can use the URL, too.
pub(crate) fn url(address: SocketAddr, page: &str) -> String {
    let reached = SocketAddr::new(reachable(address.ip()), address.port());
    format!("http://{reached}/{page}")
}

/// Reports that a page can be opened: its URL after `words`, or a line of JSON.
pub(crate) fn announce(format: Format, words: &str, url: String, address: SocketAddr) -> anyhow::Result<()> {
    let text = format!("{words}{url}");
    print_report(format, &ListeningLine { url, address }, text)
}

/// The address by which other machines reach a machine that listens on all of its addresses.
pub(super) fn reachable(ip: IpAddr) -> IpAddr {
    if !ip.is_unspecified() {
        return ip;
    }
    // Without a network, only this machine can reach the page.
    outward_address().unwrap_or(IpAddr::V4(Ipv4Addr::LOCALHOST))
}

/// The source address of outgoing packets. No packet is sent; 192.0.2.0/24 is reserved for documentation (RFC 5737).
fn outward_address() -> io::Result<IpAddr> {
    let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9))?;
    Ok(socket.local_addr()?.ip())
}

/// Observes the bus in a separate thread, which passes each snapshot to `show`. Meanwhile this thread calls `serve`, which
/// returns once the flag is set.
///
/// The end of the observer, also by a panic, sets the flag: the process would show an outdated state, so `show` or a service
/// manager should restart it. An empty first snapshot is shown before `serve` is called.
///
/// # Errors
/// The error of `serve`, or a panic of the observer.
pub(crate) fn observe_while(
    observer: &Observer,
    stop: &AtomicBool,
    mut show: impl FnMut(Snapshot) + Send,
    serve: impl FnOnce() -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    show(Snapshot { seen_ns: monotonic_ns(), ..Snapshot::default() });
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

/// Sets a flag when it is dropped, also by a panic.
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
        let deadline = Instant::now() + Duration::from_mins(1);
        while !stop.load(Ordering::Relaxed) {
            ensure!(Instant::now() < deadline, "the stop flag was not set within a minute");
            thread::yield_now();
        }
        Ok(())
    }

    #[test]
    fn a_panic_of_the_observer_ends_the_process_with_an_error() {
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
    fn the_observer_stops_when_serving_ends() {
        let (stop, snapshots) = (AtomicBool::new(false), AtomicU32::new(0));
        let show = |snapshot: Snapshot| {
            assert!(snapshot.seen_ns > 0);
            snapshots.fetch_add(1, Ordering::Relaxed);
        };
        let serve = || {
            assert!(snapshots.load(Ordering::Relaxed) > 0, "a snapshot is shown before serving begins");
            bail!("no socket can be opened")
        };
        let error = observe_while(&observer(), &stop, show, serve).expect_err("serving failed");
        assert_eq!(error.to_string(), "no socket can be opened");
    }
}

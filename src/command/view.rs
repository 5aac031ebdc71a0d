//! `view`: the page's process.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, UdpSocket};
use std::process::ExitCode;
use std::thread;

use anyhow::Context as _;
use bench_dragon::observe::Observer;
use bench_dragon::stop::StopFlag;
use bench_dragon::view::{Token, View, ViewSettings};
use bench_dragon::web::Site;
use bench_dragon_ipc::Domain;
use serde::Serialize;

use crate::cli::{Format, ViewArgs};
use crate::command::BadInput;
use crate::command::output::{complain, print_json, print_line};
use crate::command::parent::follow_parent;

/// Scenes a second: those of most screens.
const SCENES_HZ: u32 = 60;
/// The token of one's own, where it is set.
const TOKEN_VARIABLE: &str = "BENCH_DRAGON_TOKEN";

/// What is printed once the page can be opened.
#[derive(Serialize)]
#[serde(tag = "type", rename = "listening")]
struct ListeningLine {
    url: String,
    address: SocketAddr,
}

pub(crate) fn run(args: &ViewArgs) -> anyhow::Result<ExitCode> {
    follow_parent(args.child)?;
    let domain = Domain::new(args.bus.instance.clone())?;
    let token = token()?;
    let stop = StopFlag::on_signals()?;
    let machine = machine_name();
    let site = Site::open(args.listen, machine.as_deref(), &args.site.allowed_hosts)
        .with_context(|| format!("cannot listen on {}", args.listen))?;
    let address = site.address();
    announce(args, &token, address)?;
    let settings = ViewSettings { token, is_read_only: args.read_only, address: address.ip() };
    let view = View::new(domain.clone(), settings);
    let (observed, stopped) = (view.clone(), stop.clone());
    let observing = thread::Builder::new().name("observer".to_owned()).spawn(move || {
        Observer::new(domain, "view", SCENES_HZ).run(stopped.as_atomic(), |scene| observed.show(scene));
    })?;
    site.serve(view.router(), &stop, view.closing())?;
    observing.join().expect("the observer does not panic");
    Ok(ExitCode::SUCCESS)
}

fn token() -> anyhow::Result<Token> {
    match std::env::var(TOKEN_VARIABLE) {
        Ok(text) => {
            text.parse().map_err(|error| BadInput(format!("the environment's {TOKEN_VARIABLE} {error}")).into())
        }
        Err(_) => Ok(Token::random().context("the kernel has no random numbers")?),
    }
}

fn announce(args: &ViewArgs, token: &Token, address: SocketAddr) -> anyhow::Result<()> {
    let reached = SocketAddr::new(reachable(address.ip()), address.port());
    let fragment =
        if args.read_only && address.ip().is_loopback() { String::new() } else { format!("#token={}", token.secret()) };
    let url = format!("http://{reached}/{fragment}");
    match args.format.format {
        Format::Json => print_json(&ListeningLine { url, address })?,
        Format::Text => print_line(url)?,
    }
    if !address.ip().is_loopback() {
        complain("whoever has this address and its token can look, and steer unless --read-only; it is not encrypted");
    }
    Ok(())
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

fn machine_name() -> Option<String> {
    rustix::system::uname().nodename().to_str().ok().map(str::to_owned)
}

//! `doctor --tonight`: whether browsers reach the pages of the show.
//!
//! While the show runs, each page is asked for what it is. Before the show, this process listens at the page's address for a
//! moment and connects to itself, by the address that browsers will use.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

use serde::Deserialize;

use super::{Finding, Target};
use crate::cli::endpoint::{Endpoint, Transport};
use crate::cli::show::AlsoCommand;
use crate::cli::web::{reachable, url};

/// Longest wait for a page's answer.
const PATIENCE: Duration = Duration::from_secs(2);
/// Longest answer that is read.
const MOST_BYTES: usize = 16 << 10;
/// How to start a page beside a show that runs.
const START: &str = "start it: `bench-dragon view --listen";

/// The answer of a page at `/access`.
#[derive(Debug, Deserialize)]
struct PageAccess {
    version: String,
    /// Empty where only a token shows it.
    instance: String,
}

/// Whether each page can be opened. The first one that cannot decides.
pub(super) fn page(target: &Target) -> Finding {
    let pages = pages(target);
    if pages.is_empty() {
        return Finding::ok("none", "no page is asked for (`--view`)");
    }
    let examine = |listen| if target.has_server() { running(target, listen) } else { planned(listen) };
    let mut messages = Vec::new();
    for listen in pages {
        let finding = examine(listen);
        if finding.remedy.is_some() || finding.value.is_empty() {
            return finding;
        }
        messages.push(finding.message);
    }
    Finding::ok(messages.len().to_string(), messages.join("; "))
}

/// The addresses of the pages: that of `--view`, and those of the commands beside the show.
fn pages(target: &Target) -> Vec<SocketAddr> {
    let beside = target.beside.iter().filter(|command| command.is_page()).flat_map(AlsoCommand::endpoints);
    let listens = |end| match end {
        Endpoint::Listens(Transport::Tcp, address) => Some(address),
        _ => None,
    };
    target.view.into_iter().chain(beside.filter_map(listens)).collect()
}

/// A page of a show that runs.
fn running(target: &Target, listen: SocketAddr) -> Finding {
    if listen.port() == 0 {
        return Finding::not_known("the page took a free port: name it, `--view=ADDRESS:PORT`");
    }
    let reached = SocketAddr::new(reachable(listen.ip()), listen.port());
    judge_answer(reached, &target.instance.to_string(), ask(reached))
}

/// Asks for `/access`. `None` is an answer of another program.
fn ask(address: SocketAddr) -> io::Result<Option<PageAccess>> {
    let deadline = Instant::now() + PATIENCE;
    let mut stream = TcpStream::connect_timeout(&address, PATIENCE)?;
    stream.set_write_timeout(Some(PATIENCE))?;
    stream.write_all(format!("GET /access HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").as_bytes())?;
    let mut answer = Vec::new();
    let mut buffer = [0; 4096];
    while answer.len() < MOST_BYTES {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut buffer)? {
            0 => break,
            length => answer.extend_from_slice(&buffer[..length]),
        }
    }
    Ok(access(&answer))
}

/// The answer of a page in HTTP; `None` for anything else.
fn access(answer: &[u8]) -> Option<PageAccess> {
    let text = str::from_utf8(answer).ok()?;
    let (head, body) = text.split_once("\r\n\r\n")?;
    head.starts_with("HTTP/1.1 200 ").then_some(())?;
    serde_json::from_str(body).ok()
}

fn judge_answer(reached: SocketAddr, instance: &str, answer: io::Result<Option<PageAccess>>) -> Finding {
    let (value, page) = (reached.to_string(), url(reached, ""));
    match answer {
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Finding::problem(
            value,
            format!("{page} gives no answer within {} s", PATIENCE.as_secs()),
            "end the program that has the port, and start the page again; look at the firewall",
        ),
        Err(error) => Finding::problem(value, format!("no page at {page}: {error}"), format!("{START} {reached}`")),
        Ok(None) => Finding::problem(
            value,
            format!("another program answers at {page}"),
            "end that program, or choose another port for the page",
        ),
        Ok(Some(access)) if !access.instance.is_empty() && access.instance != instance => Finding::problem(
            value,
            format!("{page} shows the instance {}", access.instance),
            format!("choose another port: `bench-dragon view --instance {instance} --listen ADDRESS:PORT`"),
        ),
        Ok(Some(access)) if access.version != env!("CARGO_PKG_VERSION") => Finding::warning(
            value,
            format!("{page} has the version {}, this program {}", access.version, env!("CARGO_PKG_VERSION")),
            "start the page again, so that all programs have the same version",
        ),
        Ok(Some(_)) => Finding::ok(value, format!("{page} answers{}", who_reaches(reached))),
    }
}

/// A page of a show that has not begun.
fn planned(listen: SocketAddr) -> Finding {
    judge_trial(listen, try_out(listen))
}

/// Listens for a moment, and connects by the address that browsers use.
fn try_out(listen: SocketAddr) -> io::Result<SocketAddr> {
    let listener = TcpListener::bind(listen)?;
    let reached = SocketAddr::new(reachable(listen.ip()), listener.local_addr()?.port());
    TcpStream::connect_timeout(&reached, PATIENCE)?;
    Ok(reached)
}

fn judge_trial(listen: SocketAddr, trial: io::Result<SocketAddr>) -> Finding {
    match trial {
        Err(error) if error.kind() == ErrorKind::AddrInUse => Finding::problem(
            listen.to_string(),
            format!("the page cannot listen on {listen}: {error}"),
            "end the program that has the port, or choose another port for the page",
        ),
        Err(error) if error.kind() == ErrorKind::AddrNotAvailable => Finding::problem(
            listen.to_string(),
            format!("the page cannot listen on {listen}: this machine does not have that address"),
            "plug in the network, or choose another address: 0.0.0.0 is all of this machine's",
        ),
        Err(error) => Finding::problem(
            listen.to_string(),
            format!("a page on {listen} cannot be reached: {error}"),
            "choose another address or port for the page, or open the port in the firewall",
        ),
        Ok(reached) => {
            let shown = if listen.port() == 0 { "a free port".to_owned() } else { url(reached, "") };
            Finding::ok(reached.to_string(), format!("{shown} can be opened from the start on{}", who_reaches(reached)))
        }
    }
}

fn who_reaches(reached: SocketAddr) -> &'static str {
    if reached.ip().is_loopback() { ", from this machine alone" } else { "; open it on each tablet" }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;
    use crate::cli::doctor::finding::Verdict;

    /// A program that answers its first client, and keeps the connection until the client closes it.
    fn answered(answer: &'static [u8]) -> io::Result<Option<PageAccess>> {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("an address");
        let other = thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("a client");
            stream.write_all(answer).expect("the client reads");
            let mut rest = Vec::new();
            // The client closes, or resets where it has not read all.
            let _ = if answer.is_empty() { stream.read_to_end(&mut rest) } else { stream.read(&mut [0; 512]) };
        });
        let answer = ask(address);
        other.join().expect("it has answered");
        answer
    }

    fn judged(answer: io::Result<Option<PageAccess>>) -> Finding {
        judge_answer("127.0.0.1:8223".parse().expect("an address"), "dragon", answer)
    }

    #[test]
    fn a_port_without_a_page_is_a_problem_with_the_command_that_starts_one() {
        let free = TcpListener::bind("127.0.0.1:0").expect("a free port").local_addr().expect("an address");
        let finding = judge_answer(free, "dragon", ask(free));
        assert_eq!(finding.status, Verdict::Problem);
        assert!(finding.message.starts_with(&format!("no page at http://{free}/: ")), "{}", finding.message);
        assert_eq!(finding.remedy, Some(format!("start it: `bench-dragon view --listen {free}`")));
    }

    #[test]
    fn another_program_at_the_port_is_named_as_such() {
        for answer in [&b"SSH-2.0-x\r\n"[..], b"HTTP/1.1 404 Not Found\r\n\r\n{}", b"HTTP/1.1 200 OK\r\n\r\n<html>"] {
            let finding = judged(answered(answer));
            assert_eq!(
                (finding.status, &*finding.message),
                (Verdict::Problem, "another program answers at http://127.0.0.1:8223/")
            );
        }
    }

    #[test]
    fn a_program_that_never_answers_is_a_problem_after_a_while() {
        let finding = judged(answered(b""));
        assert_eq!(
            (finding.status, &*finding.message),
            (Verdict::Problem, "http://127.0.0.1:8223/ gives no answer within 2 s")
        );
    }

    #[test]
    fn a_page_of_another_show_or_version_is_no_page_of_this_show() {
        let access = |version: &str, instance: &str| {
            Ok(Some(PageAccess { version: version.to_owned(), instance: instance.to_owned() }))
        };
        let version = env!("CARGO_PKG_VERSION");
        assert_eq!(judged(access(version, "dragon")).status, Verdict::Ok);
        assert_eq!(judged(access(version, "")).status, Verdict::Ok);
        assert_eq!(judged(access(version, "other")).status, Verdict::Problem);
        assert_eq!(judged(access("0.0.0", "dragon")).status, Verdict::Warning);
    }

    #[test]
    fn a_page_that_is_to_come_is_tried_out_at_its_address() {
        let taken = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let listen = taken.local_addr().expect("an address");
        assert_eq!(planned(listen).status, Verdict::Problem);
        drop(taken);
        let finding = planned(listen);
        assert_eq!(finding.status, Verdict::Ok);
        let words = format!("http://{listen}/ can be opened from the start on, from this machine alone");
        assert_eq!(finding.message, words);
        // Of the addresses for documentation (RFC 5737).
        let foreign = planned("192.0.2.1:8223".parse().expect("an address"));
        assert_eq!(foreign.status, Verdict::Problem);
        assert!(foreign.message.contains("does not have that address"), "{}", foreign.message);
    }
}

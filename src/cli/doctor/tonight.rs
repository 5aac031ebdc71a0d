//! `doctor --tonight`: what the show of a configuration needs beside the machine: a plan that a guard can prove to its end, room for
//! its recording, free ports for it and the commands beside it, and a way to each desk.

use std::fs::File;
use std::io::ErrorKind;
use std::iter;

use bench_dragon_geometry::clearance::{ProvenCourse, Violation};
use bench_dragon_geometry::number::Fixed;

use super::resources::existing;
use super::server::description_of;
use super::{Check, Finding, Target, page, timecode};
use crate::cli::endpoint::{Endpoint, Transport};
use crate::cli::show::AlsoCommand;
use crate::config::Config;
use crate::recording::{DiskSpace, Size, walking_bytes_per_s};
use crate::source::timecode::TimecodeInput;

/// The checks, in the order of the report.
pub(super) const CHECKS: &[(&str, Check)] = &[
    ("configuration", configuration),
    ("plan", |target| judge_plan(&target.config, target.from_s, target.until_s)),
    ("room for the show", room),
    ("ports", |target| {
        if target.has_server() {
            Finding::not_known("the show runs, and has its ports")
        } else {
            ports(&listeners(target))
        }
    }),
    ("desks", |target| desks(&target.beside)),
    ("page", page::page),
    ("timecode", timecode::timecode),
];

/// Greatest number of handles placed in one call of the proof.
const HANDLES_AT_A_TIME: usize = 1_000_000;
/// Share of the disk's room that a recording should leave free.
const SPARE: f64 = 1.25;

/// Whether the show that runs plays this configuration.
fn configuration(target: &Target) -> Finding {
    if !target.has_server() {
        return Finding::ok("none", "no show runs yet");
    }
    match description_of(target) {
        Some(description) => judge_configuration(&description.toml, &target.config.to_toml()),
        None => Finding::not_known("the server sends no description, or leftovers prevent the check"),
    }
}

/// Compares the configuration that is played with the one of the checks, both with all their keys.
fn judge_configuration(played: &str, checked: &str) -> Finding {
    if played == checked {
        return Finding::ok("the same", "the show that runs plays this configuration");
    }
    let pairs = played.lines().chain(iter::repeat("nothing")).zip(checked.lines().chain(iter::repeat("nothing")));
    let lines = played.lines().count().max(checked.lines().count());
    let (theirs, ours) = pairs.take(lines).find(|(theirs, ours)| theirs != ours).unwrap_or_default();
    Finding::problem(
        "another",
        format!(
            "the show that runs plays another configuration: the first line that differs is `{}` there, `{}` here",
            theirs.escape_debug(),
            ours.escape_debug()
        ),
        "give --tonight the configuration and the flags of the show, or end the show and start this one",
    )
}

/// Whether the guard can let the show walk to its end.
fn judge_plan(config: &Config, from_s: f64, end_s: f64) -> Finding {
    let from_m = config.course_m(from_s);
    let margin_m = config.tables().monitor.margin_m;
    let margin = format!("{} mm", Fixed::<1>(margin_m * 1e3));
    let mut proven = match ProvenCourse::at(config.formation(), config.guarded_stage(), margin_m, from_m) {
        Ok(proven) => proven,
        Err(violation) => {
            let message = format!("{} at the start", words(config, violation));
            return Finding::problem("0 s", message, "move the start, or lower `[monitor] margin_m`");
        }
    };
    let end_m = config.course_m(end_s);
    loop {
        let before_m = proven.end_m();
        proven.extend(end_m, HANDLES_AT_A_TIME);
        if proven.end_m() >= end_m {
            let message = format!("{margin} or more are proved from the start to the end at {} s", Fixed::<1>(end_s));
            return Finding::ok(format!("{} s", Fixed::<1>(end_s)), message);
        }
        if proven.is_whole() || proven.end_m() <= before_m {
            break;
        }
    }
    // Rounded down, so that the printed value is proved.
    let formation = config.formation();
    let stop_s = if formation.has_plan_course() {
        formation.plan_s(proven.end_m())
    } else {
        config.timetable().time_s(proven.end_m())
    };
    let stop_s = (stop_s * 1e3).floor() / 1e3;
    let (stop, end) = (Fixed::<3>(stop_s), Fixed::<1>(end_s));
    let message = format!("a guard with a margin of {margin} stops the show where the plan is at {stop} s of {end} s");
    let remedy =
        "`bench-dragon solve contact --config FILE` says what is there; end the show before, or change the plan";
    if config.tables().monitor.guard {
        Finding::problem(format!("{stop} s"), message, remedy)
    } else {
        Finding::warning(format!("{stop} s"), message, remedy)
    }
}

fn words(config: &Config, violation: Violation) -> String {
    match violation {
        Violation::Pair(nearest) => {
            let clearance = Fixed::<1>(nearest.clearance_m * 1e3);
            format!("benches {} and {} are {clearance} mm apart", nearest.benches[0], nearest.benches[1])
        }
        Violation::Border(breach) => {
            let clear = Fixed::<2>(config.stage().clear_m());
            format!("bench {} is nearer than {clear} m to a border of the stage", breach.bench)
        }
    }
}

/// Whether the disk has room for the recording of the whole run, and a quarter more.
fn room(target: &Target) -> Finding {
    let Target { config, out, from_s, until_s, .. } = target;
    let space = File::open(existing(out)).and_then(|folder| DiskSpace::around(&folder));
    let free_bytes = match space {
        Ok(space) => space.free_bytes,
        Err(error) => return Finding::not_known(format!("the disk cannot be read: {error}")),
    };
    let serve = &config.tables().serve;
    let wall_s = (until_s - from_s) / serve.time_scale;
    let bytes_per_s = walking_bytes_per_s(config.formation().layout(), serve.rate_hz) * SPARE;
    let needed = bytes_per_s * wall_s;
    let waits = if config.waits_m().is_empty() {
        String::new()
    } else {
        // Frames of a dragon that stands compress ten times as well, so this is enough.
        format!(", each hour of waiting for GO at most {}", Size((bytes_per_s * 3600.0) as u64))
    };
    let message = format!("the run of {} min needs some {}{waits}", Fixed::<1>(wall_s / 60.0), Size(needed as u64));
    let value = format!("{} free", Size(free_bytes));
    if (free_bytes as f64) < needed {
        let remedy = "free some space, record elsewhere, or limit the recording: `record FILE --max-total-mb MB`";
        return Finding::problem(value, format!("{message}, {} are free", Size(free_bytes)), remedy);
    }
    Finding::ok(value, message)
}

/// The ends that listen: the page, the server for timecode, and the commands beside the show.
fn listeners(target: &Target) -> Vec<(&str, Endpoint)> {
    let page = target.view.map(|address| ("view", Endpoint::Listens(Transport::Tcp, address)));
    let timecode = match &target.timecode.source {
        Some(TimecodeInput::Network(source)) => Some(("serve", Endpoint::Listens(Transport::Udp, source.listen))),
        Some(TimecodeInput::Ltc(_)) | None => None,
    };
    let beside = ends(&target.beside, |end| matches!(end, Endpoint::Listens(..)));
    page.into_iter().chain(timecode).chain(beside).collect()
}

/// Whether each port at which the show or a command beside it listens is free.
fn ports(listens: &[(&str, Endpoint)]) -> Finding {
    let twice = listens.iter().enumerate().find_map(|(at, (name, end))| {
        let (earlier, _) = listens[..at].iter().find(|(_, earlier)| earlier == end && end.address().port() != 0)?;
        Some((*earlier, *name, *end))
    });
    if let Some((earlier, name, end)) = twice {
        let (address, transport) = (end.address(), end.transport());
        let message = format!("{earlier} and {name} listen on {address} ({transport})");
        return Finding::problem(address.to_string(), message, "give one of them another port");
    }
    let taken = listens.iter().find_map(|(name, end)| Some((name, *end, end.probe().err()?)));
    match taken {
        Some((name, end, error)) => {
            let (address, transport) = (end.address(), end.transport());
            let message = format!("{name} cannot listen on {address} ({transport}): {error}");
            let remedy = match error.kind() {
                ErrorKind::AddrNotAvailable => {
                    "plug in the network, or choose another address: 0.0.0.0 is all of this machine's"
                }
                ErrorKind::PermissionDenied => "choose a port from 1024 on, which needs no right",
                _ => "end the program that has the port, or choose another port",
            };
            Finding::problem(address.to_string(), message, remedy)
        }
        None if listens.is_empty() => Finding::ok("none", "no process of the show listens"),
        None => {
            let names: Vec<String> = listens
                .iter()
                .map(|(name, end)| format!("{} ({}) for {name}", end.address(), end.transport()))
                .collect();
            Finding::ok(names.len().to_string(), format!("free: {}", names.join(", ")))
        }
    }
}

/// Whether this machine has a way to each desk. Whether the desk listens cannot be known: UDP has no answer.
fn desks(beside: &[AlsoCommand]) -> Finding {
    let sends = ends(beside, |end| matches!(end, Endpoint::Sends(..)));
    let mut ways = Vec::new();
    for (name, end) in &sends {
        let address = end.address();
        match end.probe() {
            Ok(from) => ways.push(format!("{name} to {address} from {}", from.ip())),
            Err(error) => {
                let message = format!("{name} has no way to {address}: {error}");
                return Finding::problem(address.to_string(), message, "plug in or set up the network of the desks");
            }
        }
    }
    if ways.is_empty() {
        return Finding::ok("none", "no command beside the show sends to a desk");
    }
    Finding::ok(ways.len().to_string(), format!("{}; look at each desk whether it receives", ways.join(", ")))
}

fn ends(beside: &[AlsoCommand], is_wanted: impl Fn(&Endpoint) -> bool) -> Vec<(&str, Endpoint)> {
    let of = |command: &AlsoCommand| command.endpoints().into_iter().filter(&is_wanted).collect::<Vec<_>>();
    beside.iter().flat_map(|command| of(command).into_iter().map(|end| (command.name(), end))).collect()
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, UdpSocket};

    use bench_dragon_ipc::Instance;

    use super::*;
    use crate::cli::doctor::finding::Verdict;

    fn config(toml: &str) -> Config {
        Config::from_toml(toml).expect("a valid configuration")
    }

    fn beside(lines: &[String]) -> Vec<AlsoCommand> {
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        AlsoCommand::read_all(&lines, &Instance::default()).expect("commands beside a show")
    }

    #[test]
    fn a_plan_is_ok_up_to_an_end_before_the_margin_and_a_warning_beyond_it_or_with_a_guard_a_problem() {
        let judged = |config: &Config| judge_plan(config, config.start_s(), config.end_s());
        let short = judged(&config("[route]\nend_s = 400.0\n"));
        assert_eq!((short.status, short.value.as_str()), (Verdict::Ok, "400.0 s"), "{short:?}");
        let until = judge_plan(&config(""), 0.0, 300.0);
        assert_eq!((until.status, until.value.as_str()), (Verdict::Ok, "300.0 s"), "{until:?}");
        let whole = judged(&config(""));
        assert_eq!(whole.status, Verdict::Warning, "{whole:?}");
        let guarded = judged(&config("[monitor]\nguard = true\n"));
        assert_eq!((guarded.status, &guarded.value), (Verdict::Problem, &whole.value));
        let stop_s: f64 = whole.value.trim_end_matches(" s").parse().expect("a number");
        assert!((400.0..412.474).contains(&stop_s), "{whole:?}");
    }

    #[test]
    fn a_taken_port_is_a_problem_that_names_command_and_address() {
        let tcp = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let taken = tcp.local_addr().expect("an address");
        let listens = |lines: &[String]| {
            let beside = beside(lines);
            ports(&ends(&beside, |end| matches!(end, Endpoint::Listens(..))))
        };
        let finding = listens(&[format!("view --listen {taken}")]);
        assert_eq!((finding.status, finding.value), (Verdict::Problem, taken.to_string()));
        assert!(finding.message.starts_with(&format!("view cannot listen on {taken} (TCP): ")), "{}", finding.message);
        drop(tcp);
        let twice = listens(&[format!("view --listen {taken}"), format!("metrics --listen {taken}")]);
        let words = format!("view and metrics listen on {taken} (TCP)");
        assert_eq!((twice.status, twice.message), (Verdict::Problem, words));
        let udp = UdpSocket::bind("127.0.0.1:0").expect("a free port").local_addr().expect("an address");
        let finding = listens(&[format!("bridge osc --listen {udp} --allow 127.0.0.1")]);
        assert_eq!((finding.status, finding.message), (Verdict::Ok, format!("free: {udp} (UDP) for bridge osc")));
        assert_eq!(ports(&[]).status, Verdict::Ok);
        // Of the addresses for documentation (RFC 5737), which no machine has.
        let foreign = listens(&["metrics --listen 192.0.2.1:9184".to_owned()]);
        assert_eq!(foreign.status, Verdict::Problem);
        let remedy = "plug in the network, or choose another address: 0.0.0.0 is all of this machine's";
        assert_eq!(foreign.remedy.as_deref(), Some(remedy));
    }

    #[test]
    fn a_show_that_plays_another_configuration_is_a_problem_that_names_the_first_difference() {
        let [slow, quick] = ["", "[serve]\nrate_hz = 50\n"].map(|toml| config(toml).to_toml());
        assert_eq!(judge_configuration(&slow, &slow).status, Verdict::Ok);
        let other = judge_configuration(&slow, &quick);
        assert_eq!(other.status, Verdict::Problem);
        assert!(other.message.ends_with("`rate_hz = 1000` there, `rate_hz = 50` here"), "{}", other.message);
        let shorter = judge_configuration("a = 1\nb = 2\n", "a = 1\n");
        assert!(shorter.message.ends_with("`b = 2` there, `nothing` here"), "{}", shorter.message);
    }

    #[test]
    fn each_desk_has_a_way() {
        let finding = desks(&beside(&["bridge psn --to 127.0.0.1:56565".to_owned(), "hz".to_owned()]));
        let words = "bridge psn to 127.0.0.1:56565 from 127.0.0.1; look at each desk whether it receives";
        assert_eq!((finding.status, finding.message.as_str()), (Verdict::Ok, words));
        let multicast = desks(&beside(&["bridge psn --interface 127.0.0.1".to_owned()]));
        assert!(multicast.message.starts_with("bridge psn to 236.10.10.10:56565 from 127.0.0.1"), "{multicast:?}");
        // An address for documentation (RFC 5737), which no machine has.
        for line in ["bridge psn --interface 192.0.2.77", "bridge osc --to 127.0.0.1:9000 --interface 192.0.2.77"] {
            assert_eq!(desks(&beside(&[line.to_owned()])).status, Verdict::Problem, "{line}");
        }
        assert_eq!(desks(&[]).value, "none");
    }
}

//! `doctor --tonight`: whether the timecode that the show is to follow arrives.
//!
//! Before the show, this process listens where the server will. While the show runs, the server's status has the answer.

use std::net::SocketAddr;
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::TimecodeState;

use super::server::status_of;
use super::{Finding, Target};
use crate::cli::timecode::TimecodeArgs;
use crate::output::Counted;
use crate::source::timecode::{Position, SampleQueue, TimecodeInput, TimecodeReceiver, TimecodeSample, TimecodeSource};

/// Longest wait for the first timecode. A desk sends 24 to 30 a second.
const PATIENCE: Duration = Duration::from_secs(3);
/// Time after the first timecode in which its pace is judged.
const LISTEN: Duration = Duration::from_millis(500);
/// Time between two looks.
const LOOK_PERIOD: Duration = Duration::from_millis(10);
/// Difference from the clock's pace that counts as running: packets may be late.
const SLACK_S: f64 = 0.25;
const SEND_IT: &str = "start the desk's timecode, and let it send to";

/// The packets that the receiver has heard.
struct Heard {
    listen: SocketAddr,
    samples: Vec<TimecodeSample>,
    malformed: u64,
}

/// Whether the timecode arrives.
pub(super) fn timecode(target: &Target) -> Finding {
    let source = match &target.timecode.source {
        Some(TimecodeInput::Network(source)) => Some(source),
        // A show refuses sound.
        Some(TimecodeInput::Ltc(_)) | None => None,
    };
    match source {
        _ if target.has_server() => {
            judge_state(source.is_some(), status_of(target).and_then(|status| status.timecode_state()))
        }
        Some(source) => listen(source, &target.timecode),
        None => Finding::ok("none", "the show follows no timecode (`--timecode`)"),
    }
}

/// Judges the state of the timecode by the status of the server that runs.
fn judge_state(is_asked: bool, state: Option<TimecodeState>) -> Finding {
    let Some(state) = state else {
        return Finding::not_known("the server sends no status, or leftovers prevent the check");
    };
    let value = state.to_string();
    match state {
        TimecodeState::None if is_asked => Finding::problem(
            value,
            "the server that runs follows no timecode",
            "start the show again with `--timecode`",
        ),
        TimecodeState::None => Finding::ok(value, "the show follows no timecode"),
        TimecodeState::Locked => Finding::ok(value, "it runs, and the show follows"),
        TimecodeState::Standing => Finding::ok(value, "it stands, and so does the show"),
        TimecodeState::Waiting => {
            Finding::problem(value, "no timecode has arrived yet", format!("{SEND_IT} this machine"))
        }
        TimecodeState::Lost => Finding::problem(value, "the timecode is lost", "look at the desk and its network"),
    }
}

fn listen(source: &TimecodeSource, args: &TimecodeArgs) -> Finding {
    let rate = args.frame_rate.unwrap_or_default();
    let started = TimecodeReceiver::start(source.clone(), rate, PATIENCE.as_nanos() as u64);
    let (receiver, mut inbox) = match started {
        Ok(started) => started,
        Err(error) => {
            let message = format!("{:#}", anyhow::Error::from(error));
            return Finding::problem(
                source.to_string(),
                message,
                "see the addresses and ports of timecode in docs/reference/timecode.md",
            );
        }
    };
    let samples = hear(&mut inbox);
    let heard = Heard { listen: receiver.listen, samples, malformed: receiver.counts().malformed };
    judge_heard(&heard, args.offset_s.unwrap_or(0.0))
}

/// Waits for the first timecode, and takes what arrives for a moment from then on.
fn hear(inbox: &mut SampleQueue) -> Vec<TimecodeSample> {
    let mut samples = Vec::new();
    let mut end = Instant::now() + PATIENCE;
    while Instant::now() < end {
        let is_first = samples.is_empty();
        samples.extend(inbox.take());
        if is_first && !samples.is_empty() {
            end = Instant::now() + LISTEN;
        }
        thread::sleep(LOOK_PERIOD);
    }
    samples.extend(inbox.take());
    samples
}

fn judge_heard(Heard { listen, samples, malformed }: &Heard, offset_s: f64) -> Finding {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        let wait_s = PATIENCE.as_secs();
        if *malformed > 0 {
            let packets = Counted(*malformed, "packet");
            return Finding::problem(
                packets.to_string(),
                format!("{packets} at {listen}, and none is a timecode of the expected form"),
                "compare the desk's settings with the forms in docs/reference/timecode.md",
            );
        }
        return Finding::problem(
            "silent",
            format!("no timecode at {listen} within {wait_s} s"),
            format!("{SEND_IT} {listen}"),
        );
    };
    let value = clock(last.position);
    if samples.len() < 2 {
        let message = format!("one timecode, {value}, and no second one: a show follows only two that agree");
        return Finding::warning(value, message, "let the desk send its timecode at 24 to 30 frames a second");
    }
    let walked_s = advance_s(first.position, last.position);
    let waited_s = last.arrived_ns.saturating_sub(first.arrived_ns) as f64 * 1e-9;
    let show_time = Fixed::<3>(last.position.since_midnight_s + offset_s);
    if walked_s == 0.0 {
        return Finding::ok(&*value, format!("it stands at {value}, show time {show_time} s"));
    }
    if (walked_s - waited_s).abs() > SLACK_S {
        let (walked, waited) = (Fixed::<1>(walked_s), Fixed::<1>(waited_s));
        let message =
            format!("it is at {value}, and went {walked} s in {waited} s: a show follows a pace of 0.95 to 1.05");
        return Finding::warning(value, message, "let the desk play at its normal pace");
    }
    Finding::ok(&*value, format!("it runs, at {value}, show time {show_time} s"))
}

/// Seconds from one position to another, by the shorter way around the day.
fn advance_s(from: Position, to: Position) -> f64 {
    let difference_s = to.since_midnight_s - from.since_midnight_s;
    difference_s - (difference_s / to.day_s).round() * to.day_s
}

/// Hours, minutes and seconds.
fn clock(position: Position) -> String {
    let millis = (position.since_midnight_s * 1e3).round() as u64;
    let (seconds, minutes, hours) = (millis / 1000 % 60, millis / 60_000 % 60, millis / 3_600_000);
    format!("{hours:02}:{minutes:02}:{seconds:02}.{:03}", millis % 1000)
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::cli::doctor::finding::Verdict;

    fn heard(samples: &[(f64, f64)]) -> Heard {
        let sample = |&(at_s, position_s): &(f64, f64)| TimecodeSample {
            position: Position { since_midnight_s: position_s, day_s: 86_400.0 },
            arrived_ns: (at_s * 1e9) as u64,
        };
        let listen = "127.0.0.1:7000".parse().expect("an address");
        Heard { listen, samples: samples.iter().map(sample).collect(), malformed: 0 }
    }

    fn status(samples: &[(f64, f64)]) -> Verdict {
        judge_heard(&heard(samples), 0.0).status
    }

    #[test]
    fn silence_and_packets_of_another_form_are_problems() {
        let silent = judge_heard(&heard(&[]), 0.0);
        assert_eq!((silent.status, &*silent.message), (Verdict::Problem, "no timecode at 127.0.0.1:7000 within 3 s"));
        let malformed = judge_heard(&Heard { malformed: 3, ..heard(&[]) }, 0.0);
        assert_eq!((malformed.status, &*malformed.value), (Verdict::Problem, "3 packets"));
    }

    #[test]
    fn timecode_that_runs_or_stands_is_ok_and_one_that_winds_is_a_warning() {
        let runs = judge_heard(&heard(&[(5.0, 3600.0), (5.5, 3600.52)]), -3600.0);
        assert_eq!((runs.status, &*runs.message), (Verdict::Ok, "it runs, at 01:00:00.520, show time 0.520 s"));
        assert_eq!(status(&[(5.0, 3600.0), (5.4, 3600.0)]), Verdict::Ok);
        assert_eq!(status(&[(5.0, 3600.0), (5.4, 3604.0)]), Verdict::Warning);
        assert_eq!(status(&[(5.0, 3600.0), (5.4, 3599.6)]), Verdict::Warning);
        assert_eq!(status(&[(5.0, 3600.0)]), Verdict::Warning);
        // Past midnight.
        assert_eq!(status(&[(5.0, 86_399.8), (5.4, 0.2)]), Verdict::Ok);
    }

    #[test]
    fn the_status_of_a_running_server_decides() {
        let judged = |is_asked, state| judge_state(is_asked, state).status;
        assert_eq!(judged(true, Some(TimecodeState::Locked)), Verdict::Ok);
        assert_eq!(judged(true, Some(TimecodeState::Standing)), Verdict::Ok);
        assert_eq!(judged(true, Some(TimecodeState::Waiting)), Verdict::Problem);
        assert_eq!(judged(true, Some(TimecodeState::Lost)), Verdict::Problem);
        assert_eq!(judged(true, Some(TimecodeState::None)), Verdict::Problem);
        assert_eq!(judged(false, Some(TimecodeState::None)), Verdict::Ok);
        assert_eq!(judged(true, None), Verdict::NotKnown);
    }

    #[test]
    fn a_desk_is_heard_on_the_network() {
        let source: TimecodeSource = "osc:127.0.0.1:0".parse().expect("a source");
        let (receiver, mut inbox) =
            TimecodeReceiver::start(source, <_>::default(), 1_000_000_000).expect("a free port");
        let desk = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        let is_over = AtomicBool::new(false);
        let samples = thread::scope(|scope| {
            scope.spawn(|| {
                // `/timecode` with the float 62.5.
                let packet = b"/timecode\0\0\0,f\0\0\x42\x7a\0\0";
                while !is_over.load(Ordering::Relaxed) {
                    desk.send_to(packet, receiver.listen).expect("the receiver listens");
                    thread::sleep(LOOK_PERIOD);
                }
            });
            let samples = hear(&mut inbox);
            is_over.store(true, Ordering::Relaxed);
            samples
        });
        let heard = Heard { listen: receiver.listen, samples, malformed: receiver.counts().malformed };
        let finding = judge_heard(&heard, 0.0);
        assert!(finding.message.contains("00:01:02.500"), "{finding:?}");
        assert_ne!(finding.status, Verdict::Problem);
    }
}

//! Clocks and sources of timecode, and the choice of the sender.

use std::net::IpAddr;

use bench_dragon::source::timecode::{Clock, FrameRate, Malformed, SenderLock, TimecodeSource};

#[test]
fn numbers_out_of_range_are_rejected() {
    let clock = Clock { hours: 23, minutes: 59, seconds: 59, frames: 23 };
    assert!(clock.position_s(FrameRate::Film).is_ok());
    for wrong in [
        Clock { hours: 24, ..clock },
        Clock { minutes: 60, ..clock },
        Clock { seconds: 60, ..clock },
        Clock { frames: 24, ..clock },
        Clock { hours: u32::MAX, ..clock },
    ] {
        assert_eq!(wrong.position_s(FrameRate::Film), Err(Malformed), "{wrong:?}");
    }
}

#[test]
fn rates_are_read_in_their_usual_notation() {
    let rates = [24.0, 25.0, 29.97, f64::from(29.97_f32), 30_000.0 / 1001.0, 30.0].map(FrameRate::of);
    let drop_frame = Some(FrameRate::DropFrame);
    let [film, ebu, smpte] = [FrameRate::Film, FrameRate::Ebu, FrameRate::Smpte].map(Some);
    assert_eq!(rates, [film, ebu, drop_frame, drop_frame, drop_frame, smpte]);
    assert_eq!([f64::NAN, 0.0, -25.0, 60.0].map(FrameRate::of), [None; 4]);
}

#[test]
fn a_second_sender_is_accepted_when_the_first_is_lost() {
    let [one, other] = [1, 2].map(|last| IpAddr::from([127, 0, 0, last]));
    let mut sender_lock = SenderLock::new(1_000);
    assert!(sender_lock.admits(one, 0));
    assert!(!sender_lock.admits(other, 900));
    assert!(sender_lock.admits(one, 1_000));
    assert!(!sender_lock.admits(other, 2_000));
    assert!(sender_lock.admits(other, 2_001));
    assert!(!sender_lock.admits(one, 2_002), "now the second sender is accepted");
}

#[test]
fn a_missing_address_is_this_machine_and_a_missing_port_the_usual_one() {
    for (text, whole) in [
        ("osc:7000", "osc:127.0.0.1:7000/timecode"),
        ("osc:0", "osc:127.0.0.1:0/timecode"),
        ("osc:10.0.0.2:7000/time", "osc:10.0.0.2:7000/time"),
        ("osc:[::1]:7000", "osc:[::1]:7000/timecode"),
        ("artnet", "artnet:127.0.0.1:6454"),
        ("artnet:2.0.0.10", "artnet:2.0.0.10:6454"),
        ("artnet:0.0.0.0:6455", "artnet:0.0.0.0:6455"),
    ] {
        assert_eq!(text.parse::<TimecodeSource>().expect(text).to_string(), whole);
    }
}

#[test]
fn other_sources_are_refused() {
    let of_osc = ["osc", "osc:", "osc:70000", "osc:host:7000", "osc:7000/", "osc:7000/a b", "osc:7000/*"];
    let others = ["", "artnet:", "artnet6454", "artnet:x", "midi:1"];
    for text in of_osc.into_iter().chain(others) {
        let error = text.parse::<TimecodeSource>().expect_err(text);
        assert_eq!(
            error,
            "must be osc:[ADDRESS:]PORT[/MESSAGE], MESSAGE without blanks and #*,?[]{}, or artnet[:ADDRESS[:PORT]]"
        );
    }
}

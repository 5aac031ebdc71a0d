//! Packets on the port of timecode. Any process of this machine can send them, and, if the address allows it, any other
//! machine.

use bench_dragon::source::server::motion::{Motion, MotionPlan, MotionSettings};
use bench_dragon::source::timecode::{
    Follower, FollowerSettings, FrameRate, ShowPosition, TimecodeSample, TimecodeSource,
};
use bench_dragon_ipc::Request;

const TICK_NS: u64 = 1_000_000;
const LAST_S: f64 = 432.75;

/// Fails unless a packet is a position within its day, ignored or malformed, and the show stays within its run and goes back
/// only by a seek, for any positions at any time. The first byte selects the source, the second the number of ticks between two
/// packets, the third the length of each packet.
pub(crate) fn check(input: &[u8]) {
    let Some((&[source, ticks, length], packets)) = input.split_first_chunk() else { return };
    let source: TimecodeSource = (if source & 1 == 0 { "osc:0" } else { "artnet" }).parse().expect("a source");
    let settings = FollowerSettings {
        offset_s: 0.0,
        timeout_ns: 100_000_000,
        period_s: 1e-9 * TICK_NS as f64,
        first_s: 0.0,
        last_s: LAST_S,
    };
    let mut follower = Follower::new(settings);
    let mut motion = Motion::new(
        MotionPlan::new(MotionSettings::plain(1e-9 * TICK_NS as f64, 0.0, LAST_S))
            .expect("a tick and two travels in order"),
    );
    let mut now_ns = 1_000_000_000;
    for packet in packets.chunks(usize::from(length).max(1)) {
        if let Ok(Some(position)) = source.position(packet, FrameRate::default()) {
            assert!((0.0..position.day_s).contains(&position.since_midnight_s), "{position:?}");
            follower.hear(TimecodeSample { position, arrived_ns: now_ns });
        }
        for _ in 0..ticks {
            now_ns += TICK_NS;
            tick(&mut follower, &mut motion, now_ns);
        }
    }
}

fn tick(follower: &mut Follower, motion: &mut Motion, now_ns: u64) {
    let before_ns = motion.head().show_time_ns;
    let show = ShowPosition { show_time_s: motion.next_sim_s(), is_stopped: motion.is_stopped(), is_resumed: false };
    let (order, _) = follower.steer(now_ns, show);
    if let Some(show_time_s) = order.seek_s {
        motion.request(Request::Seek { show_time_s }).expect("the time is within the run");
        follower.note_seek(true);
    }
    assert!((Follower::LEAST_TIME_SCALE..=Follower::GREATEST_TIME_SCALE).contains(&order.time_scale));
    motion.set_stands(order.stands);
    motion.set_tick(order.time_scale * 1e-9 * TICK_NS as f64);
    motion.advance();
    let head = motion.head();
    assert!((0.0..=LAST_S).contains(&head.travel_m), "{head:?}");
    assert!(order.seek_s.is_some() || head.show_time_ns >= before_ns, "{head:?} after {before_ns} ns");
}

//! Comparison of the recording with the frames that the server must have published.

use std::path::Path;

use bench_dragon::recording::FrameReader;
use bench_dragon::source::server::Simulation;
use bench_dragon::source::server::motion::{MotionPlan, MotionSettings};
use bench_dragon_ipc::{FrameHeader, HandleState};
use test_support::dragons::{paper_dragon_of, plain_formation};

use crate::RATE_HZ;
use crate::show::Show;

/// Panics unless the recording contains every tick of the show, in order. Each frame must equal, bit for bit, the frame of a
/// simulation that misses the same periods.
pub(crate) fn prove(file: &Path, show: &Show, seconds: u32) {
    assert_eq!((show.frames_recorded, show.frames_lost), (show.frames_published, 0), "{show:?}");
    let periods = u64::from(seconds * RATE_HZ) + 1;
    let most = show.frames_published + show.overruns;
    assert!((show.frames_published..=most).contains(&periods), "the show ran to its end: {show:?}");
    let mut frames = FrameReader::open(file).expect("the recording can be read");
    let dragon = paper_dragon_of(223);
    let mut expected = vec![HandleState::default(); 224];
    let plan = plan(dragon.end_travel_m(), seconds);
    let mut simulation = Simulation::new(plain_formation(dragon), plan, RATE_HZ, 1.0);
    let mut last_due_ns = None;
    for tick in 0..show.frames_published {
        let frame = frames.next().unwrap_or_else(|| panic!("tick {tick} is missing")).expect("a frame can be read");
        let header = frame.header;
        let missed = last_due_ns.map_or(0, |last_due_ns| missed(last_due_ns, header.scheduled_ns));
        last_due_ns = Some(header.scheduled_ns);
        simulation.tick(missed, &mut ());
        simulation.write(&mut expected);
        let stamped = FrameHeader {
            published_ns: header.published_ns,
            ..simulation.header(show.run_id, tick, header.scheduled_ns)
        };
        assert_eq!(header, stamped, "the header of tick {tick}");
        assert!(bits(&frame.handles).eq(bits(&expected)), "the handles of tick {tick}");
    }
    assert!(frames.next().is_none() && !frames.flaws().cut, "a finished file ends with the last tick");
}

/// Number of periods between two frames.
fn missed(last_due_ns: u64, due_ns: u64) -> u64 {
    ((due_ns - last_due_ns) as f64 * f64::from(RATE_HZ) * 1e-9).round() as u64 - 1
}

fn bits(handles: &[HandleState]) -> impl Iterator<Item = u64> {
    handles.iter().flat_map(|handle| [handle.position_m, handle.velocity_mps]).flatten().map(f64::to_bits)
}

fn plan(end_travel_m: f64, seconds: u32) -> MotionPlan {
    // The default catch_up_s, in ticks.
    let most_jumped = u64::from(RATE_HZ) / 4;
    let plain = MotionSettings::plain(1.0 / f64::from(RATE_HZ), 0.0, end_travel_m);
    let settings = MotionSettings { until_s: Some(f64::from(seconds)), most_jumped, ..plain };
    MotionPlan::new(settings).expect("the settings are valid")
}

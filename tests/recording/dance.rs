//! Frames to record: a dragon on a spiral, with coordinates as irregular as in a real show.

use std::{
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};

use bench_dragon::recording::{FrameReader, RecordedFrame, Recorder, RecorderSettings};
use bench_dragon_ipc::{Alert, AlertKind, FrameHeader, HandleState, frame_bytes};

/// Benches of the paper's dragon.
pub(crate) const BENCHES: u32 = 223;
/// Unix time minus monotonic time in nanoseconds, in each recording of these tests.
pub(crate) const OFFSET_NS: i64 = 1_790_000_000_123_456_789;
/// Run of each frame of these tests.
pub(crate) const RUN_ID: u64 = 0x1f_ffff_0000_0001;
/// The description of the frames.
pub(crate) const TOML: &str = "[dragon]\nbenches = 223\nhead_length_m = 3.41\nbody_length_m = 2.2\nwidth_m = 0.3\n";

const RATE_HZ: u64 = 1_000;
const PITCH_M: f64 = 0.55;
const LINK_M: f64 = 1.65;

/// A frame of the bus.
#[derive(Clone, Debug)]
pub(crate) struct Frame {
    pub header: FrameHeader,
    pub handles: Vec<HandleState>,
}

/// Returns the frame of a tick.
pub(crate) fn frame(tick: u64, benches: u32) -> Frame {
    let scheduled_ns = 5_000_000_000_000 + tick * 1_000_000_000 / RATE_HZ;
    let travel_m = tick as f64 / RATE_HZ as f64;
    let header = FrameHeader {
        run_id: RUN_ID,
        tick,
        show_time_ns: (tick * 1_000_000_000 / RATE_HZ).cast_signed() - 100_000_000_000,
        scheduled_ns,
        published_ns: scheduled_ns + 20_000 + tick % 7_001,
        head_travel_m: travel_m,
        head_speed_mps: 1.0 + (travel_m * 0.1).sin() * 1e-3,
        time_scale: 1.0,
        bench_count: benches,
        state: (tick / 100 % 4) as u32,
        ..FrameHeader::default()
    }
    .of_one_dragon();
    Frame { header, handles: (0..=benches).map(|index| handle(travel_m - f64::from(index) * LINK_M)).collect() }
}

/// Returns the frames of the first ticks.
pub(crate) fn frames(count: u64, benches: u32) -> Vec<Frame> {
    (0..count).map(|tick| frame(tick, benches)).collect()
}

/// Returns an alert about the frame of a tick.
pub(crate) fn alert(tick: u64) -> Alert {
    Alert {
        run_id: RUN_ID,
        tick,
        show_time_ns: -7,
        forecast_ns: Alert::NO_FORECAST,
        clearance_m: -1.0 / 3.0,
        point_m: [0.1, -0.0],
        kind: AlertKind::Contact.to_wire(),
        bench_a: 0,
        bench_b: 8,
        reserved: 0,
    }
}

/// Returns the state of a handle on the spiral, `travel_m` metres after (8.8, 0).
fn handle(travel_m: f64) -> HandleState {
    let growth_m = PITCH_M / std::f64::consts::TAU;
    let angle = (2.0 * (442.6 - travel_m) / growth_m).sqrt();
    let (sin, cos) = angle.sin_cos();
    HandleState {
        position_m: [growth_m * angle * cos, growth_m * angle * sin, 0.0],
        velocity_mps: [sin - cos / angle, -cos - sin / angle, 0.0],
    }
}

/// Returns the settings for one file in a folder.
pub(crate) fn settings(folder: &Path) -> RecorderSettings {
    RecorderSettings::new(folder.join("show.mcap"), OFFSET_NS)
}

/// Records frames with their configuration, and finishes the recording. Returns the first file.
pub(crate) fn record(settings: RecorderSettings, frames: &[Frame]) -> PathBuf {
    let path = settings.file.clone();
    let mut recorder = Recorder::start(settings).expect("a recorder");
    recorder.describe(RUN_ID, TOML).expect("the configuration");
    for Frame { header, handles } in frames {
        recorder.frame(header, handles).expect("a frame");
    }
    let summary = recorder.finish().expect("a finished recording");
    assert_eq!(summary.frames, frames.len() as u64);
    path
}

/// Returns all frames of a recording, and whether it was cut.
pub(crate) fn read(path: &Path) -> (Vec<RecordedFrame>, bool) {
    let mut reader = FrameReader::open(path).expect("a recording");
    let frames = reader.by_ref().collect::<Result<_, _>>().expect("readable frames");
    (frames, reader.flaws().cut)
}

/// Returns the summary of a finished file; `None` for an unfinished one.
pub(crate) fn summary(path: &Path) -> Option<mcap::Summary> {
    let bytes = std::fs::read(path).expect("a file");
    mcap::Summary::read(&bytes).ok().flatten()
}

/// Returns the configuration in a file, which may be unfinished.
pub(crate) fn configuration_toml(path: &Path) -> Option<String> {
    let mut reader = FrameReader::open(path).expect("a recording");
    reader.by_ref().for_each(drop);
    reader.configuration().map(|configuration| configuration.toml.clone())
}

/// Returns the log times of all messages on a topic.
pub(crate) fn log_times_ns(path: &Path, topic: &str) -> Vec<u64> {
    let file = BufReader::new(File::open(path).expect("a recording"));
    let messages = mcap::io::MessageReader::new(file).map(|message| message.expect("a message"));
    messages.filter(|message| message.channel.topic == topic).map(|message| message.log_time).collect()
}

/// Fails unless both have the same frames, bit for bit.
pub(crate) fn assert_same(recorded: &[RecordedFrame], sent: &[Frame]) {
    assert_eq!(recorded.len(), sent.len(), "number of frames");
    for (recorded, sent) in recorded.iter().zip(sent) {
        let recorded_bytes = frame_bytes(&recorded.header, &recorded.handles);
        assert!(recorded_bytes == frame_bytes(&sent.header, &sent.handles), "tick {} differs", sent.header.tick);
    }
}

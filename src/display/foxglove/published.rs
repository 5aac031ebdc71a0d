//! What is published at one instant: a snapshot, and its messages. Each message is encoded once for all viewers, when the first one
//! needs it.

use std::sync::{Arc, OnceLock};

use serde_json::{Value, json};

use super::channels::{Channel, pose_topics};
use super::parameters::parameters_of;
use crate::display::observe::{DescribedRun, FrameCopy, Snapshot};
use crate::recording::{Boards, cdr, channel_names, encode_scene};
use crate::system::clock::{monotonic_ns, offset_bounds};
use crate::system::unix_offset::UnixOffset;

/// Makes what is published of snapshots.
#[derive(Debug, Default)]
pub(super) struct Publisher {
    unix_offset: Option<UnixOffset>,
    run: Option<(Arc<DescribedRun>, Arc<PublishedRun>)>,
    last: Option<Arc<FrameCopy>>,
    frames: u64,
}

/// What of a run is the same for all of its frames.
#[derive(Debug)]
pub(super) struct PublishedRun {
    /// The dragons whose frames of reference and topics have names.
    names: Vec<String>,
    /// The topics of the poses.
    pub(super) pose_topics: Vec<String>,
    pub(super) parameters: Vec<Value>,
    boards: Option<Boards>,
}

/// A snapshot and its messages.
#[derive(Debug, Default)]
pub(super) struct Published {
    pub(super) snapshot: Snapshot,
    /// Number of frames up to this one; a snapshot without a new frame has that of the one before.
    pub(super) frames: u64,
    /// The run of the snapshot's frame. `None` until its description has arrived.
    pub(super) run: Option<Arc<PublishedRun>>,
    unix_offset_ns: i64,
    poses: Vec<OnceLock<Vec<u8>>>,
    transforms: OnceLock<Vec<u8>>,
    boards: OnceLock<Vec<u8>>,
    status: OnceLock<Vec<u8>>,
}

impl Publisher {
    pub(super) fn publish(&mut self, snapshot: Snapshot) -> Published {
        let unix_offset = self.unix_offset.get_or_insert_with(UnixOffset::measured);
        unix_offset.correct(offset_bounds());
        let unix_offset_ns = unix_offset.ns();
        let is_known = match (&self.last, &snapshot.frame) {
            (Some(last), Some(frame)) => Arc::ptr_eq(last, frame),
            (_, frame) => frame.is_none(),
        };
        if !is_known {
            self.last.clone_from(&snapshot.frame);
            self.frames += 1;
        }
        let run = snapshot.run.as_ref().map(|run| self.run_of(run));
        let poses = run.as_ref().map_or(0, |run| run.pose_topics.len());
        let poses = std::iter::repeat_with(OnceLock::new).take(poses).collect();
        Published { frames: self.frames, run, unix_offset_ns, poses, snapshot, ..Published::default() }
    }

    fn run_of(&mut self, run: &Arc<DescribedRun>) -> Arc<PublishedRun> {
        match &self.run {
            Some((known, published)) if Arc::ptr_eq(known, run) => Arc::clone(published),
            _ => {
                let published = Arc::new(PublishedRun::of(run));
                self.run = Some((Arc::clone(run), Arc::clone(&published)));
                published
            }
        }
    }
}

impl PublishedRun {
    fn of(run: &DescribedRun) -> Self {
        let toml = run.config.to_toml();
        let names = channel_names(&toml);
        Self {
            pose_topics: pose_topics(&names),
            names,
            parameters: parameters_of(run.run_id, &toml),
            boards: Boards::of_toml(&toml),
        }
    }
}

impl Published {
    /// The bridge's clock: the Unix time at which the frame was sent. Without a frame, the present.
    pub(super) fn clock_ns(&self) -> u64 {
        self.unix_ns(self.snapshot.header().map_or_else(monotonic_ns, |header| header.published_ns))
    }

    fn unix_ns(&self, monotonic_ns: u64) -> u64 {
        monotonic_ns.saturating_add_signed(self.unix_offset_ns)
    }

    /// The frame's message of a channel. `None` without a frame, without its description, and of channels of events.
    pub(super) fn message(&self, channel: Channel) -> Option<&[u8]> {
        let cell = match channel {
            Channel::Poses(dragon) => self.poses.get(dragon)?,
            Channel::Transforms => &self.transforms,
            Channel::Boards => &self.boards,
            Channel::Status => {
                return Some(self.status.get_or_init(|| status(&self.snapshot).to_string().into_bytes()));
            }
            Channel::Alerts | Channel::Commands => return None,
        };
        let (frame, run) = (self.snapshot.frame.as_ref()?, self.run.as_ref()?);
        let FrameCopy { header, handles } = &**frame;
        let are_described = header.dragons().len() == run.pose_topics.len() && header.has_handles(handles.len());
        if !are_described || (channel == Channel::Boards && run.boards.is_none()) {
            return None;
        }
        Some(cell.get_or_init(|| {
            let (mut message, unix_ns) = (Vec::new(), self.unix_ns(header.scheduled_ns));
            match channel {
                Channel::Poses(dragon) => {
                    cdr::encode_poses(&mut message, unix_ns, &handles[header.dragons()[dragon].handles()]);
                }
                Channel::Transforms => {
                    cdr::encode_transforms(&mut message, unix_ns, header, handles, &run.names);
                }
                _ => {
                    let boards = run.boards.as_ref().expect("they are known");
                    encode_scene(&mut message, unix_ns, header, handles, boards);
                }
            }
            message
        }))
    }
}

/// The status of a snapshot as numbers to plot. An unknown value is absent.
fn status(snapshot: &Snapshot) -> Value {
    let mut status = json!({ "link": snapshot.presence.name(), "lost": snapshot.statistics.lost });
    let mut set = |key: &str, value: Value| status[key] = value;
    if let Some(state) = snapshot.state() {
        set("state", state.name().into());
    }
    if let Some(header) = snapshot.header() {
        set("run_id", header.run_id.into());
        set("tick", header.tick.into());
        set("show_time_s", (header.show_time_ns as f64 * 1e-9).into());
        set("travel_m", header.head_travel_m.into());
        set("speed_mps", header.head_speed_mps.into());
        set("time_scale", header.time_scale.into());
        if let Some(named) = snapshot.config().and_then(|config| config.named()) {
            let dragons = named.dragons().iter().zip(header.dragons());
            let dragon = dragons.map(|(named, motion)| {
                json!({ "name": named.name, "travel_m": motion.travel_m, "speed_mps": motion.speed_mps })
            });
            set("dragons", dragon.collect());
        }
    }
    if let Some(nearest) = &snapshot.nearest {
        set("clearance_m", nearest.clearance_m.into());
        set("clearance_benches", json!(nearest.benches));
    }
    if let Some(least) = snapshot.least {
        set("least_clearance_m", least.clearance_m.into());
    }
    if let Some(server) = &snapshot.status {
        set("rate_hz", server.rate_hz.into());
        set("overruns", server.overruns.into());
        set("behind_s", (server.behind_ns as f64 * 1e-9).into());
    }
    status
}

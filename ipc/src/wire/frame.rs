//! A frame: the state of all dragons of a show at one tick, in its shared-memory layout.
//!
//! A frame is a [`FrameHeader`] and one [`HandleState`] per handle, dragon after dragon. A dragon of N benches has N + 1 handles.
//! Its handle i is the front hinge of its bench i, and its handle N the rear hinge of its last bench.

use std::mem::offset_of;
use std::ops::Range;

use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use super::bench::BenchState;
use super::wire_enum::wire_enum;

/// Greatest number of dragons of a show.
pub const MAX_DRAGONS: usize = 32;

/// Values of a frame that concern the whole show, and one entry for each dragon: the user header of the `bench-dragon/frames`
/// service.
///
/// 1120 bytes, little-endian, no padding. A changed layout has a new type name.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.FrameHeader.v2")]
pub struct FrameHeader {
    /// Random number of the run, under 2^53. It changes when the source is restarted.
    pub run_id: u64,
    /// Number of the frame in its run, from 0, without a gap. A jump means that this reader lost frames.
    pub tick: u64,
    /// Show time in nanoseconds.
    pub show_time_ns: i64,
    /// `CLOCK_MONOTONIC` instant at which the tick was due, in nanoseconds.
    pub scheduled_ns: u64,
    /// `CLOCK_MONOTONIC` instant at which the frame was sent, in nanoseconds.
    pub published_ns: u64,
    /// Signed arc length that the head of the leading dragon has walked since t = 0, in metres.
    pub head_travel_m: f64,
    /// Speed of that head in metres per show second; 0 while it stands.
    pub head_speed_mps: f64,
    /// Show seconds per wall-clock second.
    pub time_scale: f64,
    /// Number of benches of all dragons; the frame has one handle state more for each dragon.
    pub bench_count: u32,
    /// A [`ShowState`] as its number. Read it with [`FrameHeader::show_state`].
    pub state: u32,
    /// Place of the show on its course, in metres: the one number on which the poses of all dragons depend. Of several dragons it
    /// is plan time × the planned speed of the leading dragon. Of one dragon it is the travel of its head.
    pub course_m: f64,
    /// Speed along the course, in metres per show second; 0 while the show stands.
    pub course_mps: f64,
    /// Number of dragons.
    pub dragon_count: u32,
    /// 1 where the course is a plan, 0 where it is the travel of the only head.
    pub is_plan: u32,
    /// The dragons, the leading one first; entries beyond their number are 0. Read them with [`FrameHeader::dragons`].
    pub dragons: [DragonMotion; MAX_DRAGONS],
}

const _: () = assert!(size_of::<FrameHeader>() == 1120 && align_of::<FrameHeader>() == 8);

impl FrameHeader {
    /// Bytes of the fields up to `state`: all values of a frame of one dragon.
    pub const SHOW_BYTES: usize = offset_of!(Self, course_m);

    /// The header of a frame of one dragon whose first [`SHOW_BYTES`](Self::SHOW_BYTES) are these.
    pub fn of_show_bytes(bytes: &[u8; Self::SHOW_BYTES]) -> Self {
        let mut header = Self::default();
        header.as_mut_bytes()[..Self::SHOW_BYTES].copy_from_slice(bytes);
        header.of_one_dragon()
    }

    /// The header of a frame of a plan, with its place and speed on the course, and its dragons. `None` for too many dragons.
    #[must_use]
    pub fn of_plan(mut self, [course_m, course_mps]: [f64; 2], dragons: &[DragonMotion]) -> Option<Self> {
        self.dragons = [DragonMotion::default(); MAX_DRAGONS];
        self.dragons.get_mut(..dragons.len())?.copy_from_slice(dragons);
        Some(Self { course_m, course_mps, dragon_count: dragons.len() as u32, is_plan: 1, ..self })
    }

    /// The state of the show, or `None` for a number that this version does not support.
    pub fn show_state(&self) -> Option<ShowState> {
        ShowState::from_wire(self.state)
    }

    /// Number of handle states of the frame: one more than benches for each dragon.
    pub fn handle_count(&self) -> usize {
        self.bench_count as usize + self.dragon_count as usize
    }

    /// The dragons, the leading one first. At most [`MAX_DRAGONS`], whatever number the header states.
    pub fn dragons(&self) -> &[DragonMotion] {
        &self.dragons[..(self.dragon_count as usize).min(MAX_DRAGONS)]
    }

    /// Whether the dragons follow each other and have all benches of the frame, and this number of handles. Frames of the bus and of
    /// recordings have been checked by it.
    ///
    /// ```
    /// use bench_dragon_ipc::{DragonMotion, FrameHeader};
    ///
    /// let motion = |first_handle, bench_count| DragonMotion { first_handle, bench_count, ..DragonMotion::default() };
    /// let of = |dragons: &[DragonMotion]| FrameHeader { bench_count: 3, ..FrameHeader::default() }.of_plan([0.0; 2], dragons);
    /// let header = of(&[motion(0, 2), motion(3, 1)]).expect("not too many dragons");
    /// assert!(header.has_handles(5) && !header.has_handles(4));
    /// assert_eq!((header.place(1), header.place(2)), ((0, 1), (1, 0)));
    /// for wrong in [&[motion(0, 2), motion(2, 1)][..], &[motion(0, 2)], &[]] {
    ///     assert!(!of(wrong).expect("not too many dragons").has_handles(5), "{wrong:?}");
    /// }
    /// ```
    pub fn has_handles(&self, count: usize) -> bool {
        let (mut handles, mut benches) = (0, 0);
        let follow = self.dragons().iter().all(|dragon| {
            let is_next = dragon.first_handle as usize == handles;
            handles += dragon.bench_count as usize + 1;
            benches += dragon.bench_count as usize;
            is_next
        });
        let is_count = (1..=MAX_DRAGONS).contains(&(self.dragon_count as usize));
        is_count && follow && benches == self.bench_count as usize && handles == count
    }

    /// The dragon of a bench that is numbered on from dragon to dragon, and its index within that dragon.
    pub fn place(&self, bench: usize) -> (usize, usize) {
        // A dragon's first handle is preceded by one handle more than benches for each dragon before it.
        let firsts = (0..)
            .zip(self.dragons())
            .map(|(dragon, motion)| (dragon, (motion.first_handle as usize).saturating_sub(dragon)));
        let (dragon, first) = firsts.take_while(|(_, first)| *first <= bench).last().unwrap_or_default();
        (dragon, bench - first)
    }

    /// The benches between these handles of the frame, dragon after dragon, each head first. There is none between two dragons.
    ///
    /// # Panics
    /// If there are fewer handles than the header states.
    pub fn benches(&self, handles: &[HandleState]) -> impl ExactSizeIterator<Item = BenchState> {
        let mut front = 0;
        let mut heads = self.dragons().iter().skip(1).map(|dragon| dragon.first_handle as usize).peekable();
        (0..self.bench_count).map(move |_| {
            // The handle before a head is the tail of the dragon before.
            front += usize::from(heads.next_if_eq(&(front + 1)).is_some());
            front += 1;
            BenchState::between(&handles[front - 1], &handles[front])
        })
    }

    /// The header of a frame of one dragon: course and dragon follow from the values of the head, of benches and of the state.
    #[must_use]
    pub fn of_one_dragon(mut self) -> Self {
        let has_ended = matches!(self.show_state(), Some(ShowState::Finished | ShowState::Ended));
        let state = DragonState::of(self.head_speed_mps, has_ended);
        (self.course_m, self.course_mps) = (self.head_travel_m, self.head_speed_mps);
        (self.dragon_count, self.is_plan) = (1, 0);
        self.dragons[0] = DragonMotion {
            travel_m: self.head_travel_m,
            speed_mps: self.head_speed_mps,
            first_handle: 0,
            bench_count: self.bench_count,
            state: state.to_wire(),
            reserved: 0,
        };
        self
    }

    /// The same header of a show that stands: all speeds are 0, and dragons that walked stand.
    #[must_use]
    pub fn at_rest(mut self) -> Self {
        (self.head_speed_mps, self.course_mps) = (0.0, 0.0);
        if self.is_plan == 0 {
            return self.of_one_dragon();
        }
        for dragon in &mut self.dragons {
            dragon.speed_mps = 0.0;
            if dragon.dragon_state() == Some(DragonState::Walking) {
                dragon.state = DragonState::Standing.to_wire();
            }
        }
        self
    }

    /// Show time in seconds.
    pub fn show_time_s(&self) -> f64 {
        self.show_time_ns as f64 / 1e9
    }

    /// Time between the due instant and the sending of the frame, in nanoseconds.
    pub fn lateness_ns(&self) -> u64 {
        self.published_ns.saturating_sub(self.scheduled_ns)
    }
}

/// A dragon of a frame. 32 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.DragonMotion.v1")]
pub struct DragonMotion {
    /// Signed arc length that its head has walked since t = 0, in metres.
    pub travel_m: f64,
    /// Speed of its head in metres per show second; 0 while it stands.
    pub speed_mps: f64,
    /// Index of its first handle in the frame.
    pub first_handle: u32,
    /// Number of its benches; it has one handle more.
    pub bench_count: u32,
    /// A [`DragonState`] as its number. Read it with [`DragonMotion::dragon_state`].
    pub state: u32,
    /// 0.
    pub reserved: u32,
}

const _: () = assert!(size_of::<DragonMotion>() == 32 && align_of::<DragonMotion>() == 8);

impl DragonMotion {
    /// What the dragon does, or `None` for a number that this version does not support.
    pub fn dragon_state(&self) -> Option<DragonState> {
        DragonState::from_wire(self.state)
    }

    /// Indices of its handles in the frame.
    pub fn handles(&self) -> Range<usize> {
        let first = self.first_handle as usize;
        first..first + self.bench_count as usize + 1
    }

    /// Its benches, head first, where `handles` are all handles of the frame.
    ///
    /// # Panics
    /// If these do not have the handles of the dragon.
    pub fn benches(&self, handles: &[HandleState]) -> impl ExactSizeIterator<Item = BenchState> {
        BenchState::all(&handles[self.handles()])
    }
}

/// Position and velocity of one handle.
///
/// 48 bytes. x right, y away, z up; z is 0 on a flat stage.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.HandleState.v1")]
pub struct HandleState {
    /// Position in metres.
    pub position_m: [f64; 3],
    /// Velocity in metres per show second; 0 while the head stands.
    pub velocity_mps: [f64; 3],
}

const _: () = assert!(size_of::<HandleState>() == 48 && align_of::<HandleState>() == 8);

impl HandleState {
    /// Position seen from above, in metres.
    pub fn plan_view_m(&self) -> [f64; 2] {
        let [x, y, _] = self.position_m;
        [x, y]
    }

    /// Speed in metres per show second.
    pub fn speed_mps(&self) -> f64 {
        let [x, y, z] = self.velocity_mps;
        x.hypot(y).hypot(z)
    }
}

/// Returns the bytes of a frame in one piece, without unused entries: the 72 first ones of its header, then 48 for each handle. Those
/// of a plan go on with `course_m`, `course_mps` and 32 bytes for each dragon.
pub fn frame_bytes(header: &FrameHeader, handles: &[HandleState]) -> Vec<u8> {
    let shown = [&header.as_bytes()[..FrameHeader::SHOW_BYTES], handles.as_bytes()].concat();
    if header.is_plan == 0 {
        return shown;
    }
    [&shown, [header.course_m, header.course_mps].as_bytes(), header.dragons().as_bytes()].concat()
}

wire_enum! {
    /// State of the show.
    #[derive(Eq, Hash)]
    ShowState {
        /// The head walks.
        Running = 0, "running";
        /// Paused by the operator, or by a timecode that stands. `resume` continues.
        Paused = 1, "paused";
        /// Stopped for safety: by a hold, which only `release` lifts, or at the end of the guard's grant.
        Held = 2, "held";
        /// The show has reached the end of the route, of the feasible travel or of the requested time.
        Finished = 3, "finished";
        /// The head still walks and brakes, because of a pause, a hold, a stop or the timecode.
        Stopping = 4, "stopping";
        /// The run has ended in order. This is its last frame.
        Ended = 5, "ended";
        /// The show waits at its start for its first `release`. It is calm: no safety stop.
        Ready = 6, "ready";
        /// The show waits at a cue for GO. It is calm: no safety stop.
        Waiting = 7, "waiting";
    }
}

wire_enum! {
    /// What one dragon does.
    #[derive(Eq, Hash)]
    DragonState {
        /// It stands: it has not left yet, or the whole show stands.
        Standing = 0, "standing";
        /// It walks.
        Walking = 1, "walking";
        /// It has reached its end.
        Ended = 2, "ended";
    }
}

impl DragonState {
    /// The state of a dragon whose head has this speed, and which has reached its end or not.
    pub fn of(speed_mps: f64, has_ended: bool) -> Self {
        match () {
            () if has_ended => Self::Ended,
            () if speed_mps > 0.0 => Self::Walking,
            () => Self::Standing,
        }
    }
}

impl ShowState {
    /// Whether the head may walk. Show time advances only in these states.
    pub fn walks(self) -> bool {
        matches!(self, Self::Running | Self::Stopping)
    }
}

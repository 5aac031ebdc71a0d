//! The supervisor: the command `show`, with its production rules for restarts.

use std::time::{Duration, Instant};

use bench_dragon::supervision::{
    LONGEST_DISK_SILENCE, LONGEST_LOOK, LONGEST_SILENCE, LastSeen, Liveness, Look, MAX_RESTARTS, Phase, Resumption,
    ResumptionSettings,
};
use bench_dragon_ipc::RunStart;

use crate::fault::Part;
use crate::scenario::Scenario;

/// A running show.
#[derive(Debug)]
pub(crate) struct Supervisor {
    /// The instant that stands for 0 of the simulated clock.
    epoch: Instant,
    pub(crate) seen: LastSeen,
    server: Liveness,
    guard: Liveness,
    pub(crate) recorder: Liveness,
    looked_ns: u64,
    pub(crate) has_timecode_run: bool,
}

/// The state of a child's process.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChildState {
    pub(crate) part: Part,
    pub(crate) runs: bool,
    pub(crate) is_stopped: bool,
    /// Whether it has given a sign of life since the last look.
    pub(crate) is_heard: bool,
}

impl Supervisor {
    pub(crate) fn new(scenario: &Scenario, now_ns: u64, epoch: Instant) -> Self {
        let most_restarts = (!scenario.flags.stay).then_some(MAX_RESTARTS);
        let child = |longest_silence| Liveness::new(longest_silence, most_restarts);
        let [server, guard] = [(); 2].map(|()| child(LONGEST_SILENCE));
        let recorder = child(LONGEST_DISK_SILENCE);
        Self { epoch, seen: LastSeen::default(), server, guard, recorder, looked_ns: now_ns, has_timecode_run: false }
    }

    fn at(&self, now_ns: u64) -> Instant {
        self.epoch + Duration::from_nanos(now_ns)
    }

    fn child(&mut self, part: Part) -> &mut Liveness {
        match part {
            Part::Server => &mut self.server,
            Part::Guard => &mut self.guard,
            Part::Recorder => &mut self.recorder,
        }
    }

    /// The recorder waits for room on its disk, unless it has ended too often.
    pub(crate) fn wait_for_room(&mut self) {
        if matches!(self.recorder.phase(), Phase::Due(_)) {
            self.recorder.wait();
        }
    }

    /// The disk has room again.
    pub(crate) fn note_room(&mut self, now_ns: u64) {
        let now = self.at(now_ns);
        self.recorder.end_wait(now);
    }

    /// Whether the recorder waits for room, or is given up.
    pub(crate) fn is_recorder_away(&self) -> bool {
        matches!(self.recorder.phase(), Phase::Waiting | Phase::Over | Phase::Idle)
    }

    pub(crate) fn note_start(&mut self, part: Part) {
        self.child(part).start();
    }

    /// Notes the end of a child. Returns whether it is started again.
    pub(crate) fn note_end(&mut self, part: Part, now_ns: u64) -> bool {
        let now = self.at(now_ns);
        self.child(part).end(now).is_some()
    }

    pub(crate) fn is_due(&mut self, part: Part, now_ns: u64) -> bool {
        let now = self.at(now_ns);
        self.child(part).is_due(now)
    }

    /// Looks at all children. Returns those that it kills, since they have given no sign of life for too long.
    pub(crate) fn look(&mut self, now_ns: u64, children: [ChildState; 3]) -> Vec<Part> {
        let elapsed = Duration::from_nanos(now_ns - self.looked_ns).min(LONGEST_LOOK);
        self.looked_ns = now_ns;
        for ChildState { part, is_heard, .. } in children {
            if is_heard {
                self.child(part).hear();
            }
        }
        let has_frames = self.server.sends_frames();
        let is_silent = |child: &ChildState| {
            let has_occasion = child.part == Part::Server || has_frames;
            let look = Look { elapsed, is_stopped: child.is_stopped, has_occasion };
            child.runs && self.child(child.part).look(look).is_some()
        };
        let mut is_silent = is_silent;
        children.iter().filter(|child| is_silent(child)).map(|child| child.part).collect()
    }

    /// The start of the next server: that of the show, or that of a restarted server.
    pub(crate) fn start_of_server(&self, scenario: &Scenario) -> (RunStart, Option<Resumption>) {
        let flags = scenario.flags;
        let mut args = Vec::new();
        args.extend(flags.until_s.map(|until_s| format!("--until={until_s}")));
        args.extend(flags.stay.then(|| "--stay".to_owned()));
        let settings = ResumptionSettings {
            auto_resume: flags.auto_resume,
            follows_timecode: flags.timecode,
            has_timecode_run: self.has_timecode_run,
        };
        let resumption = self.seen.resumption(settings);
        match &resumption {
            Some(resumption) => args.extend(resumption.args()),
            None => args.extend(flags.held.then(|| "--held".to_owned())),
        }
        let start = bench_dragon::supervision::run_start(&args, &scenario.config);
        let start = start.unwrap_or_else(|error| panic!("serve {args:?} does not start: {error:#}"));
        (RunStart { follows_timecode: flags.timecode, ..start }, resumption)
    }
}

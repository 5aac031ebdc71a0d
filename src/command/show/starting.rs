//! How a show starts its children, for the first time and after they have ended.

use bench_dragon::timecode::FrameRate;
use bench_dragon_ipc::ShowState;

use super::Show;
use super::child::Role;
use super::folder::free_recording;
use crate::cli::TimecodeArgs;

/// Readers that the server waits for: the monitor, the recorder and the show itself.
const READERS: usize = 3;
/// How often the monitor says how it stands, in seconds.
const PROGRESS_PERIOD_S: &str = "0.2";
/// What is told when a restarted server stands held.
const HELD: &str = "the dragon stands where it was, held: `bench-dragon ctl release` lets it walk";

impl Show<'_> {
    pub(super) fn start_server(&mut self) -> anyhow::Result<()> {
        let mut args = self.bus_args();
        args.extend(self.timecode_args());
        args.extend(["--config".to_owned(), self.folder.join("config.toml").display().to_string()]);
        // A page that runs is one reader more, in the place of none of those.
        let readers = READERS + usize::from(self.children.is_running(Role::View));
        args.extend(["--readers".to_owned(), readers.to_string()]);
        if let Some(until_s) = self.args.pace.until {
            args.push(format!("--until={until_s}"));
        }
        match self.last {
            None => args.extend(self.args.pace.start_at.map(|start_s| format!("--start-at={start_s}"))),
            Some(header) => {
                args.push(format!("--start-at={}", header.sim_time_s()));
                args.push(format!("--start-travel={}", header.head_travel_m));
                args.extend(self.walking_speed_mps.map(|speed_mps| format!("--start-speed={speed_mps}")));
                // A show that has stood with its timecode follows on; whoever paused one that ran is asked once more.
                let was_paused = self.paused && self.args.timecode.source.is_some() && !self.account.has_timecode_stood;
                if self.paused && self.args.timecode.source.is_none() {
                    args.push("--paused".to_owned());
                }
                // A guard's stop is no hold: the next grant lifts it.
                let held_by_guard = header.head_travel_m == self.granted_to_m;
                let is_held = header.show_state() == Some(ShowState::Held) && !held_by_guard;
                if !self.args.auto_resume || is_held || was_paused {
                    args.push("--held".to_owned());
                    self.account.line.say(HELD);
                }
            }
        }
        self.children.start(Role::Serve, &args)
    }

    pub(super) fn start_monitor(&mut self) -> anyhow::Result<()> {
        let mut args = self.bus_args();
        args.extend(["--progress".to_owned(), PROGRESS_PERIOD_S.to_owned()]);
        if self.guarded {
            args.push("--guard".to_owned());
        }
        self.children.start(Role::Monitor, &args)
    }

    pub(super) fn start_recorder(&mut self) -> anyhow::Result<()> {
        let recording = free_recording(&self.folder);
        let args = [vec![recording.display().to_string()], self.bus_args()].concat();
        self.children.start(Role::Record, &args)
    }

    fn timecode_args(&self) -> Vec<String> {
        let TimecodeArgs { source, offset_s, timeout_s, frame_rate } = &self.args.timecode;
        let frames_per_second = frame_rate.map(FrameRate::frames_per_second);
        // The desk goes on sending to where the first server listened.
        let source = source.clone().map(|source| match self.account.timecode_listen {
            Some(listen) => source.at(listen),
            None => source,
        });
        [
            source.map(|source| format!("--timecode={source}")),
            offset_s.map(|offset_s| format!("--timecode-offset={offset_s}")),
            timeout_s.map(|timeout_s| format!("--timecode-timeout={timeout_s}")),
            frames_per_second.map(|fps| format!("--timecode-fps={fps}")),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    pub(super) fn bus_args(&self) -> Vec<String> {
        vec!["--instance".to_owned(), self.domain.instance().to_string()]
    }
}

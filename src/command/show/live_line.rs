//! The one line that shows how it goes, on a terminal.

use std::time::{Duration, Instant};

use bench_dragon_ipc::FrameHeader;

use crate::output::report::MonitorProgress;
use crate::output::{bar, complain, set_live_line};

/// How often the rate is measured anew.
const RATE_PERIOD: Duration = Duration::from_secs(1);

/// The line. Where stderr is no terminal it is not drawn. A terminal that takes nothing shows the newest one when it does again.
#[derive(Debug)]
pub(super) struct LiveLine {
    start_s: f64,
    end_s: f64,
    /// When and at which tick the rate was last measured.
    measured: Option<(Instant, u64)>,
    rate_hz: f64,
}

impl LiveLine {
    /// A line for a show between two show times.
    pub(super) fn new(start_s: f64, end_s: f64) -> Self {
        Self { start_s, end_s, measured: None, rate_hz: 0.0 }
    }

    /// Draws the present.
    pub(super) fn update(&mut self, header: &FrameHeader, progress: &MonitorProgress) {
        self.measure_rate(header.tick);
        let sim_time_s = header.sim_time_s();
        let clearance = progress.clearance_m.map_or("-".to_owned(), |clearance_m| format!("{clearance_m:.4} m"));
        let state = header.show_state().map_or("unknown", |state| state.name());
        set_live_line(Some(format!(
            "{} {sim_time_s:.2} of {:.2} s  {state}  clearance {clearance}  {:.0} Hz  lost {}",
            bar((sim_time_s - self.start_s) / (self.end_s - self.start_s)),
            self.end_s,
            self.rate_hz,
            progress.lost
        )));
    }

    /// Prints a line above it.
    #[expect(clippy::unused_self, reason = "the terminal has one live line: this one")]
    pub(super) fn say(&self, line: &str) {
        complain(line);
    }

    /// Takes the line away.
    #[expect(clippy::unused_self, reason = "as above")]
    pub(super) fn clear(&self) {
        set_live_line(None);
    }

    fn measure_rate(&mut self, tick: u64) {
        let now = Instant::now();
        match self.measured {
            Some((at, last)) if tick >= last => {
                let elapsed = now - at;
                if elapsed >= RATE_PERIOD {
                    self.rate_hz = (tick - last) as f64 / elapsed.as_secs_f64();
                    self.measured = Some((now, tick));
                }
            }
            _ => self.measured = Some((now, tick)),
        }
    }
}

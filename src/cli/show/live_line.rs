//! The output of a running show: the live line, and combined near alerts.

use std::time::{Duration, Instant};

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::FrameHeader;

use crate::cli::monitor::lines::{AlertLine, MonitorProgress};
use crate::config::FORECAST_SPEED_MPS;
use crate::output::Counted;
use crate::output::{bar, set_live_line};

/// Period over which the rate is measured.
const RATE_PERIOD: Duration = Duration::from_secs(1);

/// The live line. It is drawn only if stderr is a terminal. A blocked terminal shows the newest line once it accepts output.
#[derive(Default)]
pub(super) struct LiveLine {
    /// Show time at the start of the show, in seconds.
    start_s: f64,
    end: ShowEnd,
    /// The last speed of the head that two updates in a row had, in metres per show second: that of a walk, not of a ramp.
    walking_mps: Option<f64>,
    last_mps: f64,
    /// Instant and tick of the last measurement of the rate.
    measured: Option<(Instant, u64)>,
    rate_hz: f64,
}

/// Where a show ends.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ShowEnd {
    /// Show time of the planned end, in seconds.
    pub(super) planned_s: f64,
    /// Travel at the end of the run, in metres. `None` for a show that ends at a show time, however far the head has walked.
    pub(super) travel_m: Option<f64>,
    /// Acceleration with which the head comes to rest there, in m/s²; `None` for a head that stops at once.
    pub(super) accel_mps2: Option<f64>,
}

impl LiveLine {
    pub(super) fn new(start_s: f64, end: ShowEnd) -> Self {
        Self { start_s, end, ..Self::default() }
    }

    pub(super) fn update(&mut self, header: &FrameHeader, progress: &MonitorProgress) {
        self.measure_rate(header.tick);
        self.note_speed(header.course_mps);
        let (show_time_s, start_s, end_s) = (header.show_time_s(), self.start_s, self.end_s(header));
        let clearance =
            progress.clearance_m.map_or("-".to_owned(), |clearance_m| format!("{} m", Fixed::<4>(clearance_m)));
        let state = header.show_state().map_or("unknown", |state| state.name());
        set_live_line(Some(format!(
            "{} {} of {} s  {state}  clearance {clearance}  {:.0} Hz  lost {}",
            bar((show_time_s - start_s) / (end_s - start_s)),
            Fixed::<2>(show_time_s),
            Fixed::<2>(end_s),
            self.rate_hz,
            progress.lost
        )));
    }

    fn note_speed(&mut self, speed_mps: f64) {
        if speed_mps >= FORECAST_SPEED_MPS && speed_mps.to_bits() == self.last_mps.to_bits() {
            self.walking_mps = Some(speed_mps);
        }
        self.last_mps = speed_mps;
    }

    /// Show time of the end at the speed at which the head last walked, in seconds.
    fn end_s(&self, header: &FrameHeader) -> f64 {
        match (self.end.travel_m, self.walking_mps) {
            (Some(end_m), Some(speed_mps)) => {
                // On its last ramp the head takes twice as long as at its walking speed.
                let ramp_s = self.end.accel_mps2.map_or(0.0, |accel_mps2| speed_mps / (2.0 * accel_mps2));
                header.show_time_s() + (end_m - header.course_m).max(0.0) / speed_mps + ramp_s
            }
            _ => self.end.planned_s,
        }
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

/// Shortest time between two lines about near alerts.
const PERIOD: Duration = Duration::from_secs(10);

/// The near alerts since the last line. The first alert after a quiet period has its own line at once.
#[derive(Debug, Default)]
pub(super) struct NearAlerts {
    last_line: Option<Instant>,
    count: u64,
    /// Show times of the first and the last counted alert, in seconds.
    times_s: [f64; 2],
    nearest: Option<(f64, String)>,
}

impl NearAlerts {
    /// Takes a near alert. Returns its line if it has its own line, else counts it.
    pub(super) fn take(&mut self, alert: &AlertLine, now: Instant) -> Option<String> {
        if self.count == 0 && self.last_line.is_none_or(|line| now - line >= PERIOD) {
            self.last_line = Some(now);
            return Some(alert.words());
        }
        if self.count == 0 {
            self.times_s = [alert.time_s; 2];
        }
        self.times_s[1] = alert.time_s;
        self.count += 1;
        if let (Some(clearance_m), Some(who)) = (alert.clearance_m, alert.who())
            && self.nearest.as_ref().is_none_or(|(least_m, _)| clearance_m < *least_m)
        {
            self.nearest = Some((clearance_m, who));
        }
        None
    }

    /// Returns the line about all counted alerts, if it is due.
    pub(super) fn due(&mut self, now: Instant) -> Option<String> {
        let is_due = self.last_line.is_none_or(|line| now - line >= PERIOD);
        if is_due { self.rest(now) } else { None }
    }

    /// Returns the line about all counted alerts, due or not.
    pub(super) fn rest(&mut self, now: Instant) -> Option<String> {
        if self.count == 0 {
            return None;
        }
        let Self { count, times_s: [from_s, to_s], nearest, .. } = std::mem::take(self);
        self.last_line = Some(now);
        let nearest = nearest.map_or(String::new(), |(clearance_m, who)| {
            format!(", raised at {} mm or more, the nearest of {who}", Fixed::<1>(1000.0 * clearance_m))
        });
        Some(format!(
            "{} to {} s: {}{nearest}",
            Fixed::<6>(from_s),
            Fixed::<6>(to_s),
            Counted(count, "more near alert")
        ))
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::AlertKind;

    use super::*;
    use crate::safety::monitor::run_alert;

    fn alert(time_s: f64, benches: [u32; 2], clearance_m: f64) -> AlertLine {
        let near = AlertLine::of(&run_alert(&FrameHeader::default(), AlertKind::Near), None);
        AlertLine { time_s, benches: Some(benches), clearance_m: Some(clearance_m), ..near }
    }

    #[test]
    fn the_end_of_a_slower_walk_is_later_unless_the_show_ends_at_a_time() {
        let at = |time_s: f64, course_m, course_mps| FrameHeader {
            show_time_ns: (time_s * 1e9) as i64,
            course_m,
            course_mps,
            ..FrameHeader::default()
        };
        let end_s = |travel_m| {
            let mut line = LiveLine::new(0.0, ShowEnd { planned_s: 62.0, travel_m, accel_mps2: None });
            let mut seen = vec![line.end_s(&at(0.0, 0.0, 0.0))];
            for header in
                [at(1.0, 1.0, 1.0), at(2.0, 2.0, 1.0), at(2.5, 2.375, 0.8), at(3.0, 2.5, 0.5), at(4.0, 3.0, 0.5)]
            {
                line.note_speed(header.course_mps);
                seen.push(line.end_s(&header));
            }
            seen
        };
        assert_eq!(end_s(Some(62.0)), [62.0, 62.0, 62.0, 62.125, 62.5, 122.0]);
        assert_eq!(end_s(None), [62.0; 6]);
    }

    #[test]
    fn hundreds_of_near_alerts_make_two_lines() {
        let (mut near, begin) = (NearAlerts::default(), Instant::now());
        let lines: Vec<String> = (0..300)
            .filter_map(|step| {
                let now = begin + Duration::from_millis(10) * step;
                let benches = [step, step + 9];
                let clearance_m = 0.02 - 1e-5 * f64::from(step.min(200));
                near.take(&alert(100.0 + 0.01 * f64::from(step), benches, clearance_m), now).or_else(|| near.due(now))
            })
            .collect();
        assert_eq!(lines, ["100.000000 s: near, benches 0 and 9"]);
        assert_eq!(near.due(begin + PERIOD.saturating_sub(Duration::from_millis(1))), None);
        let line = "100.010000 to 102.990000 s: 299 more near alerts, raised at 18.0 mm or more, the nearest of benches 200 and 209";
        assert_eq!(near.due(begin + PERIOD).as_deref(), Some(line));
        assert_eq!(near.rest(begin + PERIOD), None, "each alert is reported once");
    }

    #[test]
    fn an_alert_after_a_quiet_period_is_reported_at_once() {
        let (mut near, begin) = (NearAlerts::default(), Instant::now());
        for period in [0, 1, 2] {
            let now = begin + PERIOD * period;
            assert_eq!(near.due(now), None, "no alert has been counted");
            let line = near.take(&alert(1.0, [0, 8], 0.01), now);
            assert_eq!(line.as_deref(), Some("1.000000 s: near, benches 0 and 8"));
        }
    }
}

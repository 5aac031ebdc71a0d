//! The clearance and the state of a show over the wall time, in memory that does not grow with the show.

use glam::DVec2;

use crate::output::figure::{StateLook, StateSpan};

/// Most intervals of a timeline. When more are needed, two become one each, of double length.
const MOST_BINS: usize = 2048;
/// First length of an interval, in seconds: longer than the period of the monitor's progress.
const FIRST_BIN_S: f64 = 0.25;
/// A line goes on over a gap of this many seconds. A longer gap is drawn as one.
const LONGEST_GAP_S: f64 = 1.5;

/// Intervals of the wall time since the begin of the show, all of the same length.
#[derive(Clone, Debug)]
pub(super) struct Timeline {
    bins: Vec<Bin>,
    bin_s: f64,
}

/// An interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Bin {
    /// Least clearance in metres.
    least_m: Option<f64>,
    /// The state, of several the one that people look for first.
    look: Option<StateLook>,
}

impl Default for Timeline {
    fn default() -> Self {
        Self { bins: Vec::new(), bin_s: FIRST_BIN_S }
    }
}

impl Timeline {
    /// Notes the least clearance of a moment, in seconds after the begin and in metres.
    pub(super) fn see_clearance(&mut self, seconds: f64, clearance_m: f64) {
        let bin = self.bin(seconds);
        bin.least_m = Some(bin.least_m.map_or(clearance_m, |least_m| least_m.min(clearance_m)));
    }

    /// Notes the state of the show at a moment, in seconds after the begin.
    pub(super) fn see_state(&mut self, seconds: f64, look: StateLook) {
        let bin = self.bin(seconds);
        bin.look = bin.look.max_by_rank(Some(look));
    }

    /// The lines of the least clearance: seconds after the begin, and metres.
    pub(super) fn clearance(&self) -> Vec<Vec<DVec2>> {
        let mut lines: Vec<Vec<DVec2>> = Vec::new();
        for (number, bin) in self.bins.iter().enumerate() {
            let Some(least_m) = bin.least_m else { continue };
            let point = DVec2::new((number as f64 + 0.5) * self.bin_s, least_m);
            match lines.last_mut() {
                Some(line) if line.last().is_some_and(|last| point.x - last.x <= self.longest_step_s()) => {
                    line.push(point);
                }
                _ => lines.push(vec![point]),
            }
        }
        lines
    }

    /// The states, in order.
    pub(super) fn states(&self) -> Vec<StateSpan> {
        let mut spans: Vec<StateSpan> = Vec::new();
        for (number, bin) in self.bins.iter().enumerate() {
            let Some(look) = bin.look else { continue };
            let (from_s, to_s) = (number as f64 * self.bin_s, (number + 1) as f64 * self.bin_s);
            match spans.last_mut() {
                Some(last) if last.look == look && from_s - last.to_s <= LONGEST_GAP_S => last.to_s = to_s,
                _ => spans.push(StateSpan { from_s, to_s, look }),
            }
        }
        spans
    }

    fn longest_step_s(&self) -> f64 {
        1.5 * self.bin_s + LONGEST_GAP_S
    }

    /// The interval of a moment. A moment before the begin, as after a change of the clock, counts as the begin.
    fn bin(&mut self, seconds: f64) -> &mut Bin {
        while seconds / self.bin_s >= MOST_BINS as f64 {
            self.halve();
        }
        // Of NaN and of a negative number, this is 0.
        let number = (seconds / self.bin_s) as usize;
        if number >= self.bins.len() {
            self.bins.resize(number + 1, Bin::default());
        }
        &mut self.bins[number]
    }

    /// Makes one interval of two.
    fn halve(&mut self) {
        let merged = |pair: &[Bin]| pair.iter().copied().reduce(Bin::merge).unwrap_or_default();
        self.bins = self.bins.chunks(2).map(merged).collect();
        self.bin_s *= 2.0;
    }
}

impl Bin {
    fn merge(self, other: Self) -> Self {
        let least_m = match (self.least_m, other.least_m) {
            (Some(one), Some(two)) => Some(one.min(two)),
            (one, two) => one.or(two),
        };
        Self { least_m, look: self.look.max_by_rank(other.look) }
    }
}

/// Chooses the state that people look for first.
trait Ranked {
    fn max_by_rank(self, other: Self) -> Self;
}

impl Ranked for Option<StateLook> {
    fn max_by_rank(self, other: Self) -> Self {
        let rank = |look: &StateLook| match look {
            StateLook::Running => 0,
            StateLook::Finished => 1,
            StateLook::Ready => 2,
            StateLook::Paused => 3,
            StateLook::Held => 4,
        };
        self.into_iter().chain(other).max_by_key(rank)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_timeline_of_days_keeps_its_extremes_in_the_same_memory() {
        let mut timeline = Timeline::default();
        for second in 0..200_000 {
            timeline.see_clearance(f64::from(second), if second == 77_777 { 0.001 } else { 0.3 });
            timeline.see_state(f64::from(second), if second == 99_999 { StateLook::Held } else { StateLook::Running });
        }
        assert!(timeline.bins.len() <= MOST_BINS && timeline.bins.len() > MOST_BINS / 2, "{}", timeline.bins.len());
        let lines = timeline.clearance();
        assert_eq!(lines.len(), 1, "it has no gap");
        let nearest = lines[0].iter().min_by(|a, b| a.y.total_cmp(&b.y)).expect("it has points");
        assert!(nearest.y == 0.001 && (nearest.x - 77_777.0).abs() <= timeline.bin_s, "{nearest}");
        let looks: Vec<StateLook> = timeline.states().iter().map(|span| span.look).collect();
        assert_eq!(looks, [StateLook::Running, StateLook::Held, StateLook::Running]);
    }

    #[test]
    fn a_gap_breaks_the_line_and_a_late_report_does_not() {
        let mut timeline = Timeline::default();
        for seconds in [0.0, 0.2, 0.9, 1.1, 5.0, 5.2] {
            timeline.see_clearance(seconds, 1.0);
        }
        assert_eq!(timeline.clearance().iter().map(Vec::len).collect::<Vec<_>>(), [3, 1]);
    }

    #[test]
    fn a_clock_that_is_set_back_or_far_ahead_is_no_fault() {
        let mut timeline = Timeline::default();
        timeline.see_clearance(-3600.0, 0.5);
        timeline.see_clearance(1.8e9, 0.4);
        assert_eq!(timeline.clearance().iter().map(Vec::len).sum::<usize>(), 2);
        assert!(timeline.bins.len() <= MOST_BINS);
    }
}

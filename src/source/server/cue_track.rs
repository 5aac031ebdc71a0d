//! Which cues the show has reached.

use super::simulation::ReachedCue;
use crate::config::Config;

/// The cues of a show, with those that it has reached at this tick. A tick allocates nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct CueTrack {
    /// Each cue with its place on the course, in their order.
    cues: Vec<(f64, ReachedCue)>,
    /// Numbers of the first cue that is reached, and of the first one after.
    reached: [usize; 2],
    /// Where the show stood at last; `None` before the first tick.
    last_m: Option<f64>,
}

impl CueTrack {
    pub(super) fn of(config: &Config) -> Self {
        let place = |(number, cue): (usize, &crate::config::Cue)| {
            (config.formation().course_m(cue.at_s), ReachedCue { number, at_s: cue.at_s })
        };
        Self { cues: config.cues().iter().enumerate().map(place).collect(), ..Self::default() }
    }

    /// Notes that the show has walked from a place to another one. If it did not stand at the first one before, a seek has put it
    /// there, or it begins there.
    pub(super) fn walk(&mut self, from_m: f64, to_m: f64) {
        let is_put = self.last_m.replace(to_m) != Some(from_m);
        let before = |place_m: f64| self.cues.partition_point(|&(cue_m, _)| cue_m < place_m);
        let up_to = |place_m: f64| self.cues.partition_point(|&(cue_m, _)| cue_m <= place_m);
        let [first, end] = [if is_put { before(from_m) } else { up_to(from_m) }, up_to(to_m)];
        if first < end {
            let is_after = !is_put && self.reached[0] < self.reached[1];
            self.reached = [if is_after { self.reached[0] } else { first }, end];
        }
    }

    /// Passes all reached cues to `note`, and forgets them.
    pub(super) fn take(&mut self, mut note: impl FnMut(ReachedCue)) {
        let [first, end] = std::mem::take(&mut self.reached);
        self.cues[first..end].iter().for_each(|&(_, cue)| note(cue));
    }
}

//! Which frames of a recording make a table of one row a second, or of any other step. Pure.

/// Chooses the first frame of each run, every frame with which show time enters another step (the first one at or behind each
/// whole multiple of it), and the first one wherever show time has gone back.
///
/// So a frame is chosen at 0, 1, 2 s where there is one at just those times, a pause adds none, and a show that is sought
/// back is told again.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    every_ns: i64,
    /// The run and the show time of the frame before.
    last: Option<(u64, i64)>,
}

impl Sampling {
    /// A step in nanoseconds of show time; 0 chooses every frame.
    ///
    /// # Panics
    /// Where it is negative.
    pub fn new(every_ns: i64) -> Self {
        assert!(every_ns >= 0, "the command line allows no negative step");
        Self { every_ns, last: None }
    }

    /// Whether the frame of a run at a show time, recorded behind the one asked for before, is chosen.
    pub fn takes(&mut self, run_id: u64, sim_time_ns: i64) -> bool {
        if self.every_ns == 0 {
            return true;
        }
        let step = |time_ns: i64| time_ns.div_euclid(self.every_ns);
        let last = self.last.replace((run_id, sim_time_ns));
        last.is_none_or(|(last_run_id, last_ns)| {
            last_run_id != run_id || step(last_ns) != step(sim_time_ns) || sim_time_ns < last_ns
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(every_ns: i64, times_ns: &[i64]) -> Vec<i64> {
        let mut sampling = Sampling::new(every_ns);
        times_ns.iter().copied().filter(|&time_ns| sampling.takes(7, time_ns)).collect()
    }

    #[test]
    fn a_frame_is_taken_at_each_whole_step_and_at_the_first_behind_it() {
        assert_eq!(taken(10, &(0..=30).collect::<Vec<_>>()), [0, 10, 20, 30]);
        assert_eq!(taken(10, &[3, 6, 9, 12, 15, 18, 21, 24]), [3, 12, 21]);
        assert_eq!(taken(10, &[-11, -10, -5, -1, 0, 5]), [-11, -10, 0], "show times may be negative");
    }

    #[test]
    fn a_pause_adds_none_and_a_show_that_is_sought_back_is_told_again() {
        assert_eq!(taken(10, &[8, 9, 10, 10, 10, 11]), [8, 10]);
        assert_eq!(taken(10, &[30, 31, 12, 13, 20]), [30, 12, 20]);
        assert_eq!(taken(10, &[30, 38, 34, 35, 40]), [30, 34, 40], "within a step");
    }

    #[test]
    fn each_run_begins_with_a_frame() {
        let mut sampling = Sampling::new(10);
        assert!(sampling.takes(7, 1) && !sampling.takes(7, 2) && sampling.takes(8, 2));
    }

    #[test]
    fn a_step_of_nothing_takes_every_frame() {
        assert_eq!(taken(0, &[5, 5, 6]), [5, 5, 6]);
    }
}

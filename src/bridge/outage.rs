//! When a receiver's trouble is worth a line: when it begins and when it is over.

/// How long nothing may fail before the trouble counts as over. A host that refuses packets says so about once a second.
const CALM_NS: u64 = 3_000_000_000;

/// Follows whether sending works.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outage {
    ongoing: Option<Ongoing>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Ongoing {
    last_failure_ns: u64,
    failed_frames: u64,
}

/// What is to be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// Sending has begun to fail.
    Began,
    /// Sending has worked for a while again.
    Ended {
        /// Frames that were not sent, or not all of them.
        failed_frames: u64,
    },
}

impl Outage {
    /// Takes note of one frame at `now_ns`. Returns what is to be told.
    pub fn note(&mut self, failed: bool, now_ns: u64) -> Option<Turn> {
        match (&mut self.ongoing, failed) {
            (None, false) => None,
            (None, true) => {
                self.ongoing = Some(Ongoing { last_failure_ns: now_ns, failed_frames: 1 });
                Some(Turn::Began)
            }
            (Some(ongoing), true) => {
                ongoing.last_failure_ns = now_ns;
                ongoing.failed_frames += 1;
                None
            }
            (Some(Ongoing { last_failure_ns, failed_frames }), false) => {
                let turn = Turn::Ended { failed_frames: *failed_frames };
                let is_over = now_ns.saturating_sub(*last_failure_ns) >= CALM_NS;
                is_over.then(|| {
                    self.ongoing = None;
                    turn
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trouble_is_told_once_and_its_end_after_a_calm() {
        let mut outage = Outage::default();
        assert_eq!(outage.note(false, 0), None);
        assert_eq!(outage.note(true, 1), Some(Turn::Began));
        assert_eq!(outage.note(true, 2), None);
        assert_eq!(outage.note(false, 3), None);
        assert_eq!(outage.note(true, 4), None, "a calm that is too short is none");
        assert_eq!(outage.note(false, 3 + CALM_NS), None);
        assert_eq!(outage.note(false, 4 + CALM_NS), Some(Turn::Ended { failed_frames: 3 }));
        assert_eq!(outage.note(false, 5 + CALM_NS), None);
        assert_eq!(outage.note(true, 6 + CALM_NS), Some(Turn::Began));
    }
}

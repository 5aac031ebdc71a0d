//! Whether anybody is connected to a sending bridge: to whom nobody listens, that is worth a line.
//!
//! Pure: the time and what has been seen are handed to it.

/// How often it is looked for where somebody was there.
const LOOK_PERIOD_NS: u64 = 1_000_000_000;
/// How often where nobody was, so that hardly a frame is counted wrongly when somebody comes.
const ALONE_LOOK_PERIOD_NS: u64 = 1_000_000;
/// How long nobody may be there before it is said: connecting takes a moment.
const SILENT_NS: u64 = 1_000_000_000;

/// Who was there, and since when nobody is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Company {
    looked_ns: Option<u64>,
    alone_since_ns: Option<u64>,
    is_told: bool,
}

/// What is to be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// Nobody is there, and has not been for a while.
    Alone,
    /// Somebody is there again.
    Connected,
}

impl Company {
    /// Nobody, from this instant on.
    pub(super) fn none(now_ns: u64) -> Self {
        Self { looked_ns: None, alone_since_ns: Some(now_ns), is_told: false }
    }

    /// Whether somebody was there when it was last looked.
    pub(super) fn is_there(&self) -> bool {
        self.alone_since_ns.is_none()
    }

    /// Takes note of the present, having `look` find out whether anybody is there, if it is time for that.
    pub(super) fn note(&mut self, now_ns: u64, look: impl FnOnce() -> bool) -> Option<Change> {
        let period_ns = if self.is_there() { LOOK_PERIOD_NS } else { ALONE_LOOK_PERIOD_NS };
        if self.looked_ns.is_none_or(|looked_ns| now_ns.saturating_sub(looked_ns) >= period_ns) {
            self.looked_ns = Some(now_ns);
            self.alone_since_ns = if look() { None } else { self.alone_since_ns.or(Some(now_ns)) };
        }
        match self.alone_since_ns {
            None if self.is_told => {
                self.is_told = false;
                Some(Change::Connected)
            }
            Some(since_ns) if !self.is_told && now_ns.saturating_sub(since_ns) >= SILENT_NS => {
                self.is_told = true;
                Some(Change::Alone)
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;

    #[test]
    fn nobody_is_told_of_after_a_second_and_once_and_so_is_whoever_comes() {
        let mut company = Company::none(SECOND_NS);
        assert_eq!(company.note(SECOND_NS, || false), None);
        assert_eq!(company.note(2 * SECOND_NS, || false), Some(Change::Alone));
        assert_eq!(company.note(9 * SECOND_NS, || false), None);
        assert_eq!(company.note(9 * SECOND_NS + ALONE_LOOK_PERIOD_NS, || true), Some(Change::Connected));
        assert!(company.is_there());
        assert_eq!(company.note(20 * SECOND_NS, || false), None, "it may be back in a moment");
        assert!(!company.is_there());
        assert_eq!(company.note(21 * SECOND_NS, || false), Some(Change::Alone));
    }

    #[test]
    fn whoever_is_there_at_once_is_not_told_of() {
        let mut company = Company::none(SECOND_NS);
        assert_eq!(company.note(SECOND_NS, || true), None);
        assert_eq!(company.note(9 * SECOND_NS, || true), None);
    }

    #[test]
    fn it_is_looked_no_more_often_than_once_a_second_where_somebody_is() {
        let mut company = Company::none(0);
        let mut looks = 0;
        for now_ms in 0..10_000 {
            company.note(now_ms * 1_000_000, || {
                looks += 1;
                true
            });
        }
        assert_eq!(looks, 10);
    }
}

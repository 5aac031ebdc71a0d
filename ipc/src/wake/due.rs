//! Waiting for a frame by the clock: a reader that knows when the next frame is due sleeps until shortly before, then looks at the
//! wake word in a busy loop.
//!
//! Such a reader does not set [`WAITING`], so the source makes no system call for it. If another reader sets the bit, the source's
//! call wakes both; that is harmless.

use core::hint;
use core::time::Duration;

use super::word::{Slept, WAITING, Word};

/// When the next frame is due, and how long a reader looks for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DueWindow {
    /// `CLOCK_MONOTONIC` instant at which the frame is due, in nanoseconds.
    pub(crate) due_ns: u64,
    /// The busy loop begins this long before that instant, and ends this long after it.
    pub(crate) spin: Duration,
    /// Longest time of all.
    pub(crate) timeout: Duration,
}

/// What a wait by the clock has found.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Polled<Found> {
    pub(crate) found: Option<Found>,
    /// Whether the frame arrived in the busy loop: neither before, while the reader slept too long, nor after.
    pub(crate) is_punctual: bool,
    /// Whether a signal ended the wait.
    pub(crate) is_interrupted: bool,
}

/// Waits for a frame by the clock, and calls `look` before and after it.
pub(crate) fn poll_when_due<Found, Failure>(
    word: &impl Word,
    now_ns: impl Fn() -> u64,
    window: DueWindow,
    mut look: impl FnMut() -> Result<Option<Found>, Failure>,
) -> Result<Polled<Found>, Failure> {
    let seen = word.load();
    let is_raised = || (word.load() ^ seen) & !WAITING != 0;
    if let found @ Some(_) = look()? {
        return Ok(Polled { found, is_punctual: true, is_interrupted: false });
    }
    let [spin_ns, timeout_ns] = [window.spin, window.timeout].map(nanoseconds);
    let begun_ns = now_ns();
    if begun_ns > window.due_ns.saturating_add(spin_ns) {
        // The source is late: that says nothing of this reader.
        return Ok(Polled { found: None, is_punctual: true, is_interrupted: false });
    }
    let end_ns = begun_ns.saturating_add(timeout_ns);
    let spin_from_ns = window.due_ns.saturating_sub(spin_ns).min(end_ns);
    loop {
        let left_ns = spin_from_ns.saturating_sub(now_ns());
        if left_ns == 0 || is_raised() {
            break;
        }
        // The word itself may have got the bit of another reader meanwhile.
        if word.sleep(seen | word.load() & WAITING, Duration::from_nanos(left_ns)) == Slept::Interrupted {
            return Ok(Polled { found: look()?, is_punctual: true, is_interrupted: true });
        }
    }
    let has_overslept = is_raised();
    let spin_to_ns = window.due_ns.saturating_add(spin_ns).min(end_ns);
    while !is_raised() && now_ns() < spin_to_ns {
        hint::spin_loop();
    }
    let found = look()?;
    Ok(Polled { is_punctual: found.is_some() && !has_overslept, found, is_interrupted: false })
}

fn nanoseconds(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use core::cell::{Cell, RefCell};
    use core::convert::Infallible;

    use super::*;

    /// A word and a clock: each reading of the clock takes 10 ns, a sleep takes its time and `late_ns`.
    #[derive(Default)]
    struct Model {
        word: Cell<u32>,
        now_ns: Cell<u64>,
        raised_at_ns: u64,
        late_ns: u64,
        is_interrupted: bool,
        slept_ns: RefCell<Vec<u64>>,
    }

    impl Model {
        fn tick(&self, ns: u64) -> u64 {
            self.now_ns.set(self.now_ns.get() + ns);
            if self.now_ns.get() >= self.raised_at_ns && self.word.get() & !WAITING == 0 {
                self.word.set(2);
            }
            self.now_ns.get()
        }
    }

    impl Word for Model {
        fn load(&self) -> u32 {
            self.word.get()
        }

        fn exchange(&self, _current: u32, _new: u32) -> Result<(), u32> {
            panic!("a reader that waits by the clock never changes the word");
        }

        fn sleep(&self, expected: u32, timeout: Duration) -> Slept {
            assert_eq!(self.word.get(), expected, "the word at the sleep");
            let ns = nanoseconds(timeout);
            self.slept_ns.borrow_mut().push(ns);
            self.tick(ns + self.late_ns);
            if self.is_interrupted { Slept::Interrupted } else { Slept::TimedOut }
        }

        fn wake_all(&self) {
            panic!("a reader wakes nobody");
        }
    }

    /// The frame that is there once the word was raised.
    fn wait(model: &Model, due_ns: u64, timeout: Duration) -> Polled<&'static str> {
        let window = DueWindow { due_ns, spin: Duration::from_micros(1), timeout };
        let look = || Ok::<_, Infallible>((model.word.get() & !WAITING != 0).then_some("frame"));
        let Ok(polled) = poll_when_due(model, || model.tick(10), window, look);
        polled
    }

    #[test]
    fn the_reader_sleeps_until_the_busy_loop_and_meets_the_frame_in_it() {
        let model = Model { raised_at_ns: 50_200, ..Model::default() };
        let polled = wait(&model, 50_000, Duration::MAX);
        assert_eq!(polled, Polled { found: Some("frame"), is_punctual: true, is_interrupted: false });
        assert_eq!(model.slept_ns.borrow()[..], [48_980]);
        assert!((50_200..50_220).contains(&model.now_ns.get()), "{}", model.now_ns.get());
    }

    #[test]
    fn a_frame_that_came_while_the_reader_slept_too_long_is_not_punctual() {
        let model = Model { raised_at_ns: 50_200, late_ns: 5_000, ..Model::default() };
        let polled = wait(&model, 50_000, Duration::MAX);
        assert_eq!(polled, Polled { found: Some("frame"), is_punctual: false, is_interrupted: false });
    }

    #[test]
    fn a_frame_that_is_long_overdue_is_not_looked_for_in_a_busy_loop() {
        let model = Model { raised_at_ns: u64::MAX, now_ns: Cell::new(60_000), ..Model::default() };
        assert_eq!(
            wait(&model, 50_000, Duration::MAX),
            Polled { found: None, is_punctual: true, is_interrupted: false }
        );
        assert_eq!(model.now_ns.get(), 60_010);
    }

    #[test]
    fn the_busy_loop_ends_after_its_time() {
        let model = Model { raised_at_ns: u64::MAX, ..Model::default() };
        let polled = wait(&model, 50_000, Duration::MAX);
        assert_eq!(polled, Polled { found: None, is_punctual: false, is_interrupted: false });
        assert!((51_000..51_020).contains(&model.now_ns.get()), "{}", model.now_ns.get());
    }

    #[test]
    fn the_timeout_ends_the_sleep_and_the_busy_loop() {
        let sleeps = Model { raised_at_ns: u64::MAX, ..Model::default() };
        assert_eq!(wait(&sleeps, 50_000, Duration::from_micros(20)).found, None);
        assert!((20_000..20_060).contains(&sleeps.now_ns.get()), "{}", sleeps.now_ns.get());
        let spins = Model { raised_at_ns: u64::MAX, ..Model::default() };
        assert_eq!(wait(&spins, 50_000, Duration::from_nanos(50_100)).found, None);
        assert!((50_100..50_140).contains(&spins.now_ns.get()), "{}", spins.now_ns.get());
    }

    #[test]
    fn the_bit_of_another_reader_does_not_begin_the_busy_loop_early() {
        let model = Model { raised_at_ns: 50_200, word: Cell::new(WAITING), ..Model::default() };
        assert!(wait(&model, 50_000, Duration::MAX).is_punctual);
        assert_eq!(model.slept_ns.borrow().len(), 1);
    }

    #[test]
    fn a_signal_ends_the_wait() {
        let model = Model { raised_at_ns: u64::MAX, is_interrupted: true, ..Model::default() };
        let polled = wait(&model, 50_000, Duration::MAX);
        assert_eq!(polled, Polled { found: None, is_punctual: true, is_interrupted: true });
    }

    #[test]
    fn an_unread_frame_is_returned_at_once() {
        let model = Model { word: Cell::new(4), ..Model::default() };
        assert_eq!(wait(&model, 50_000, Duration::MAX).found, Some("frame"));
        assert_eq!(model.now_ns.get(), 0);
    }
}

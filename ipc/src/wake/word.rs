//! Wake word of the frames: one 32-bit word by which a source wakes all waiting readers in one system call.
//!
//! Bits 31 to 1 count: every frame raises the count by 1. Bit 0, [`WAITING`], says that a reader may be asleep. A reader
//! sets it before it sleeps, and each raise clears it. So a source whose readers are awake makes no system call, and a
//! killed reader costs one superfluous call at most.
//!
//! - *Raise*, after a frame was sent: replace the word by the next count without the bit, in one atomic step
//!   (compare-exchange, release). If the replaced word had the bit, wake all sleepers (`FUTEX_WAKE`).
//! - *Wait:* (1) load the word (acquire). (2) Look for a frame; if there is one, do not sleep. (3) Set the bit by
//!   compare-exchange from the word of step 1; if the word has another count by now, go to 1. (4) Sleep while the word is
//!   that of step 3 (`FUTEX_WAIT`, which compares and falls asleep in one step). (5) Go to 1.
//!
//! *No wake-up is lost.* Take a frame that is sent after the look of step 2, and its raise.
//! 1. A raise before step 1 happens after the frame was sent, so step 1 makes the frame visible to step 2. Then the frame
//!    is not sent after the look.
//! 2. A raise between steps 1 and 3 changes the count, and step 3 fails.
//! 3. A raise between steps 3 and 4 changes the count, and step 4 does not sleep.
//! 4. A raise after step 4 began replaces the word on which the reader sleeps. That word has the bit, and only a raise
//!    changes it: setting the bit again leaves it as it is. So this raise finds the bit and wakes the reader.
//!
//! The count returns to the same value after 2³¹ raises: at 1 kHz after 24 days. A reader would have to be suspended for
//! exactly that time between steps 1 and 4.

use std::time::{Duration, Instant};

/// Bit 0 of the word: a reader may be asleep.
pub(crate) const WAITING: u32 = 1;
const COUNT_STEP: u32 = 2;

/// A word on which processes sleep.
pub(crate) trait Word {
    /// Returns the value (acquire).
    fn load(&self) -> u32;

    /// Replaces `current` by `new` (acquire and release). Returns the value found where it is not `current`.
    fn exchange(&self, current: u32, new: u32) -> Result<(), u32>;

    /// Sleeps at most `timeout`, and only while the value is `expected`.
    fn sleep(&self, expected: u32, timeout: Duration) -> Slept;

    /// Wakes all sleepers.
    fn wake_all(&self);
}

/// End of a sleep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Slept {
    /// The word changed, or the sleep ended without a reason.
    Woken,
    /// The timeout has passed.
    TimedOut,
    /// A signal arrived.
    Interrupted,
}

/// Announces a frame that has been sent. Never waits.
pub(crate) fn raise(word: &impl Word) {
    let mut found = word.load();
    while let Err(changed) = word.exchange(found, (found & !WAITING).wrapping_add(COUNT_STEP)) {
        found = changed;
    }
    if found & WAITING != 0 {
        word.wake_all();
    }
}

/// Calls `look` until it returns a value or an error. Sleeps between two calls until the next raise. Returns `None` after
/// `timeout`, or as soon as a signal arrives; a timeout of 0 does not sleep.
pub(crate) fn wait<Found, Failure>(
    word: &impl Word,
    timeout: Duration,
    mut look: impl FnMut() -> Result<Option<Found>, Failure>,
) -> Result<Option<Found>, Failure> {
    let mut begun = None;
    loop {
        let seen = word.load();
        if let Some(found) = look()? {
            return Ok(Some(found));
        }
        let left = timeout.saturating_sub(begun.get_or_insert_with(Instant::now).elapsed());
        if left.is_zero() {
            return Ok(None);
        }
        match sleep_from(word, seen, left) {
            Slept::Woken | Slept::TimedOut => {}
            // A frame may have arrived at the same moment.
            Slept::Interrupted => return look(),
        }
    }
}

/// Does steps 3 and 4 of a wait, from the word of step 1.
pub(crate) fn sleep_from(word: &impl Word, seen: u32, timeout: Duration) -> Slept {
    let expected = seen | WAITING;
    match word.exchange(seen, expected) {
        Err(found) if found != expected => Slept::Woken,
        _ => word.sleep(expected, timeout),
    }
}

#[cfg(test)]
mod tests {
    //! loom runs the two sides in every order that the memory model allows, with at most [`PREEMPTIONS`] forced changes of
    //! thread. A lost wake-up is a deadlock, which loom reports: its sleeps have no timeout.

    use core::convert::Infallible;

    use loom::sync::atomic::AtomicU32;
    use loom::sync::atomic::Ordering::{AcqRel, Acquire, Relaxed, Release};
    use loom::sync::{Arc, Condvar, Mutex};
    use loom::thread;

    use super::*;

    /// Without a bound the orders take hours.
    const PREEMPTIONS: usize = 3;
    const FOREVER: Duration = Duration::from_secs(1 << 30);

    /// A word with a futex: comparing and falling asleep is one step, and nothing wakes a sleeper but `wake_all`.
    struct Model {
        word: AtomicU32,
        queue: Mutex<u64>,
        woken: Condvar,
    }

    impl Model {
        fn new() -> Arc<Self> {
            Arc::new(Self { word: AtomicU32::new(0), queue: Mutex::new(0), woken: Condvar::new() })
        }
    }

    impl Word for Arc<Model> {
        fn load(&self) -> u32 {
            self.word.load(Acquire)
        }

        fn exchange(&self, current: u32, new: u32) -> Result<(), u32> {
            self.word.compare_exchange(current, new, AcqRel, Acquire).map(drop)
        }

        fn sleep(&self, expected: u32, _timeout: Duration) -> Slept {
            let mut wakes = self.queue.lock().expect("no thread panics");
            // The kernel's comparison is atomic with the queue, and sees the newest value.
            if self.word.compare_exchange(expected, expected, AcqRel, Acquire).is_err() {
                return Slept::Woken;
            }
            let before = *wakes;
            while *wakes == before {
                wakes = self.woken.wait(wakes).expect("no thread panics");
            }
            Slept::Woken
        }

        fn wake_all(&self) {
            *self.queue.lock().expect("no thread panics") += 1;
            self.woken.notify_all();
        }
    }

    fn in_every_order(events: impl Fn() + Send + Sync + 'static) {
        let mut model = loom::model::Builder::new();
        model.preemption_bound = Some(PREEMPTIONS);
        model.check(events);
    }

    /// Number of frames sent, in place of a queue in shared memory.
    fn sent() -> Arc<AtomicU32> {
        Arc::new(AtomicU32::new(0))
    }

    fn send(sent: &AtomicU32, word: &Arc<Model>) {
        sent.fetch_add(1, Relaxed);
        raise(word);
    }

    /// Waits until this many frames have been sent, one after the other.
    fn read(frames: u32, sent: &AtomicU32, word: &Arc<Model>) {
        for frame in 0..frames {
            let look = || Ok::<_, Infallible>((sent.load(Relaxed) > frame).then_some(()));
            let Ok(found) = wait(word, FOREVER, look);
            assert_eq!(found, Some(()));
        }
    }

    #[test]
    fn a_reader_is_woken_by_every_frame_in_any_order_of_events() {
        in_every_order(|| {
            let (word, sent) = (Model::new(), sent());
            let reader = thread::spawn({
                let (word, sent) = (word.clone(), sent.clone());
                move || read(2, &sent, &word)
            });
            send(&sent, &word);
            send(&sent, &word);
            reader.join().expect("the reader ends");
        });
    }

    #[test]
    fn two_readers_are_woken_by_one_frame_in_any_order_of_events() {
        in_every_order(|| {
            let (word, sent) = (Model::new(), sent());
            let reader = || {
                let (word, sent) = (word.clone(), sent.clone());
                thread::spawn(move || read(1, &sent, &word))
            };
            let readers = [reader(), reader()];
            send(&sent, &word);
            for reader in readers {
                reader.join().expect("the reader ends");
            }
        });
    }

    #[test]
    fn a_reader_is_woken_although_a_closing_client_raises_the_word_too() {
        in_every_order(|| {
            let (word, sent) = (Model::new(), sent());
            let reader = thread::spawn({
                let (word, sent) = (word.clone(), sent.clone());
                move || read(1, &sent, &word)
            });
            let closing = thread::spawn({
                let word = word.clone();
                move || raise(&word)
            });
            send(&sent, &word);
            reader.join().expect("the reader ends");
            closing.join().expect("it does not wait");
        });
    }

    #[test]
    fn the_bit_of_a_killed_reader_costs_one_call_and_wakes_nobody_by_mistake() {
        in_every_order(|| {
            let (word, sent) = (Model::new(), sent());
            word.word.store(WAITING, Release);
            let reader = thread::spawn({
                let (word, sent) = (word.clone(), sent.clone());
                move || read(1, &sent, &word)
            });
            send(&sent, &word);
            reader.join().expect("the reader ends");
            send(&sent, &word);
            assert_eq!(word.load(), 2 * COUNT_STEP, "two raises, and nobody waits");
            assert!(*word.queue.lock().expect("no thread panics") <= 1, "the second raise makes no call");
        });
    }
}

//! Runs work on all cores.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::thread::available_parallelism;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::dragon::Meter;

/// A thread for each core but that of the caller, started at the first use. They end with the process. `None` on one core, and if the
/// system cannot start them.
static POOL: LazyLock<Option<ThreadPool>> = LazyLock::new(|| {
    let others = available_parallelism().ok()?.get().checked_sub(1).filter(|others| *others > 0)?;
    ThreadPoolBuilder::new().num_threads(others).thread_name(|_| "planner".to_owned()).build().ok()
});

thread_local! {
    /// Whether this thread runs work already.
    static WORKS: Cell<bool> = const { Cell::new(false) };
}

/// Returns the results of `work` on each of `count` items, in order. It runs on all cores. Each core takes the next item after
/// it has finished one. Nested work stays on its core, so there are never more threads than cores. If the system cannot start
/// more threads, the existing ones do the work.
///
/// Each item has its own meter. Its limit is the work that the finished items before it have left of `meter`. The results end
/// before the first item that exceeds the limit; then `meter` is spent. So the results are the same on any number of cores. If the
/// question is cancelled, they end before the first unfinished item.
pub(super) fn on_all_cores<Answer: Send>(
    meter: &Meter,
    count: usize,
    work: impl Fn(usize, &Meter) -> Answer + Sync,
) -> Vec<Answer> {
    let share = Share { meter, left: meter.is_limited().then(|| meter.left()), progress: Mutex::default() };
    let next = AtomicUsize::new(0);
    let take = || {
        let mut done = Vec::new();
        loop {
            let item = next.fetch_add(1, Ordering::Relaxed);
            let Some(own) = (item < count).then(|| share.meter()).flatten() else { return done };
            let answer = work(item, &own);
            share.note(item, own.done());
            // A cancelled item may have only a part of its answer.
            done.push((item, own.done(), (!own.is_cancelled()).then_some(answer)));
        }
    };
    let mut done = if WORKS.get() { take() } else { on_threads(&take) };
    done.sort_unstable_by_key(|&(item, ..)| item);
    let mut answers = Vec::with_capacity(done.len());
    for (_, steps, answer) in done {
        meter.add(steps);
        let Some(answer) = answer.filter(|_| !meter.is_over()) else { break };
        answers.push(answer);
    }
    if answers.len() < count {
        meter.exhaust();
    }
    answers
}

/// Runs `work` on the calling thread only, including its nested work, so that it does not load other cores.
pub fn on_one_core<Answer>(work: impl FnOnce() -> Answer) -> Answer {
    let worked = WORKS.replace(true);
    let answer = work();
    WORKS.set(worked);
    answer
}

/// Runs `take` on the calling thread and on those of the pool, and joins the results.
fn on_threads<Done: Send>(take: &(impl Fn() -> Vec<Done> + Sync)) -> Vec<Done> {
    let Some(pool) = &*POOL else { return on_one_core(take) };
    let all_done = Mutex::new(Vec::new());
    let work = || {
        let done = on_one_core(take);
        all_done.lock().unwrap_or_else(PoisonError::into_inner).extend(done);
    };
    pool.in_place_scope(|scope| {
        // The calling thread begins at once: the others may have to wake.
        for _ in 0..pool.current_num_threads() {
            scope.spawn(|_| work());
        }
        work();
    });
    all_done.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// The work left for the items.
struct Share<'a> {
    meter: &'a Meter,
    /// Steps left for all items; `None` without a limit.
    left: Option<u64>,
    progress: Mutex<Progress>,
}

/// The finished items.
#[derive(Default)]
struct Progress {
    /// All items before this index are finished.
    first: usize,
    /// Work of those items, in steps.
    steps: u64,
    /// Work of finished items at or after `first`, in steps.
    later: BTreeMap<usize, u64>,
}

impl Share<'_> {
    /// A meter for the next item; `None` if no work is left.
    fn meter(&self) -> Option<Meter> {
        let Some(left) = self.left else { return Some(Meter::unlimited()) };
        if self.meter.is_cancelled() {
            return None;
        }
        let left = left.saturating_sub(self.progress().steps);
        (left > 0).then(|| self.meter.part(left))
    }

    fn note(&self, item: usize, steps: u64) {
        let mut progress = self.progress();
        progress.later.insert(item, steps);
        while let Some(steps) = {
            let first = progress.first;
            progress.later.remove(&first)
        } {
            progress.first += 1;
            progress.steps = progress.steps.saturating_add(steps);
        }
    }

    /// Locks the progress. If a thread panicked while it held the lock, the panic ends the work anyway.
    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;
    use crate::dragon::Question;

    #[test]
    fn a_cancelled_question_keeps_the_answers_before_it() {
        let question = Question::default();
        let answers = on_one_core(|| {
            on_all_cores(&question.meter(1_000), 10, |item, meter| {
                meter.add(1);
                if item == 3 {
                    question.cancel();
                }
                item
            })
        });
        assert_eq!(answers, [0, 1, 2]);
    }

    #[test]
    fn nested_work_stays_on_its_core() {
        let unlimited = Meter::unlimited();
        let inner = |outer| on_all_cores(&unlimited, 10, |inner, _| (outer * inner, thread::current().id()));
        for answers in on_all_cores(&unlimited, 10, |item, _| (thread::current().id(), inner(item))) {
            assert!(answers.1.iter().all(|(_, thread)| *thread == answers.0));
        }
    }

    #[test]
    fn answers_come_in_order() {
        let squares = |count| on_all_cores(&Meter::unlimited(), count, |item, _| item * item);
        assert_eq!(squares(100), (0..100).map(|item| item * item).collect::<Vec<_>>());
        assert!(squares(0).is_empty());
    }

    #[test]
    fn the_answers_end_at_the_limit_of_work_on_any_number_of_cores() {
        // Item k takes k + 1 steps: the first 13 items take 91 steps.
        let within = |most| {
            let meter = Meter::of(most);
            let answers = on_all_cores(&meter, 1000, |item, own| {
                own.add(item as u64 + 1);
                item
            });
            (answers.len(), meter.is_spent())
        };
        assert_eq!((within(92), within(91)), ((13, true), (12, true)));
        assert_eq!(within(1_000_000), (1000, false));
    }
}

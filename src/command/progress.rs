//! The bar that shows how far a long answer has come.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::output::{bar, set_live_line};

/// An answer that is there sooner shows no bar.
const PATIENCE: Duration = Duration::from_millis(500);
/// The bar is drawn anew this often at most.
const DRAW_PERIOD: Duration = Duration::from_millis(50);

/// The bar, taken away when it is dropped. Where stderr is no terminal it is not drawn.
#[derive(Debug)]
pub(crate) struct Progress {
    what: &'static str,
    total: f64,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    done: f64,
    due: Instant,
}

impl Progress {
    /// A bar for this much work.
    pub(crate) fn new(what: &'static str, total: f64) -> Self {
        Self { what, total, state: Mutex::new(State { done: 0.0, due: Instant::now() + PATIENCE }) }
    }

    /// So much more is done.
    pub(crate) fn add(&self, work: f64) {
        self.change(|done| done + work);
    }

    /// So much is done.
    pub(crate) fn set(&self, work: f64) {
        self.change(|_| work);
    }

    fn change(&self, change: impl FnOnce(f64) -> f64) {
        let mut state = self.state.lock().expect("nothing panics under the lock");
        state.done = change(state.done);
        let now = Instant::now();
        if now >= state.due {
            state.due = now + DRAW_PERIOD;
            let fraction = state.done / self.total;
            set_live_line(Some(format!("{} {:>3.0} %  {}", bar(fraction), fraction * 100.0, self.what)));
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        set_live_line(None);
    }
}

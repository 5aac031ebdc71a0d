//! The bar that shows how far a long answer has come.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// An answer that is there sooner shows no bar.
const PATIENCE: Duration = Duration::from_millis(500);

/// The bar is this many steps long.
const STEPS: u64 = 1000;

/// The bar, taken away when it is dropped. Where stderr is no terminal it is not drawn.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
    began: Instant,
    total: f64,
    done: Mutex<f64>,
}

impl Progress {
    /// A bar for this much work.
    pub(crate) fn new(what: &'static str, total: f64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::hidden());
        let style = ProgressStyle::with_template("{bar:24} {percent:>3} %  {msg}").expect("the template is valid");
        bar.set_style(style);
        bar.set_message(what);
        Self { bar, began: Instant::now(), total, done: Mutex::new(0.0) }
    }

    /// So much more is done.
    pub(crate) fn add(&self, work: f64) {
        self.change(|done| done + work);
    }

    /// So much is done.
    pub(crate) fn set(&self, work: f64) {
        self.change(|_| work);
    }

    fn change(&self, now: impl FnOnce(f64) -> f64) {
        let mut done = self.done.lock().expect("nothing panics under the lock");
        *done = now(*done);
        if self.bar.is_hidden() && self.began.elapsed() > PATIENCE {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_position((*done / self.total * STEPS as f64) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

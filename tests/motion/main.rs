//! The motion of the head, tick by tick.

mod ends;
mod grants;
mod missed_periods;
mod requests;
mod walk;

use bench_dragon::source::server::motion::{Motion, MotionPlan, MotionSettings};
use bench_dragon_ipc::{Refusal, Request};

fn plan() -> MotionSettings {
    MotionSettings::plain(0.001, 0.0, 400.0)
}

fn guarded() -> MotionSettings {
    MotionSettings { guarded_run: Some(7), ..plan() }
}

/// Returns the motion before tick 0.
fn planned(settings: MotionSettings) -> Motion {
    Motion::new(MotionPlan::new(settings).expect("the settings are sound"))
}

/// Returns the motion at tick 0.
fn start(plan: MotionSettings) -> Motion {
    after(planned(plan), 1)
}

fn after(mut motion: Motion, ticks: u64) -> Motion {
    for _ in 0..ticks {
        motion.advance();
    }
    motion
}

fn grant(motion: &mut Motion, from_m: f64, to_m: f64) -> Result<(), Refusal> {
    motion.request(Request::Grant { run_id: 7, from_m, to_m, is_final: false })
}

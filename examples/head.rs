//! Prints the head's front hinge and the centre of its board, frame by frame, until the run has ended: `head [INSTANCE]`.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "it is what the program is for")]
use bench_dragon_ipc::{Domain, Instance, Show, SourceState};
use std::{env, error::Error, time::Duration};

fn main() -> Result<(), Box<dyn Error>> {
    let (instance, second) = (env::args().nth(1).unwrap_or("dragon".to_owned()), Duration::from_secs(1));
    let domain = Domain::new(Instance::new(&instance)?)?;
    eprintln!("reads instance {instance} as soon as `bench-dragon serve` runs");
    let show = Show::open(&domain, "head-printer", Duration::MAX)?;
    loop {
        if let Some(frame) = show.wait(second)? {
            let ([x, y, _], head) =
                (frame.handles()[0].position_m, frame.benches().next().expect("a dragon has a head"));
            let (show_time_s, [cx, cy, _]) = (frame.header().show_time_s(), head.centre_m);
            println!("{show_time_s:.3} s: front hinge {x:.3}, {y:.3} m, centre of the board {cx:.3}, {cy:.3} m");
        } else if matches!(show.source_state(second)?, SourceState::Ended | SourceState::Lost) {
            return Ok(());
        }
    }
}

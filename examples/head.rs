//! Prints the centre and heading of the head's board, frame by frame: `head [INSTANCE]`.
#![allow(clippy::print_stdout, reason = "it is what the program is for")]
use bench_dragon_ipc::{Domain, FrameSubscriber, Instance};
use std::{env, error::Error, time::Duration};

fn main() -> Result<(), Box<dyn Error>> {
    let instance = env::args().nth(1).map_or_else(|| Ok(Instance::default()), |name| name.parse())?;
    let mut frames = FrameSubscriber::open(&Domain::new(instance)?, "head-printer")?;
    loop {
        if let Some(frame) = frames.wait(Duration::from_secs(1))? {
            let head = frame.benches().next().expect("a dragon has a head");
            let ([x, y, _], heading_deg) = (head.centre_m, head.heading_rad.to_degrees());
            println!("{:.3} s: head at {x:.3}, {y:.3} m, {heading_deg:.1}°", frame.header().sim_time_s());
        }
    }
}

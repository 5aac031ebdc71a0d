//! The load: this program again, once a processor, as any other program of the machine: it moves memory and calls the
//! kernel, as fast as it can.

use std::fs::File;
use std::io::Write as _;
use std::process::{Child, Command, Stdio};
use std::{env, thread};

use rustix::process::{Signal, set_parent_process_death_signal};

/// The argument that makes this program a part of the load.
pub(crate) const ROLE: &str = "load";
/// More than a core's caches hold.
const BYTES: usize = 16 << 20;
/// System calls between two moves of the memory.
const CALLS: usize = 2000;

/// The running load. It ends with this.
#[derive(Debug)]
pub(crate) struct Load(Vec<Child>);

impl Load {
    /// One process a processor.
    pub(crate) fn start() -> Self {
        let program = env::current_exe().expect("this program has a path");
        let start = |_| {
            let mut command = Command::new(&program);
            command.arg(ROLE).stdin(Stdio::null()).spawn().expect("this program starts")
        };
        Self((0..thread::available_parallelism().map_or(1, usize::from)).map(start).collect())
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        for process in &mut self.0 {
            // One that has ended would be a fault of the bench, and is seen by the figures.
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

/// Plays the role, until the bench ends.
pub(crate) fn play() -> ! {
    set_parent_process_death_signal(Some(Signal::KILL)).expect("the kernel knows it");
    let mut sink = File::options().write(true).open("/dev/null").expect("it is on every machine");
    let (mut from, mut to) = (vec![1_u8; BYTES], vec![0_u8; BYTES]);
    loop {
        to.copy_from_slice(&from);
        std::mem::swap(&mut from, &mut to);
        for _ in 0..CALLS {
            sink.write_all(&from[..64]).expect("it takes everything");
        }
    }
}

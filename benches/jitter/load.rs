//! The load: one more process of this program on each processor, with normal priority. Each copies memory and calls the kernel
//! as fast as it can.

use std::fs::File;
use std::io::Write as _;
use std::process::{Child, Command, Stdio};
use std::{env, thread};

use rustix::process::{Signal, set_parent_process_death_signal};

/// The argument that makes this program one process of the load.
pub(crate) const ROLE: &str = "load";
/// Larger than the caches of a core.
const BYTES: usize = 16 << 20;
/// System calls between two copies of the memory.
const CALLS: usize = 2000;

/// The running load. It ends when this value is dropped.
#[derive(Debug)]
pub(crate) struct Load(Vec<Child>);

impl Load {
    /// Starts one process per processor.
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
            // A process that has already ended would be a defect of the bench; the figures would show it.
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

/// Runs the load until the bench ends.
pub(crate) fn play() -> ! {
    set_parent_process_death_signal(Some(Signal::KILL)).expect("the kernel supports this signal");
    let mut sink = File::options().write(true).open("/dev/null").expect("/dev/null exists");
    let (mut from, mut to) = (vec![1_u8; BYTES], vec![0_u8; BYTES]);
    loop {
        to.copy_from_slice(&from);
        std::mem::swap(&mut from, &mut to);
        for _ in 0..CALLS {
            sink.write_all(&from[..64]).expect("/dev/null accepts all bytes");
        }
    }
}

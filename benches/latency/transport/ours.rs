//! Our transport: frames of `bench-dragon serve`, read with the crate for clients.

use std::time::Duration;

use bench_dragon_ipc::{Domain, FrameSubscriber, Instance};

use crate::arrival::Arrival;
use crate::reading::{Receiver, WAIT};
use crate::setting::{Mode, Setting};

/// Busy loop of a reader that sleeps by the clock, before and after each due instant.
const SPIN: Duration = Duration::from_micros(100);

pub(crate) struct Subscriber {
    frames: FrameSubscriber,
    mode: Mode,
}

impl Subscriber {
    pub(crate) fn open(setting: Setting, place: &str) -> Self {
        let domain =
            Domain::new(Instance::new(place).expect("a valid name")).expect("XDG_RUNTIME_DIR is short, or unset");
        let frames = FrameSubscriber::open(&domain, "latency-bench").expect("the server has created its services");
        Self { frames, mode: setting.mode }
    }
}

impl Receiver for Subscriber {
    fn receive(&mut self) -> Option<Arrival> {
        let received = match self.mode {
            Mode::Polling => self.frames.receive(),
            Mode::Woken => self.frames.wait(WAIT),
            Mode::Clock => self.frames.wait_until_due(WAIT, SPIN),
        };
        let frame = received.expect("the bus is readable")?;
        Some(Arrival::read(*frame.header(), frame.handles().iter().copied()))
    }
}

//! The loop that reads the bus and shows scenes.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use bench_dragon_ipc::{BusError, Domain};

use super::ports::Ports;
use super::scene::Scene;
use super::sight::Sight;
use crate::system::clock::monotonic_ns;

/// How often a bus that is not there is looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(20);
/// How often a bus that could not be read is tried again.
const RETRY_PERIOD: Duration = Duration::from_millis(500);

/// Reads a bus, whatever becomes of its source.
#[derive(Debug)]
pub struct Observer {
    domain: Domain,
    name: &'static str,
    period_ns: u64,
    plans: bool,
}

impl Observer {
    /// An observer that joins under this name and shows so many scenes a second.
    pub fn new(domain: Domain, name: &'static str, scenes_hz: u32) -> Self {
        Self { domain, name, period_ns: 1_000_000_000 / u64::from(scenes_hz.max(1)), plans: false }
    }

    /// Works out the planned clearance of each run as well, on a thread of its own: some seconds of one core.
    #[must_use]
    pub fn with_plan(self) -> Self {
        Self { plans: true, ..self }
    }

    /// Observes until the flag is set, on the caller's thread, and hands over scene after scene, also where nothing comes.
    ///
    /// Nothing on the bus ends it: a bus that cannot be read is a scene too, and is tried again.
    pub fn run(&self, stop: &AtomicBool, mut show: impl FnMut(Scene)) {
        let mut sight = Sight::new(monotonic_ns(), self.plans);
        let mut ports = None;
        let mut due_ns = 0_u64;
        while !stop.load(Ordering::Relaxed) {
            let wait = Duration::from_nanos(due_ns.saturating_sub(monotonic_ns()));
            if let Err(error) = self.look(&mut ports, &mut sight, wait) {
                ports = None;
                sight.fail(&error);
                show(sight.scene(monotonic_ns()));
                thread::sleep(RETRY_PERIOD);
                continue;
            }
            let now_ns = monotonic_ns();
            if now_ns >= due_ns {
                due_ns = (due_ns + self.period_ns).max(now_ns);
                if let Err(error) = ports.as_mut().map_or(Ok(()), |ports| sight.renew(ports)) {
                    ports = None;
                    sight.fail(&error);
                }
                sight.judge(&self.domain, now_ns);
                show(sight.scene(now_ns));
            }
        }
    }

    /// Takes what comes within this time, or opens the bus if it is there.
    fn look(&self, ports: &mut Option<Ports>, sight: &mut Sight, wait: Duration) -> Result<(), BusError> {
        if let Some(ports) = ports {
            return sight.take_frames(&mut ports.frames, wait);
        }
        match Ports::open(&self.domain, self.name) {
            Ok(opened) => {
                sight.can_read();
                sight.begin_reading(monotonic_ns());
                *ports = Some(opened);
            }
            Err(error) if error.is_absent() => {
                sight.can_read();
                thread::sleep(LOOK_PERIOD.min(wait));
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }
}

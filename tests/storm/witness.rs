//! A witness of a show: reads its frames, its record of commands and its status from the bus, on a thread of its own.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bench_dragon::config::Config;
use bench_dragon_geometry::clearance::ClearanceSearch;
use bench_dragon_ipc::{
    BusError, CommandEvent, CommandEventReader, Domain, FrameHeader, FrameSubscriber, Status, StatusReader,
};
use test_support::eventually::before_deadline;

use crate::troupe::Failure;

/// Longest wait for a frame between two looks at the events.
const WAIT: Duration = Duration::from_millis(20);

/// What a witness has seen.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    /// All frames in the order in which they were read, each with its least clearance in metres.
    pub(crate) frames: Vec<(FrameHeader, f64)>,
    /// The events of each run, in their order.
    pub(crate) events: BTreeMap<u64, Vec<CommandEvent>>,
    /// The last tick of each run up to which all events are published.
    pub(crate) covered: BTreeMap<u64, u64>,
    pub(crate) status: Option<Status>,
    /// Frames that this reader was too slow for.
    pub(crate) lost: u64,
}

/// A witness at work.
#[derive(Debug)]
pub(crate) struct Witness {
    seen: Arc<Mutex<Seen>>,
    is_over: Arc<AtomicBool>,
    thread: JoinHandle<Result<(), Failure>>,
}

/// The ports of a witness.
struct Ports {
    frames: FrameSubscriber,
    events: CommandEventReader,
    status: StatusReader,
}

impl Ports {
    fn open(domain: &Domain) -> Result<Self, BusError> {
        Ok(Self {
            frames: FrameSubscriber::open(domain, "witness")?,
            events: CommandEventReader::open(domain, "witness")?,
            status: StatusReader::open(domain, "witness")?,
        })
    }
}

impl Witness {
    /// Waits for a server, and begins.
    pub(crate) fn join(domain: &Domain, config: &Config) -> Self {
        let (seen, is_over) = (Arc::<Mutex<Seen>>::default(), Arc::<AtomicBool>::default());
        let (domain, formation) = (domain.clone(), Arc::clone(config.formation()));
        let (shared, over) = (Arc::clone(&seen), Arc::clone(&is_over));
        let thread = thread::spawn(move || {
            let ports = before_deadline(|| Ports::open(&domain));
            let mut ports = ports.map_err(|error| format!("a witness finds no server: {error}"))?;
            let (mut clearances, mut boards) = (ClearanceSearch::of(formation.layout()), Vec::new());
            let mut clearance_m = |frame: &bench_dragon_ipc::Frame| {
                formation.place_boards(frame.handles(), |handle| handle.position_m.into(), &mut boards);
                clearances.nearest(&boards).map_or(f64::INFINITY, |pair| pair.clearance_m)
            };
            loop {
                let ends = over.load(Ordering::Acquire);
                let has_read = look(&mut ports, &shared, &mut clearance_m).map_err(|error| error.to_string())?;
                if ends && !has_read {
                    return Ok(());
                }
            }
        });
        Self { seen, is_over, thread }
    }

    /// What has been seen so far.
    pub(crate) fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads all that is left after the show has ended.
    pub(crate) fn end(self) -> Result<Seen, Failure> {
        self.is_over.store(true, Ordering::Release);
        self.thread.join().map_err(|_panic| "the witness has panicked".to_owned())??;
        let seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(seen.clone())
    }
}

/// Reads the next frame, and all events. Returns whether there was a frame or an event.
fn look(
    ports: &mut Ports,
    seen: &Mutex<Seen>,
    clearance_m: &mut impl FnMut(&bench_dragon_ipc::Frame) -> f64,
) -> Result<bool, BusError> {
    let frame = ports.frames.wait(WAIT)?.map(|frame| (*frame.header(), clearance_m(&frame)));
    // All events up to the tick of a status are published before it.
    let status = ports.status.poll()?;
    let mut events = Vec::new();
    while let Some(event) = ports.events.receive()? {
        events.push(event);
    }
    let has_read = frame.is_some() || !events.is_empty();
    let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
    seen.frames.extend(frame);
    seen.lost = ports.frames.lost();
    for event in events {
        seen.events.entry(event.run_id).or_default().push(event);
    }
    if let Some(status) = status {
        // The first status is published before tick 0, and has its number.
        if status.tick > 0 {
            seen.covered.insert(status.run_id, status.tick);
        }
        seen.status = Some(status);
    }
    Ok(has_read)
}

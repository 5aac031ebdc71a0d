//! The travel ahead: a thread that looks for the next contact while the monitor watches the present.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use bench_dragon_geometry::clearance::{Contact, ContactSearch};
use bench_dragon_geometry::dragon::{Dragon, Meter};
use crossbeam::atomic::AtomicCell;
use crossbeam::queue::ArrayQueue;

/// Travel that is searched between two looks at new requests, in metres.
const STRIDE_M: f64 = 2.0;
/// Work that may be done for it, in steps, a second or two: a forecast ends where that is not enough.
const STEPS_PER_STRIDE: u64 = 50_000_000;

/// What is known of the travel ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Where the knowledge begins, in metres of travel.
    pub from_m: f64,
    /// From there to here, no two benches touch.
    pub free_to_m: f64,
    /// The first contact from there on, where one was found.
    pub contact: Option<Contact>,
}

impl Forecast {
    fn unknown_from(from_m: f64) -> Self {
        Self { from_m, free_to_m: from_m, contact: None }
    }

    /// Whether no two benches touch anywhere from the one travel to the other.
    pub fn is_free(&self, from_m: f64, to_m: f64) -> bool {
        self.from_m <= from_m && to_m <= self.free_to_m
    }

    /// Whether it says anything about what lies ahead of this travel.
    pub fn covers(&self, travel_m: f64) -> bool {
        self.from_m <= travel_m && self.contact.is_none_or(|contact| travel_m < contact.travel_m)
    }
}

/// The running search, on a thread of its own that ends with it.
#[derive(Debug)]
pub struct Forecaster {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    /// Travel from which was last asked for.
    asked_from_m: f64,
}

/// What the search and its owner share.
#[derive(Debug)]
struct Shared {
    forecast: AtomicCell<Forecast>,
    /// Where to search anew: the last request alone counts.
    start: ArrayQueue<f64>,
    /// Work that the stride at hand may take.
    stride: Meter,
    is_over: AtomicBool,
}

impl Forecaster {
    /// Starts to search from this travel on for where the clearance of some pair falls to `clearance_m`. In its forecasts that is
    /// the contact.
    ///
    /// # Errors
    /// The operating system's reason why there can be no thread for it.
    ///
    /// # Panics
    /// With a clearance that is negative or not finite.
    pub fn start(dragon: &Dragon, clearance_m: f64, from_m: f64) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            forecast: AtomicCell::new(Forecast::unknown_from(from_m)),
            start: ArrayQueue::new(1),
            stride: Meter::of(STEPS_PER_STRIDE),
            is_over: AtomicBool::new(false),
        });
        let (dragon, of_thread) = (dragon.metered(&shared.stride), Arc::clone(&shared));
        let thread =
            thread::Builder::new().name("forecast".to_owned()).spawn(move || of_thread.run(&dragon, clearance_m))?;
        Ok(Self { shared, thread: Some(thread), asked_from_m: from_m })
    }

    /// What is known at present.
    pub fn latest(&self) -> Forecast {
        self.shared.forecast.load()
    }

    /// Searches anew from the head's travel on, where the latest forecast does not cover it and no benches are so near already. What
    /// is known so far stays known until the first result.
    pub fn follow(&mut self, latest: &Forecast, travel_m: f64, is_found: bool) {
        // What was asked of this very travel is known.
        let is_asked = travel_m == self.asked_from_m || self.asked_from_m != latest.from_m;
        if !is_asked && !latest.covers(travel_m) && !is_found {
            self.asked_from_m = travel_m;
            self.shared.start.force_push(travel_m);
            self.wake();
        }
    }

    fn wake(&self) {
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }
}

impl Drop for Forecaster {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        // The stride at hand is cut short.
        self.shared.stride.add(STEPS_PER_STRIDE);
        self.wake();
        // It does not panic, and nothing could be reported here.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl Shared {
    fn run(&self, dragon: &Dragon, clearance_m: f64) {
        let mut search = ContactSearch::within(dragon, clearance_m);
        let mut next = Some(self.forecast.load());
        loop {
            self.stride.restart();
            if self.is_over.load(Ordering::Relaxed) {
                return;
            }
            if let Some(from_m) = self.start.pop() {
                next = Some(Forecast::unknown_from(from_m));
            }
            let Some(forecast) = next else {
                thread::park();
                continue;
            };
            let (extended, goes_on) = extend(&mut search, dragon, forecast);
            self.forecast.store(extended);
            next = goes_on.then_some(extended);
        }
    }
}

/// The forecast with one stride more, and whether there is more to find out.
fn extend(search: &mut ContactSearch, dragon: &Dragon, forecast: Forecast) -> (Forecast, bool) {
    let to_m = (forecast.free_to_m + STRIDE_M).min(dragon.end_travel_m());
    match search.first(forecast.free_to_m, to_m) {
        Ok(Some(contact)) => (Forecast { free_to_m: contact.travel_m, contact: Some(contact), ..forecast }, false),
        Ok(None) => (Forecast { free_to_m: to_m, ..forecast }, to_m < dragon.end_travel_m()),
        // What lies further ahead stays unknown.
        Err(spent) => (Forecast { free_to_m: spent.reached_m.max(forecast.free_to_m), ..forecast }, false),
    }
}

//! The ground ahead: a thread that looks for the next contact while the monitor watches the present.

use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use bench_dragon_geometry::clearance::{Contact, ContactSearch};
use bench_dragon_geometry::dragon::{Dragon, Meter};
use crossbeam::channel::{self, Sender, TryRecvError};

/// Travel that is searched between two looks at new requests, in metres.
const STRIDE_M: f64 = 2.0;
/// Work that may be done for it, in steps, a second or two: a forecast ends where that is not enough.
const STEPS_PER_STRIDE: u64 = 50_000_000;

/// What is known of the ground ahead of a travel.
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
    /// Whether no two benches touch anywhere from the one travel to the other.
    pub fn is_free(&self, from_m: f64, to_m: f64) -> bool {
        self.from_m <= from_m && to_m <= self.free_to_m
    }

    /// Whether it says anything about the ground ahead of this travel.
    pub fn covers(&self, travel_m: f64) -> bool {
        self.from_m <= travel_m && self.contact.is_none_or(|contact| travel_m < contact.travel_m)
    }
}

/// The running search. It ends with its owner.
#[derive(Debug)]
pub struct Forecaster {
    starts: Sender<f64>,
    forecast: Arc<Mutex<Forecast>>,
}

impl Forecaster {
    /// Starts to search from this travel on.
    ///
    /// # Errors
    /// The operating system's reason why there can be no thread for it.
    pub fn start(dragon: &Dragon, from_m: f64) -> io::Result<Self> {
        Self::start_within(dragon, 0.0, from_m)
    }

    /// Starts to search from this travel on for where the clearance of some pair falls to `clearance_m`. In its forecasts that is
    /// the contact.
    ///
    /// # Errors
    /// As [`Forecaster::start`].
    ///
    /// # Panics
    /// With a clearance that is negative or not finite.
    pub fn start_within(dragon: &Dragon, clearance_m: f64, from_m: f64) -> io::Result<Self> {
        let forecast = Arc::new(Mutex::new(Forecast { from_m, free_to_m: from_m, contact: None }));
        let (starts, requests) = channel::unbounded();
        let shared = Arc::clone(&forecast);
        let dragon = dragon.metered(&Meter::of(STEPS_PER_STRIDE));
        thread::Builder::new().name("forecast".to_owned()).spawn(move || {
            let mut search = ContactSearch::within(&dragon, clearance_m);
            let mut next = Some(*lock(&shared));
            loop {
                match requests.try_recv() {
                    Ok(from_m) => next = Some(Forecast { from_m, free_to_m: from_m, contact: None }),
                    Err(TryRecvError::Empty) => {}
                    Err(TryRecvError::Disconnected) => return,
                }
                let Some(forecast) = next else {
                    let Ok(from_m) = requests.recv() else { return };
                    next = Some(Forecast { from_m, free_to_m: from_m, contact: None });
                    continue;
                };
                let (extended, goes_on) = extend(&mut search, &dragon, forecast);
                *lock(&shared) = extended;
                next = goes_on.then_some(extended);
            }
        })?;
        Ok(Self { starts, forecast })
    }

    /// Searches anew from this travel on. What is known so far stays known until the first result.
    pub fn restart(&self, from_m: f64) {
        // The thread ends only after this end of the channel is gone.
        let _ = self.starts.send(from_m);
    }

    /// What is known at present.
    pub fn latest(&self) -> Forecast {
        *lock(&self.forecast)
    }
}

/// The forecast with one stride more, and whether there is more to find out.
fn extend(search: &mut ContactSearch, dragon: &Dragon, forecast: Forecast) -> (Forecast, bool) {
    let to_m = (forecast.free_to_m + STRIDE_M).min(dragon.end_travel_m());
    dragon.meter().restart();
    match search.first(forecast.free_to_m, to_m) {
        Ok(Some(contact)) => (Forecast { free_to_m: contact.travel_m, contact: Some(contact), ..forecast }, false),
        Ok(None) => (Forecast { free_to_m: to_m, ..forecast }, to_m < dragon.end_travel_m()),
        // What lies further ahead stays unknown.
        Err(spent) => (Forecast { free_to_m: spent.reached_m.max(forecast.free_to_m), ..forecast }, false),
    }
}

fn lock(forecast: &Mutex<Forecast>) -> MutexGuard<'_, Forecast> {
    forecast.lock().unwrap_or_else(PoisonError::into_inner)
}

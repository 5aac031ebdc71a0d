//! Forecast: a thread that searches the travel ahead for the next contact, while the monitor measures the current frames.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use bench_dragon_geometry::clearance::{Contact, CourseSearch, PlayEnd, PlaySearch};
use bench_dragon_geometry::dragon::Meter;
use bench_dragon_geometry::formation::Formation;
use crossbeam::atomic::AtomicCell;
use crossbeam::queue::ArrayQueue;

/// Travel searched between two checks for new requests, in metres.
const STRIDE_M: f64 = 2.0;
/// Greatest work of a stride in steps, one to two seconds. A forecast ends at a stride that needs more.
const STEPS_PER_STRIDE: u64 = 50_000_000;

/// Result of the search of the travel ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forecast {
    /// Travel at which the search began, in metres.
    pub from_m: f64,
    /// End of the free travel, in metres: no two benches touch from `from_m` to here.
    pub free_to_m: f64,
    /// First contact at or after `from_m`, if the search has found one.
    pub contact: Option<Contact>,
    /// The same for every pose that the play of the hinges allows; `None` for hinges without play.
    pub play: Option<PlayForecast>,
}

/// Result of the search of the travel ahead for loose hinges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayForecast {
    /// End of the travel on which no pose touches, in metres.
    pub free_to_m: f64,
    /// Where a pose may touch first, if the search has got there.
    pub end: Option<PlayEnd>,
}

impl Forecast {
    fn unknown_from(from_m: f64) -> Self {
        Self { from_m, free_to_m: from_m, contact: None, play: None }
    }

    /// Whether no two benches touch between two travels.
    pub fn is_free(&self, from_m: f64, to_m: f64) -> bool {
        self.from_m <= from_m && to_m <= self.free_to_m
    }

    /// Where the proof about loose hinges ends, if the search has got there.
    pub fn play_end(&self) -> Option<PlayEnd> {
        self.play.and_then(|play| play.end)
    }

    /// Where two benches may touch first in some pose that the play of the hinges allows, if the search has got there. `None` where
    /// the proof ends because nothing is known further ahead.
    pub fn possible_touch(&self) -> Option<PlayEnd> {
        self.play_end().filter(|end| end.benches.is_some())
    }

    /// Whether the forecast is valid for the travel ahead of `travel_m`.
    pub fn covers(&self, travel_m: f64) -> bool {
        self.from_m <= travel_m && self.contact.is_none_or(|contact| travel_m < contact.travel_m)
    }
}

/// The running search. Its thread ends when the forecaster is dropped.
#[derive(Debug)]
pub struct Forecaster {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    /// Start of the last requested search, in metres of travel.
    asked_from_m: f64,
}

/// State shared by the search thread and the forecaster.
#[derive(Debug)]
struct Shared {
    forecast: AtomicCell<Forecast>,
    /// Start of the next search; a newer request replaces an older one.
    start: ArrayQueue<f64>,
    /// Work limit of the current stride.
    stride: Meter,
    is_over: AtomicBool,
}

impl Forecaster {
    /// Starts a search from a travel for the first pair whose clearance falls to `clearance_m`. Forecasts report this as the
    /// contact.
    ///
    /// # Errors
    /// The error of the operating system if it cannot start a thread.
    ///
    /// # Panics
    /// If the clearance is negative or not finite.
    pub fn start(formation: &Formation, clearance_m: f64, from_m: f64) -> io::Result<Self> {
        let shared = Arc::new(Shared {
            forecast: AtomicCell::new(Forecast::unknown_from(from_m)),
            start: ArrayQueue::new(1),
            stride: Meter::of(STEPS_PER_STRIDE),
            is_over: AtomicBool::new(false),
        });
        let (formation, of_thread) = (formation.metered(&shared.stride), Arc::clone(&shared));
        let thread =
            thread::Builder::new().name("forecast".to_owned()).spawn(move || of_thread.run(&formation, clearance_m))?;
        Ok(Self { shared, thread: Some(thread), asked_from_m: from_m })
    }

    /// Returns the latest forecast.
    pub fn latest(&self) -> Forecast {
        self.shared.forecast.load()
    }

    /// Starts a new search from the head's travel, if the latest forecast does not cover it and no pair is that near already
    /// (`is_found`). The old forecast stays until the new search has a result.
    pub fn advance(&mut self, latest: &Forecast, travel_m: f64, is_found: bool) {
        // A search from this travel was already requested, or the last request has no result yet.
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
        // Uses up the work limit, so that the current stride ends at once.
        self.shared.stride.add(STEPS_PER_STRIDE);
        self.wake();
        // The thread does not panic, and `drop` can report no error.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl Shared {
    fn run(&self, formation: &Formation, clearance_m: f64) {
        let contact = CourseSearch::within(formation, clearance_m);
        let mut search = Search { formation, clearance_m, contact, play: None };
        let mut next = Some(self.forecast.load());
        loop {
            self.stride.restart();
            if self.is_over.load(Ordering::Relaxed) {
                return;
            }
            if let Some(from_m) = self.start.pop() {
                next = Some(Forecast::unknown_from(from_m));
                search.play = None;
            }
            let Some(forecast) = next else {
                thread::park();
                continue;
            };
            let (extended, goes_on) = search.extend(forecast);
            self.forecast.store(extended);
            next = goes_on.then_some(extended);
        }
    }
}

/// The searches of a forecast.
struct Search<'a> {
    formation: &'a Formation,
    clearance_m: f64,
    contact: CourseSearch,
    /// The search for loose hinges, once it has begun.
    play: Option<PlaySearch>,
}

impl Search<'_> {
    /// Extends a forecast by one stride. Also returns whether the search continues.
    fn extend(&mut self, forecast: Forecast) -> (Forecast, bool) {
        let (extended, finds_contacts) = self.extend_nominal(forecast);
        let end_m = self.formation.end_m();
        let to_m = if finds_contacts { extended.free_to_m } else { end_m };
        let play = self.extend_play(&forecast, to_m);
        let finds_poses = play.is_some_and(|play| play.end.is_none() && play.free_to_m < end_m);
        (Forecast { play, ..extended }, finds_contacts || finds_poses)
    }

    fn extend_nominal(&mut self, forecast: Forecast) -> (Forecast, bool) {
        let end_m = self.formation.end_m();
        let to_m = (forecast.free_to_m + STRIDE_M).min(end_m);
        if forecast.contact.is_some() || forecast.free_to_m >= end_m {
            return (forecast, false);
        }
        match self.contact.first(forecast.free_to_m, to_m) {
            Ok(Some(contact)) => (Forecast { free_to_m: contact.travel_m, contact: Some(contact), ..forecast }, false),
            Ok(None) => (Forecast { free_to_m: to_m, ..forecast }, to_m < end_m),
            // The work limit is spent: the travel further ahead stays unknown.
            Err(spent) => (Forecast { free_to_m: spent.reached_m.max(forecast.free_to_m), ..forecast }, false),
        }
    }

    /// Extends the forecast for loose hinges by a stride, at most to a travel. `None` for hinges without play.
    fn extend_play(&mut self, forecast: &Forecast, to_m: f64) -> Option<PlayForecast> {
        // Only hinges of a dragon that is alone have play.
        let dragon = self.formation.lead();
        if dragon.dimensions().play_m() == 0.0 {
            return None;
        }
        let before = forecast.play.unwrap_or(PlayForecast { free_to_m: forecast.from_m, end: None });
        if before.end.is_some() {
            return Some(before);
        }
        let unknown_from =
            |travel_m| PlayForecast { free_to_m: travel_m, end: Some(PlayEnd { travel_m, benches: None }) };
        let touch = |travel_m, benches| PlayEnd { travel_m, benches: Some(benches) };
        if self.play.is_none() {
            let Ok(search) = PlaySearch::at(dragon, self.clearance_m, before.free_to_m) else {
                return Some(unknown_from(before.free_to_m));
            };
            self.play = search;
            if let Some(here) = self.play.as_ref().and_then(PlaySearch::touch_here) {
                return Some(PlayForecast { end: Some(touch(here.travel_m, here.benches)), ..before });
            }
        }
        let search = self.play.as_mut()?;
        let to_m = to_m.min(before.free_to_m + STRIDE_M);
        Some(match search.advance(to_m) {
            Ok(Some(found)) => {
                PlayForecast { free_to_m: found.travel_m, end: Some(touch(found.travel_m, found.benches)) }
            }
            Ok(None) if search.end_m() < to_m => unknown_from(search.end_m().max(before.free_to_m)),
            Ok(None) => PlayForecast { free_to_m: to_m.max(before.free_to_m), end: None },
            Err(spent) => unknown_from(spent.reached_m.max(before.free_to_m)),
        })
    }
}

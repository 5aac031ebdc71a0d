//! A dragon at one travel, and its first-order changes there.

use std::sync::Arc;

use super::Parameter;
use super::board_variation::{BoardVariation, Undefined, Witness};
use super::chain_variation::{Change, HandleVariation, handle_variations};
use crate::dragon::{Board, Dimensions, Dragon, DragonError, Handle, Meter};
use crate::route::{RouteFamily, RouteMeasure};

/// A dragon on a route that belongs to a family over the pitch.
#[derive(Clone, Debug)]
pub(super) struct VariedDragon {
    pub(super) dragon: Dragon,
    /// The family of the dragon's route.
    pub(super) family: RouteFamily,
}

impl VariedDragon {
    /// The dragon on the family's route. The meter counts all work for it.
    pub(super) fn new(dimensions: Dimensions, family: RouteFamily, meter: &Meter) -> Result<Self, DragonError> {
        Ok(Self { dragon: Dragon::with_meter(dimensions, Arc::clone(family.route()), meter.clone())?, family })
    }
}

/// Rates of change of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rates {
    /// Change per metre that the head walks.
    pub(super) travel: f64,
    /// Change per unit of each parameter, at fixed travel of the head.
    measures: [f64; Parameter::ALL.len()],
}

impl Rates {
    /// Change per unit of a parameter, at fixed travel of the head.
    pub(super) fn of(&self, parameter: Parameter) -> f64 {
        self.measures[parameter as usize]
    }

    /// The rates of this number minus another one that changes only with the measures of the route.
    pub(super) fn less_on_route(mut self, rate: impl Fn(RouteMeasure) -> f64) -> Self {
        for parameter in Parameter::ALL {
            self.measures[parameter as usize] -= parameter.of_route().map_or(0.0, &rate);
        }
        self
    }

    fn each(rate: impl Fn(Change) -> f64) -> Self {
        let measures = Parameter::ALL.map(|parameter| rate(Change::Measure(parameter)));
        Self { travel: rate(Change::Travel), measures }
    }
}

/// The front part of a dragon at one travel.
#[derive(Debug)]
pub(super) struct Local<'a> {
    varied: &'a VariedDragon,
    handles: Vec<Handle>,
}

impl<'a> Local<'a> {
    /// The first `handles` handles with the head at a travel within the run.
    pub(super) fn new(varied: &'a VariedDragon, travel_m: f64, handles: usize) -> Self {
        let chain = varied.dragon.chain(travel_m).expect("the travel lies within the run");
        Self { varied, handles: chain.take(handles).collect() }
    }

    /// Rates of the clearance of two benches.
    pub(super) fn clearance(&self, benches: [usize; 2]) -> Result<Rates, Undefined> {
        self.clearance_rate(benches).map(Rates::each)
    }

    /// A function that returns the rate of the clearance of two benches for a change.
    fn clearance_rate(&self, benches: [usize; 2]) -> Result<impl Fn(Change) -> f64, Undefined> {
        let boards = benches.map(|bench| self.board(bench));
        let witness = Witness::of(&boards[0], &boards[1])?;
        Ok(move |change| {
            let handles = self.variations(change);
            let [first, second] = [0, 1].map(|i| {
                BoardVariation::new(&self.varied.dragon, benches[i], &boards[i], &handles[benches[i]..], change)
            });
            witness.variation([&boards[0], &boards[1]], [&first, &second])
        })
    }

    /// Change of the clearance of two benches per metre that the head walks.
    pub(super) fn closing(&self, benches: [usize; 2]) -> Result<f64, Undefined> {
        Ok(self.clearance_rate(benches)?(Change::Travel))
    }

    /// Rates of the last handle's speed ratio.
    pub(super) fn speed_ratio(&self) -> Rates {
        self.of_handle(self.handles.len() - 1, |handle| handle.speed_ratio)
    }

    /// Rates of a handle's travel.
    pub(super) fn handle_travel(&self, handle: usize) -> Rates {
        self.of_handle(handle, |handle| handle.travel)
    }

    /// Rates of the head's distance from the centre of a spiral, in the plan.
    pub(super) fn head_radius(&self) -> Rates {
        let centre = self.varied.family.centre().unwrap_or_default();
        let outward = (self.handles[0].position - centre).normalize();
        self.of_handle(0, |handle| handle.position.dot(outward))
    }

    /// Each handle within `tolerance_m` of a seam of the route, with the index of that seam.
    pub(super) fn on_seams(&self, tolerance_m: f64) -> Vec<(usize, usize)> {
        let route = self.varied.dragon.route();
        let travels_m: Vec<f64> = route.seams().iter().map(|&seam| route.travel(seam)).collect();
        let mut found = Vec::new();
        for (handle, travel_m) in self.handles.iter().map(|handle| route.travel(handle.parameter)).enumerate() {
            let seam = travels_m.iter().position(|seam_m| (travel_m - seam_m).abs() <= tolerance_m);
            found.extend(seam.map(|seam| (handle, seam)));
        }
        found
    }

    fn of_handle(&self, handle: usize, rate: impl Fn(&HandleVariation) -> f64) -> Rates {
        Rates::each(|change| rate(&self.variations(change)[handle]))
    }

    fn variations(&self, change: Change) -> Vec<HandleVariation> {
        handle_variations(self.varied.dragon.dimensions(), &self.varied.family, &self.handles, change)
    }

    fn board(&self, bench: usize) -> Board {
        self.varied.dragon.board(bench, &self.handles[bench], &self.handles[bench + 1])
    }
}

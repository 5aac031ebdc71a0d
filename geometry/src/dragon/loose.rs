//! Loose hinges: poles that are thinner than the holes of the boards.
//!
//! The poles walk on the route, and each hole is anywhere within the play c of its pole. So two neighbouring poles are from
//! d − 2c to d + 2c apart. A pole is *allowed* if it is on the route behind the pole before it, and no further behind than the
//! nearest point at d + 2c.
//!
//! **Brackets.** With f(x) the nearest point behind x at the distance of a link (the chain rule), an allowed pole behind a pole
//! at x is from the f of the longest link to the f of the shortest one. Where these two walk, each grows with x. So the chain of
//! the longest links, the *taut* one, and that of the shortest links, the *compact* one, bracket each pole of every allowed pose.
//! Nothing needs to be known of the links between.
//!
//! **Where they walk.** The feasible travels of the taut and of the compact dragon are proofs for the places that their own
//! handles pass (see `feasible`). The bracket of a body handle also has places that only the other chain passes. There, the links are
//! searched for faults too, and the brackets hold up to the first.

use super::feasible::{TightSpot, first_fault};
use super::meter::Meter;
use super::{Dragon, DragonError};

/// The two chains that bracket all allowed poses of a dragon.
#[derive(Clone, Debug)]
pub(crate) struct Loose {
    taut: Dragon,
    compact: Dragon,
    end_travel_m: f64,
}

impl Loose {
    /// The chains of a dragon whose dimensions have play.
    ///
    /// # Errors
    /// As [`Dragon::with_meter`]: all links long, or all links short, the dragon cannot stand at the start.
    pub(super) fn new(rigid: &Dragon) -> Result<Self, DragonError> {
        let play_m = 2.0 * rigid.dimensions.play_m();
        let with_links =
            |by_m| Dragon::rigid(rigid.dimensions.with_longer_links(by_m), rigid.route.clone(), rigid.meter.clone());
        let mut loose =
            Self { taut: with_links(play_m)?, compact: with_links(-play_m)?, end_travel_m: rigid.end_travel_m() };
        loose.end_travel_m = loose.end_travel_m.min(loose.taut.end_travel_m()).min(loose.compact.end_travel_m());
        if rigid.dimensions.benches() > 1 {
            loose.require_standing()?;
            loose.shorten(rigid.meter());
        }
        Ok(loose)
    }

    /// The dragon with all links as long as the play allows: one that is pulled.
    pub(crate) fn taut(&self) -> &Dragon {
        &self.taut
    }

    /// The dragon with all links as short as the play allows.
    pub(crate) fn compact(&self) -> &Dragon {
        &self.compact
    }

    /// Travel up to which the chains bracket every allowed pose.
    pub(crate) fn end_travel_m(&self) -> f64 {
        self.end_travel_m
    }

    /// The bracket of a handle, from the rearmost parameter to the foremost one.
    pub(crate) fn bracket(&self, travel_m: f64, handle: usize) -> [f64; 2] {
        [&self.taut, &self.compact].map(|dragon| {
            let mut chain = dragon.chain(travel_m).expect("the travel is feasible");
            chain.nth(handle).expect("every link meets the route at feasible travels").parameter
        })
    }

    #[must_use]
    pub(super) fn metered(&self, meter: &Meter) -> Self {
        Self { taut: self.taut.metered(meter), compact: self.compact.metered(meter), ..*self }
    }

    /// Checks the shortest link where, at the start, only the taut chain has handles: behind the last front handle of the
    /// compact one.
    fn require_standing(&self) -> Result<(), DragonError> {
        let last = self.compact.dimensions().benches() - 1;
        let [rear, front] = self.bracket(self.compact.start_travel_m(), last);
        let link_m = self.compact.dimensions().link_m(last);
        first_fault(self.compact.route(), link_m, rear, front, self.compact.meter()).map_or(Ok(()), |parameter| {
            let at = TightSpot::at(self.compact.route(), last, parameter);
            Err(DragonError::CannotStand { at, link_m })
        })
    }

    /// Ends the brackets where handle 1 of the compact chain reaches a fault of the longest body link.
    fn shorten(&mut self, meter: &Meter) {
        let [rear, front] = self.bracket(self.end_travel_m, 1);
        let link_m = self.taut.dimensions().link_m(1);
        if let Some(fault) = first_fault(self.taut.route(), link_m, rear, front, meter) {
            let (parameter, _) = self.compact.head_before(fault);
            self.end_travel_m = self.end_travel_m.min(self.compact.route().travel(parameter));
        }
    }
}

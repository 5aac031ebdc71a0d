//! The route as a step sees it.

use crate::route::{PolarStretch, Route};

/// A route and its stretches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve<'a> {
    pub(super) route: &'a dyn Route,
    pub(super) stretches: &'a [PolarStretch],
}

impl Curve<'_> {
    /// The number of the stretch on which a place lies; none if the curve has no stretches.
    #[inline(always)]
    pub(super) fn stretch_at(&self, place: f64) -> Option<usize> {
        self.stretches.iter().rposition(|stretch| stretch.begin <= place)
    }
}

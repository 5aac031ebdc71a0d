//! The dragons that are measured.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{Dimensions, Dragon};
use bench_dragon_geometry::route::Route;

/// The paper's benches, and as many of them as wanted.
pub fn dimensions(benches: usize) -> Dimensions {
    Dimensions::new(benches, 3.41, 2.20, 0.30, 0.275).expect("the paper's benches are valid")
}

/// A dragon of so many benches on the paper's spiral, 223 being the paper's own. The body reaches as far out as it must.
pub fn dragon(benches: usize) -> Dragon {
    let spiral = Route::spiral(0.55, 16.0).expect("the paper's spiral is valid");
    Dragon::new(dimensions(benches), Arc::new(spiral)).expect("the dragon stands on the paper's spiral")
}

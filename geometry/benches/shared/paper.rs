//! The dragons that the benches measure.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{Dimensions, Dragon};
use bench_dragon_geometry::route::Route;

/// The paper's dimensions with `benches` benches.
pub fn dimensions(benches: usize) -> Dimensions {
    Dimensions::new(benches, 3.41, 2.20, 0.30, 0.275).expect("the paper's benches are valid")
}

/// A dragon of `benches` benches on the paper's spiral. The paper's dragon has 223. A longer body extends further out.
pub fn dragon(benches: usize) -> Dragon {
    let spiral = Route::spiral(0.55, 16.0).expect("the paper's spiral is valid");
    Dragon::new(dimensions(benches), Arc::new(spiral)).expect("the dragon stands on the paper's spiral")
}

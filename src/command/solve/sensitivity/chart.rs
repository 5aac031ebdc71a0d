//! The responses as a figure.

use bench_dragon_geometry::planner::{Curve, Response, Sensitivity};

use super::tables::titled;
use crate::output::figure;

/// A plot for each quantity that there is.
pub(super) fn chart(
    caption: figure::Caption,
    sensitivity: &Sensitivity,
    responses: &[Response],
) -> figure::Sensitivity {
    let answered = responses.iter().filter(|response| response.value.is_ok());
    let plot = |response: &Response| figure::Quantity {
        name: titled(response),
        curves: response.curves.iter().map(|curve| points(sensitivity, curve)).collect(),
    };
    figure::Sensitivity {
        caption,
        parameters: sensitivity.parameters.iter().map(ToString::to_string).collect(),
        quantities: answered.map(plot).collect(),
    }
}

fn points(sensitivity: &Sensitivity, curve: &Curve) -> Vec<(f64, Option<f64>)> {
    let point = |(sample, step): (&bench_dragon_geometry::planner::Sample, i32)| {
        let change_percent = 100.0 * sensitivity.range * f64::from(step) / f64::from(sensitivity.steps);
        (change_percent, sample.value.clone().ok())
    };
    curve.samples.iter().zip(-sensitivity.steps.cast_signed()..).map(point).collect()
}

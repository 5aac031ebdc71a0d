//! The responses as JSON. Where a number is null, a reason tells why.

use bench_dragon_geometry::planner::{Curve, Response, Sample, Sensitivity};
use serde::Serialize;

#[derive(Serialize)]
pub(super) struct Answer {
    turn_diameter_m: f64,
    range_percent: f64,
    quantities: Vec<ResponseAnswer>,
}

#[derive(Serialize)]
struct ResponseAnswer {
    quantity: &'static str,
    value: Option<f64>,
    reason: Option<String>,
    parameters: Vec<CurveAnswer>,
}

#[derive(Serialize)]
struct CurveAnswer {
    parameter: &'static str,
    value: f64,
    /// In the quantity's unit per unit of the parameter.
    derivative: Option<f64>,
    derivative_reason: Option<String>,
    samples: Vec<SampleAnswer>,
}

#[derive(Serialize)]
struct SampleAnswer {
    parameter_value: f64,
    value: Option<f64>,
    reason: Option<String>,
}

pub(super) fn answer(sensitivity: &Sensitivity, responses: &[Response]) -> Answer {
    Answer {
        turn_diameter_m: sensitivity.turn_diameter_m,
        range_percent: 100.0 * sensitivity.range,
        quantities: responses.iter().map(ResponseAnswer::from).collect(),
    }
}

impl From<&Response> for ResponseAnswer {
    fn from(response: &Response) -> Self {
        let (value, reason) = number_or_reason(&response.value);
        let parameters = response.curves.iter().map(CurveAnswer::from).collect();
        Self { quantity: response.quantity.key(), value, reason, parameters }
    }
}

impl From<&Curve> for CurveAnswer {
    fn from(curve: &Curve) -> Self {
        let (derivative, derivative_reason) = number_or_reason(&curve.derivative);
        Self {
            parameter: curve.parameter.key(),
            value: curve.parameter_value,
            derivative,
            derivative_reason,
            samples: curve.samples.iter().map(SampleAnswer::from).collect(),
        }
    }
}

impl From<&Sample> for SampleAnswer {
    fn from(sample: &Sample) -> Self {
        let (value, reason) = number_or_reason(&sample.value);
        Self { parameter_value: sample.parameter_value, value, reason }
    }
}

fn number_or_reason<E: ToString>(result: &Result<f64, E>) -> (Option<f64>, Option<String>) {
    (result.as_ref().ok().copied(), result.as_ref().err().map(E::to_string))
}

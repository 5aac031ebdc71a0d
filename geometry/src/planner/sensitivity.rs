//! How the planner's answers respond to each parameter: over a range about the plan, and locally.
//!
//! The speed of the head changes times alone: the way that is walked stays that of the plan, also on a turnaround, whose
//! plan begins and ends at times.

use super::answers::{Answer, Quantity, Unanswered, answer};
use super::cores::on_all_cores;
use super::derivative::Undefined;
use super::{Parameter, Setting};
use crate::dragon::Meter;

/// The part of the work that one answer may take.
const LARGEST_SHARE: u64 = 8;

/// What to study.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivity {
    /// The plan.
    pub setting: Setting,
    /// Diameter of the circle that a spiral is walked to.
    pub turn_diameter_m: f64,
    /// By how much of its value a parameter is varied to either side, above 0 and under 1.
    pub range: f64,
    /// Values to either side of the planned one, at least 1.
    pub steps: u32,
    /// What is varied.
    pub parameters: Vec<Parameter>,
}

/// A quantity and how it responds.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// Which.
    pub quantity: Quantity,
    /// As planned.
    pub value: Result<f64, Unanswered>,
    /// Over each parameter studied.
    pub curves: Vec<Curve>,
}

/// A quantity over one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Which parameter.
    pub parameter: Parameter,
    /// As planned.
    pub parameter_value: f64,
    /// Change of the quantity per unit of the parameter, at its planned value.
    pub derivative: Result<f64, NoDerivative>,
    /// Over the range, the parameter ascending.
    pub samples: Vec<Sample>,
}

/// A quantity at one value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Of the parameter.
    pub parameter_value: f64,
    /// Of the quantity.
    pub value: Result<f64, Unanswered>,
}

/// Why there is no derivative.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoDerivative {
    /// There is no value either.
    #[error(transparent)]
    Unanswered(#[from] Unanswered),
    /// There is a value, but it does not change smoothly.
    #[error(transparent)]
    Undefined(#[from] Undefined),
}

/// One question.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Task {
    quantity: Quantity,
    /// A parameter and by how many steps it is off; none for the plan itself.
    varied: Option<(Parameter, i64)>,
}

impl Sensitivity {
    /// How many questions a study has to answer.
    pub fn questions(&self) -> usize {
        self.tasks().len()
    }

    /// The responses of all quantities, in the order of [`Quantity::ALL`]. Works on all cores; calls `answered` after each
    /// question. What the meter does not allow stays unanswered.
    pub fn study(&self, meter: &Meter, answered: impl Fn() + Sync) -> Vec<Response> {
        let tasks = self.tasks();
        let share = meter.is_limited().then(|| meter.left() / LARGEST_SHARE);
        let mut answers = on_all_cores(meter, tasks.len(), |index, meter| {
            let own = share.map_or_else(Meter::unlimited, |share| Meter::of(share.min(meter.left())));
            let answer = self.answer(tasks[index], &own);
            meter.add(own.done());
            answered();
            answer
        });
        answers.resize_with(tasks.len(), || Err(Unanswered::TooMuchWork(meter.spent(0.0))));
        let answers: Vec<_> = tasks.into_iter().zip(answers).collect();
        let response = |quantity| self.response(quantity, &answers);
        Quantity::ALL.into_iter().map(response).collect()
    }

    /// Speed need not be tried out, and the pitch has nothing to do with the smallest one.
    fn tasks(&self) -> Vec<Task> {
        let mut tasks: Vec<Task> = Quantity::ALL.map(|quantity| Task { quantity, varied: None }).into();
        for &parameter in self.parameters.iter().filter(|parameter| **parameter != Parameter::Speed) {
            for quantity in Quantity::ALL.into_iter().filter(|quantity| !is_its_own(*quantity, parameter)) {
                let steps = self.steps().filter(|step| *step != 0);
                tasks.extend(steps.map(|step| Task { quantity, varied: Some((parameter, step)) }));
            }
        }
        tasks
    }

    fn steps(&self) -> impl Iterator<Item = i64> {
        let steps = i64::from(self.steps);
        -steps..=steps
    }

    fn parameter_value(&self, parameter: Parameter, step: i64) -> f64 {
        self.setting.value(parameter) * (1.0 + self.range * step as f64 / f64::from(self.steps))
    }

    fn answer(&self, task: Task, meter: &Meter) -> Result<Answer, Unanswered> {
        let setting = match task.varied {
            Some((parameter, step)) => self.setting.with(parameter, self.parameter_value(parameter, step))?,
            None => self.setting,
        };
        answer(task.quantity, &setting, self.turn_diameter_m, meter)
    }

    fn response(&self, quantity: Quantity, answers: &[(Task, Result<Answer, Unanswered>)]) -> Response {
        let found = |task: Task| &answers.iter().find(|(other, _)| *other == task).expect("every task was done").1;
        let planned = found(Task { quantity, varied: None });
        let value =
            |answer: &Result<Answer, Unanswered>| answer.as_ref().map(|answer| answer.value).map_err(Clone::clone);
        let derivatives = planned.as_ref().map(|answer| (answer.derivatives)());
        let curve = |&parameter: &Parameter| {
            let sampled = |step| match parameter {
                _ if is_its_own(quantity, parameter) => Err(Unanswered::OwnPitch),
                Parameter::Speed if quantity == Quantity::FirstContact => {
                    value(planned).map(|time_s| time_s * self.setting.speed_mps / self.parameter_value(parameter, step))
                }
                _ if step == 0 || parameter == Parameter::Speed => value(planned),
                _ => value(found(Task { quantity, varied: Some((parameter, step)) })),
            };
            let sample = |step| Sample { parameter_value: self.parameter_value(parameter, step), value: sampled(step) };
            Curve {
                parameter,
                parameter_value: self.setting.value(parameter),
                derivative: match &derivatives {
                    Ok(derivatives) => derivatives[parameter as usize].map_err(NoDerivative::from),
                    Err(unanswered) => Err((*unanswered).clone().into()),
                },
                samples: self.steps().map(sample).collect(),
            }
        };
        Response { quantity, value: value(planned), curves: self.parameters.iter().map(curve).collect() }
    }
}

/// Whether the quantity is the very parameter.
fn is_its_own(quantity: Quantity, parameter: Parameter) -> bool {
    quantity == Quantity::SmallestPitch && parameter == Parameter::Pitch
}

//! Response of the planner's answers to each parameter: over a range around the plan, and as a derivative at the plan.
//!
//! Speed and acceleration of the head only change times. The walked interval stays that of the plan, also on a turnaround, whose plan
//! begins and ends at times.

use super::answers::{Answer, Quantity, Unanswered, answer};
use super::board_variation::Undefined;
use super::cores::on_all_cores;
use super::{Parameter, Setting};
use crate::dragon::Meter;

/// Divisor of the limit of work that gives the limit of one answer.
const LARGEST_SHARE: u64 = 8;

/// A sensitivity study.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivity {
    /// The plan.
    pub setting: Setting,
    /// Diameter of the circle to which a spiral is walked, in metres.
    pub turn_diameter_m: f64,
    /// Largest variation of a parameter to either side, as a share of its value: above 0 and below 1.
    pub range: f64,
    /// Number of values to either side of the planned one, at least 1.
    pub steps: u32,
    /// The parameters to vary.
    pub parameters: Vec<Parameter>,
}

/// A quantity and its response.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// The quantity.
    pub quantity: Quantity,
    /// Value of the quantity for the plan.
    pub value: Result<f64, Unanswered>,
    /// The response to each parameter.
    pub curves: Vec<Curve>,
}

/// The response of a quantity to one parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// The parameter.
    pub parameter: Parameter,
    /// Planned value of the parameter.
    pub parameter_value: f64,
    /// Change of the quantity per unit of the parameter, at the planned value.
    pub derivative: Result<f64, NoDerivative>,
    /// The samples over the range, by ascending parameter.
    pub samples: Vec<Sample>,
}

/// A quantity at one value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Value of the parameter.
    pub parameter_value: f64,
    /// Value of the quantity.
    pub value: Result<f64, Unanswered>,
}

/// Reason why there is no derivative.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoDerivative {
    /// The quantity has no value.
    #[error(transparent)]
    Unanswered(#[from] Unanswered),
    /// The quantity has a value, but does not change smoothly.
    #[error(transparent)]
    Undefined(#[from] Undefined),
}

/// A calculation of one quantity for one setting.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Task {
    quantity: Quantity,
    /// A parameter and the number of steps from its planned value; `None` for the plan itself.
    varied: Option<(Parameter, i64)>,
}

impl Sensitivity {
    /// Number of quantities that a study calculates, for progress.
    pub fn questions(&self) -> usize {
        self.tasks().len()
    }

    /// Calculates the responses of all quantities of the plan, in the order of [`Quantity::all_of`], on all cores. It calls
    /// `answered` after each calculation. Calculations beyond the meter's limit have no value.
    pub fn study(&self, meter: &Meter, answered: impl Fn() + Sync) -> Vec<Response> {
        let tasks = self.tasks();
        let share = meter.is_limited().then(|| meter.left() / LARGEST_SHARE);
        let mut answers = on_all_cores(meter, tasks.len(), |index, meter| {
            let own = share.map_or_else(Meter::unlimited, |share| meter.part(share.min(meter.left())));
            let answer = self.answer(tasks[index], &own);
            meter.add(own.done());
            answered();
            answer
        });
        answers.resize_with(tasks.len(), || Err(Unanswered::TooMuchWork(meter.spent(0.0))));
        let answers: Vec<_> = tasks.into_iter().zip(answers).collect();
        let response = |quantity| self.response(quantity, &answers, meter);
        Quantity::all_of(&self.setting).map(response).collect()
    }

    /// The calculations of the study. Speed and acceleration are not varied, because their effect is known. Neither are, for the
    /// smallest pitch, the pitch, the measures of a turn and the diameters of loose hinges: it does not depend on them.
    fn tasks(&self) -> Vec<Task> {
        let quantities = || Quantity::all_of(&self.setting);
        let mut tasks: Vec<Task> = quantities().map(|quantity| Task { quantity, varied: None }).collect();
        for &parameter in self.parameters.iter().filter(|parameter| !parameter.is_of_times()) {
            let depends =
                |quantity: &Quantity| unrelated(*quantity, parameter).is_none() && !has_no_effect(*quantity, parameter);
            for quantity in quantities().filter(depends) {
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
            None => self.setting.clone(),
        };
        answer(task.quantity, &setting, self.turn_diameter_m, meter)
    }

    fn response(&self, quantity: Quantity, answers: &[(Task, Result<Answer, Unanswered>)], meter: &Meter) -> Response {
        let found = |task: Task| &answers.iter().find(|(other, _)| *other == task).expect("every task was done").1;
        let planned = found(Task { quantity, varied: None });
        let value =
            |answer: &Result<Answer, Unanswered>| answer.as_ref().map(|answer| answer.value).map_err(Clone::clone);
        let derivatives = match planned {
            Ok(_) if meter.is_cancelled() => Err(Unanswered::TooMuchWork(meter.spent(0.0))),
            Ok(answer) => Ok((answer.derivatives)()),
            Err(unanswered) => Err(unanswered.clone()),
        };
        let curve = |&parameter: &Parameter| {
            let sampled = |step| match parameter {
                _ if step == 0 => value(planned),
                _ if has_no_effect(quantity, parameter) => {
                    self.setting.with(parameter, self.parameter_value(parameter, step))?;
                    value(planned)
                }
                _ if parameter.is_of_times() => {
                    let timed = |answer: &Answer| (answer.timed)(parameter, self.parameter_value(parameter, step));
                    planned.as_ref().map(timed).map_err(Clone::clone)
                }
                _ => value(found(Task { quantity, varied: Some((parameter, step)) })),
            };
            let sample = |step| Sample {
                parameter_value: self.parameter_value(parameter, step),
                value: unrelated(quantity, parameter).map_or_else(|| sampled(step), Err),
            };
            Curve {
                parameter,
                parameter_value: self.setting.value(parameter),
                derivative: match &derivatives {
                    Ok(derivatives) => derivatives[parameter as usize].map_err(NoDerivative::from),
                    Err(unanswered) => Err(unanswered.clone().into()),
                },
                samples: self.steps().map(sample).collect(),
            }
        };
        Response { quantity, value: value(planned), curves: self.parameters.iter().map(curve).collect() }
    }
}

/// Whether the parameter changes only the play, and the quantity is that of hinges without play.
fn has_no_effect(quantity: Quantity, parameter: Parameter) -> bool {
    quantity == Quantity::SmallestPitch && parameter.is_of_play()
}

/// Why the quantity does not depend on the parameter: it is the parameter itself, or about another route.
fn unrelated(quantity: Quantity, parameter: Parameter) -> Option<Unanswered> {
    match quantity {
        Quantity::SmallestPitch if parameter == Parameter::Pitch => Some(Unanswered::OwnPitch),
        Quantity::SmallestPitch if parameter.is_of_turn() => Some(Unanswered::NoTurn),
        _ => None,
    }
}

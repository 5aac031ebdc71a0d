//! `solve`: the planner's questions, one file each.

use std::process::ExitCode;

use crate::cli::Question;

mod caption;
mod contact;
mod figures;
mod pitch;
mod poses;
mod profile;
mod save_config;
mod sensitivity;
mod speed_limit;
mod times;
mod turn;
mod turn_plan;

pub(crate) fn run(question: Question) -> anyhow::Result<ExitCode> {
    match question {
        Question::Poses(args) => poses::run(&args)?,
        Question::Contact(args) => contact::run(&args)?,
        Question::Pitch(args) => pitch::run(&args)?,
        Question::Turn(args) => turn::run(&args)?,
        Question::SpeedLimit(args) => speed_limit::run(&args)?,
        Question::Sensitivity(args) => sensitivity::run(&args)?,
    }
    Ok(ExitCode::SUCCESS)
}

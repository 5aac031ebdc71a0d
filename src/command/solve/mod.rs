//! `solve`: the planner's questions, one file each.

use std::process::ExitCode;

use crate::cli::Question;

mod contact;
mod figures;
mod poses;
mod progress;
mod sensitivity;
mod times;

pub(crate) fn run(question: Question) -> anyhow::Result<ExitCode> {
    match question {
        Question::Poses(args) => poses::run(&args)?,
        Question::Contact(args) => contact::run(&args)?,
        Question::Sensitivity(args) => sensitivity::run(&args)?,
    }
    Ok(ExitCode::SUCCESS)
}

//! `solve`: the planner's questions, one file each.

use std::process::ExitCode;

use bench_dragon::config::Overrides;

use crate::cli::Question;
use crate::command::load_config;

mod contact;
mod poses;
mod times;

pub(crate) fn run(question: Question) -> anyhow::Result<ExitCode> {
    match question {
        Question::Poses(args) => poses::run(&args)?,
        Question::Contact { config, format } => {
            contact::run(&load_config(&config, Overrides::default())?, format.format)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

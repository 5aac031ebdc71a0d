//! `solve`: the planner's questions, one file each.

use std::process::ExitCode;

use anyhow::bail;

use crate::cli::{AnswerArgs, Question};
use crate::config::Config;
use crate::system::whole_file;

mod caption;
mod contact;
mod figures;
mod pitch;
mod poses;
mod sensitivity;
mod speed_limit;
mod turn;

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

/// Writes the configuration that is the answer, if the arguments ask for it; fails with the reason where there is none.
pub(super) fn save_config(args: &AnswerArgs, answer: Result<&Config, &str>) -> anyhow::Result<()> {
    let Some(path) = &args.save_config else { return Ok(()) };
    match answer {
        Ok(config) => whole_file::write(path, config.to_toml().as_bytes()),
        Err(reason) => bail!("--save-config has nothing to save: {reason}"),
    }
}

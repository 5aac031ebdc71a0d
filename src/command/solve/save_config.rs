//! Answers as configurations that can be played.

use anyhow::bail;

use crate::cli::SaveConfigArgs;
use crate::command::whole_file;
use crate::config::Config;

/// Writes the configuration that is the answer, if the arguments ask for it; fails with the reason where there is none.
pub(super) fn save_config(args: &SaveConfigArgs, answer: Result<&Config, &str>) -> anyhow::Result<()> {
    let Some(path) = &args.save_config else { return Ok(()) };
    match answer {
        Ok(config) => whole_file::write(path, config.to_toml().as_bytes()),
        Err(reason) => bail!("--save-config has nothing to save: {reason}"),
    }
}

//! Whom the checks are about.

use std::path::{Path, PathBuf};

use bench_dragon_ipc::{Census, Domain, DomainError, Instance, service};

use crate::config::Config;

/// An instance on this machine, the dragon that it is to play, and the folder that it is to be recorded in.
#[derive(Debug)]
pub struct Patient {
    instance: Instance,
    root: Option<PathBuf>,
    census: Result<Census, DomainError>,
    config: Config,
    folder: PathBuf,
}

impl Patient {
    /// Looks at the instance; the rest is read by the checks.
    pub fn new(instance: Instance, config: Config, folder: PathBuf) -> Self {
        let domain = Domain::new(instance.clone());
        let root = domain.as_ref().ok().map(|domain| domain.root().to_owned());
        let census = domain.and_then(|domain| Census::take(&domain));
        Self { instance, root, census, config, folder }
    }

    pub(super) fn instance(&self) -> &Instance {
        &self.instance
    }

    /// The directory of the bus, where the instance can have one.
    pub(super) fn root(&self) -> Option<&Path> {
        self.root.as_deref()
    }

    /// Who and what is on the bus, or why that cannot be told.
    pub(super) fn census(&self) -> Result<&Census, &DomainError> {
        self.census.as_ref()
    }

    pub(super) fn config(&self) -> &Config {
        &self.config
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Shared memory that a server of this dragon takes, with all its readers, in bytes.
    pub(super) fn shared_memory(&self) -> u64 {
        let benches = self.config.dragon().dimensions().benches();
        service::frame_memory(benches) + service::SOURCE_MEMORY + service::ALERT_MEMORY
    }

    /// The command that cleans up.
    pub(super) fn fix(&self) -> String {
        match self.instance() {
            default if *default == Instance::default() => "`bench-dragon doctor --fix`".to_owned(),
            other => format!("`bench-dragon doctor --fix --instance {other}`"),
        }
    }
}

//! Domain of an instance: its name, its directory and its iceoryx2 configuration.
//!
//! Each instance is an iceoryx2 domain of its own, so two shows on one machine do not interfere. Root path:
//! `$XDG_RUNTIME_DIR/bench-dragon/NAME`, else `/tmp/bench-dragon-UID/NAME`; prefix `bd_UID_NAME_`. The one segment whose name
//! would follow from these has a random number in its suffix (`secret.rs`).

use std::ffi::OsString;
use std::fs::{self, DirBuilder, Metadata, Permissions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, FilePath, SemanticString};

use super::domain_error::{DomainError, MAX_ROOT_PATH_LEN};
use super::instance::Instance;
use super::secret;
use super::shortage::SHARED_MEMORY;
use super::sweep::{foreign_owner, named_as_ours};

/// iceoryx2 domain of an instance.
#[derive(Clone, Debug)]
pub struct Domain {
    instance: Instance,
    root: PathBuf,
    uid: u32,
    is_operators: bool,
}

impl Domain {
    /// Returns the domain of an instance of the user who runs this process. Accesses nothing on disk except
    /// `/proc/self/status`.
    ///
    /// # Errors
    /// [`DomainError::RootPath`] where the root path is relative, has [`MAX_ROOT_PATH_LEN`] bytes or more, or has
    /// characters that iceoryx2 does not allow. [`DomainError::Io`] where the user id cannot be read.
    pub fn new(instance: Instance) -> Result<Self, DomainError> {
        let uid = effective_uid()?;
        let root = base_directory(std::env::var_os("XDG_RUNTIME_DIR"), uid).join(instance.as_str());
        let path = root.as_os_str().as_encoded_bytes();
        if !root.is_absolute() || path.len() >= MAX_ROOT_PATH_LEN || !path.iter().copied().all(is_allowed) {
            return Err(DomainError::RootPath { root });
        }
        Ok(Self { instance, root, uid, is_operators: false })
    }

    /// Returns the same domain for a tool of the operator. Its readers may use the places that
    /// [`OPERATOR_READERS`](crate::service::OPERATOR_READERS) reserves, so other readers never lock the operator out.
    #[must_use]
    pub fn for_operators(self) -> Self {
        Self { is_operators: true, ..self }
    }

    /// Whether readers may use the places that are reserved for operators.
    pub(crate) fn is_operators(&self) -> bool {
        self.is_operators
    }

    /// The instance's name.
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// The root path.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Prefix of all names of the domain in shared memory.
    pub fn prefix(&self) -> String {
        format!("bd_{}_{}_", self.uid, self.instance)
    }

    /// User id of the domain's owner.
    pub(crate) fn uid(&self) -> u32 {
        self.uid
    }

    /// Returns the configuration of every iceoryx2 node of this domain. iceoryx2's own removal of dead nodes is disabled:
    /// a member removes them when it joins.
    ///
    /// # Panics
    /// Never: the constructor has checked what iceoryx2 requires of a path and a prefix.
    pub fn iceoryx2_config(&self) -> Config {
        let mut config = Config::default();
        config.global.set_root_path(
            &iceoryx2::prelude::Path::new(self.root_str().as_bytes())
                .expect("the constructor limits the path's length and characters"),
        );
        config.global.prefix =
            FileName::new(self.prefix().as_bytes()).expect("an instance's name has only characters of a file name");
        if let Some(suffix) = self.state_suffix() {
            config.global.node.global_mgmt_suffix =
                FileName::new(suffix.as_bytes()).expect("a number in base 16 has only characters of a file name");
        }
        config.global.node.cleanup_dead_nodes_on_creation = false;
        config.global.node.cleanup_dead_nodes_on_destruction = false;
        config.global.service.cleanup_dead_nodes_on_open = false;
        config
    }

    /// Returns the same configuration as TOML. The `iox2` command and any iceoryx2 client read it as
    /// `config/iceoryx2.toml` in their working folder.
    pub fn iceoryx2_toml(&self) -> String {
        let state_suffix = self.state_suffix().map(|suffix| format!("global-mgmt-suffix = {suffix:?}\n"));
        // `Debug` escapes quotes and backslashes as TOML does.
        format!(
            "[global]\nroot-path = {:?}\nprefix = {:?}\n\n[global.node]\n{}cleanup-dead-nodes-on-creation = false\n\
             cleanup-dead-nodes-on-destruction = false\n\n[global.service]\ncleanup-dead-nodes-on-open = false\n",
            self.root_str(),
            self.prefix(),
            state_suffix.unwrap_or_default()
        )
    }

    /// Suffix of the segment with the state of iceoryx2's unique numbers; `None` before a process has created the domain's
    /// random number.
    fn state_suffix(&self) -> Option<String> {
        secret::read(&self.secret_path()).map(|number| format!(".{number}.global_mgmt"))
    }

    fn secret_path(&self) -> PathBuf {
        self.directories()[0].join("secret")
    }

    /// Creates the domain's random number, if it is missing, and the directory for it.
    ///
    /// # Errors
    /// As [`Domain::create_directory`].
    pub fn create_secret(&self) -> Result<(), DomainError> {
        self.check_runtime_directory()?;
        self.create(self.directories()[0])?;
        let path = self.secret_path();
        secret::ensure(&path).map_err(|error| DomainError::Io { path, error })
    }

    /// Takes a new random number if another user has occupied the name that contains the present one.
    ///
    /// # Errors
    /// [`DomainError::Io`] where shared memory cannot be listed or the number cannot be written.
    pub(crate) fn renew_occupied_secret(&self) -> Result<(), DomainError> {
        let Some(suffix) = self.state_suffix() else { return Ok(()) };
        let is_occupied = named_as_ours(Path::new(SHARED_MEMORY), self)?.iter().any(|entry| {
            let is_state = entry.file_name().to_str().is_some_and(|name| name.ends_with(&suffix));
            is_state && foreign_owner(&entry.path(), self).is_some()
        });
        let path = self.secret_path();
        if is_occupied { secret::renew(&path).map_err(|error| DomainError::Io { path, error }) } else { Ok(()) }
    }

    /// Path of the domain's iceoryx2 configuration file, which exists while a process is in the domain.
    pub(crate) fn iceoryx2_toml_path(&self) -> PathBuf {
        self.root.join("iceoryx2.toml")
    }

    /// Path of the lock file of a part of which there is one: `source`, `show` or `guard`.
    pub(super) fn lock_path(&self, part: &str) -> PathBuf {
        self.root.join(format!("{part}.lock"))
    }

    /// Makes this domain's configuration the fallback of iceoryx2 in this process. iceoryx2 uses the fallback where it
    /// cannot read the details of a killed node; without it, iceoryx2 would search another domain for the node's files.
    pub(crate) fn set_fallback_configuration(&self) -> io::Result<()> {
        /// Threads of one process may join at once.
        static DRAFTS: AtomicU64 = AtomicU64::new(0);
        let path = self.iceoryx2_toml_path();
        // The name has the domain's prefix, so a draft that a killed process leaves is removed with the domain.
        let number = DRAFTS.fetch_add(1, Ordering::Relaxed);
        let draft = self.root.join(format!("{}{}-{number}.draft", self.prefix(), std::process::id()));
        fs::write(&draft, self.iceoryx2_toml())?;
        fs::rename(&draft, &path)?;
        let path = FilePath::new(path.as_os_str().as_encoded_bytes()).expect("the root path is of limited length");
        // A configuration of another domain may already be set in this process.
        let _ = Config::setup_global_config_from_file(&path);
        Ok(())
    }

    /// Creates the directory, if it is missing, with mode 0700 regardless of the umask, and checks it. Nothing is created
    /// in a directory that other users own or may write.
    ///
    /// # Errors
    /// As [`Domain::check_directory`]; also [`DomainError::Io`] where the directory cannot be created.
    pub fn create_directory(&self) -> Result<(), DomainError> {
        self.create_secret()?;
        self.create(&self.root)
    }

    fn create(&self, directory: &Path) -> Result<(), DomainError> {
        match make_for_its_user(directory) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => {
                Err(DomainError::Io { path: directory.to_owned(), error })
            }
            _ => self.check(directory),
        }
    }

    /// Checks that this user owns the directory and that other users may not write into it.
    ///
    /// # Errors
    /// [`DomainError::RuntimeDirectory`], [`DomainError::Missing`], [`DomainError::NotADirectory`],
    /// [`DomainError::ForeignOwner`], [`DomainError::WritableByOthers`], [`DomainError::PermissionDenied`] or
    /// [`DomainError::Io`], each with the path in question.
    pub fn check_directory(&self) -> Result<(), DomainError> {
        self.check_runtime_directory()?;
        self.directories().into_iter().try_for_each(|path| self.check(path))
    }

    fn check(&self, path: &Path) -> Result<(), DomainError> {
        let metadata = fs::symlink_metadata(path).map_err(|error| DomainError::of(path.to_owned(), error))?;
        check_metadata(path, &metadata, self.uid)
    }

    /// Checks the parent of the domain's directories. It must exist. Other users may write into it only if it is sticky
    /// like `/tmp`, so that they cannot remove foreign files.
    fn check_runtime_directory(&self) -> Result<(), DomainError> {
        const STICKY: u32 = 0o1000;
        let path = self.directories()[0].parent().expect("the root path has two levels of ours");
        match fs::metadata(path) {
            Ok(metadata) if !metadata.is_dir() => Err(DomainError::NotADirectory { path: path.to_owned() }),
            Ok(metadata) if metadata.mode() & 0o022 != 0 && metadata.mode() & STICKY == 0 => {
                Err(DomainError::WritableByOthers { path: path.to_owned(), mode: metadata.mode() & 0o7777 })
            }
            Ok(_) => Ok(()),
            Err(error) => Err(DomainError::RuntimeDirectory { path: path.to_owned(), error }),
        }
    }

    fn root_str(&self) -> &str {
        self.root.to_str().expect("the constructor accepts only ASCII")
    }

    /// Returns the directories that this user must own, the outer one first.
    fn directories(&self) -> [&Path; 2] {
        [self.root.parent().expect("the root path ends with the instance's name"), &self.root]
    }
}

/// Whether a path may contain this byte. iceoryx2 allows ASCII without control characters and without `<>"|?*`.
fn is_allowed(byte: u8) -> bool {
    matches!(byte, b' '..=b'~') && !b"<>\"|?*".contains(&byte)
}

/// Returns the parent directory of the instances' directories.
fn base_directory(runtime_dir: Option<OsString>, uid: u32) -> PathBuf {
    match runtime_dir {
        Some(directory) if !directory.is_empty() => PathBuf::from(directory).join("bench-dragon"),
        _ => PathBuf::from(format!("/tmp/bench-dragon-{uid}")),
    }
}

/// Creates a directory with mode 0700, regardless of the umask. iceoryx2 sets a strict umask for short moments, and a
/// process that starts in such a moment inherits it.
fn make_for_its_user(path: &Path) -> io::Result<()> {
    const MODE: u32 = 0o700;
    DirBuilder::new().mode(MODE).create(path)?;
    match fs::set_permissions(path, Permissions::from_mode(MODE)) {
        // The last member to leave has just removed it. The check that follows detects that.
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        outcome => outcome,
    }
}

fn check_metadata(path: &Path, metadata: &Metadata, uid: u32) -> Result<(), DomainError> {
    let path = path.to_owned();
    if !metadata.is_dir() {
        return Err(DomainError::NotADirectory { path });
    }
    if metadata.uid() != uid {
        return Err(DomainError::ForeignOwner { path, owner: metadata.uid(), user: uid });
    }
    if metadata.mode() & 0o022 != 0 {
        return Err(DomainError::WritableByOthers { path, mode: metadata.mode() & 0o7777 });
    }
    Ok(())
}

/// Returns the effective user id from the content of `/proc/self/status`. The file's owner is root where a process is not
/// dumpable.
fn effective_uid() -> Result<u32, DomainError> {
    let path = Path::new("/proc/self/status");
    let status = fs::read_to_string(path).map_err(|error| DomainError::Io { path: path.to_owned(), error })?;
    status
        .lines()
        .find_map(|line| line.strip_prefix("Uid:")?.split_whitespace().nth(1)?.parse().ok())
        .ok_or_else(|| DomainError::Io { path: path.to_owned(), error: io::Error::other("it has no Uid line") })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_characters_or_lengths_are_refused() {
        for name in ["", "Dragon", "a b", "a/b", "..", "drag\u{f6}n", &"a".repeat(25)] {
            let error = Instance::new(name).expect_err(name).to_string();
            assert!(error.ends_with("must be 1 to 24 of a-z, 0-9 and -"), "{error}");
        }
        assert_eq!(Instance::new(&"a".repeat(24)).expect("24 characters are allowed").as_str().len(), 24);
    }

    #[test]
    fn base_directory_follows_the_runtime_directory() {
        let under_tmp = PathBuf::from("/tmp/bench-dragon-7");
        assert_eq!(base_directory(Some("/run/user/7".into()), 7), PathBuf::from("/run/user/7/bench-dragon"));
        assert_eq!(base_directory(Some(OsString::new()), 7), under_tmp);
        assert_eq!(base_directory(None, 7), under_tmp);
    }

    #[test]
    fn printed_toml_and_configuration_agree() {
        let domain = Domain::new(Instance::default()).expect("the default instance has a domain");
        domain.create_secret().expect("the directory of the instances is usable");
        let config = domain.iceoryx2_config();
        let toml = domain.iceoryx2_toml();
        assert!(toml.contains(&format!("root-path = \"{}\"", config.global.root_path())), "{toml}");
        assert!(toml.contains(&format!("prefix = \"{}\"", config.global.prefix)), "{toml}");
        assert!(
            toml.contains(&format!("global-mgmt-suffix = \"{}\"", config.global.node.global_mgmt_suffix)),
            "{toml}"
        );
    }
}

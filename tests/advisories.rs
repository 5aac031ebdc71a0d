//! The lock files name no version that an advisory of `advisories.toml` affects. The check needs no network.

use std::fs;
use std::path::Path;

use semver::{Comparator, Version, VersionReq};
use serde::Deserialize;
use serde::de::DeserializeOwned;

const LOCK_FILES: [&str; 2] = ["Cargo.lock", "fuzz/Cargo.lock"];

/// Part of a version that is higher than those of all published ones.
const HIGH: u64 = u16::MAX as u64;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    date: toml::value::Datetime,
    advisory: Vec<Advisory>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Advisory {
    package: String,
    id: String,
    title: String,
    patched: Vec<VersionReq>,
    #[serde(default)]
    unaffected: Vec<VersionReq>,
    /// Why the project uses an affected version.
    accepted: Option<String>,
}

impl Advisory {
    fn affects(&self, package: &Package) -> bool {
        // A package without a source is one of this workspace.
        package.source.is_some() && package.name == self.package && self.affects_version(&package.version)
    }

    fn affects_version(&self, version: &Version) -> bool {
        !self.patched.iter().chain(&self.unaffected).any(|safe| safe.matches(version))
    }

    fn fault(&self, package: &Package) -> String {
        let patched: Vec<String> = self.patched.iter().map(ToString::to_string).collect();
        let patched = if patched.is_empty() { "none".to_owned() } else { patched.join(" or ") };
        format!("{} {}: {} ({}), patched versions: {patched}", package.name, package.version, self.id, self.title)
    }
}

#[derive(Deserialize)]
struct Lock {
    package: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    version: Version,
    source: Option<String>,
}

fn read<T: DeserializeOwned>(file: &str) -> T {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("the file can be read");
    toml::from_str(&text).unwrap_or_else(|error| panic!("{file}: {error}"))
}

fn list() -> List {
    read("tests/advisories.toml")
}

/// Returns a line for each package that an advisory affects, unless the advisory is accepted.
fn faults(lock: &Lock, advisories: &[Advisory]) -> Vec<String> {
    let open = advisories.iter().filter(|advisory| advisory.accepted.is_none());
    open.flat_map(|advisory| {
        let affected = lock.package.iter().filter(|package| advisory.affects(package));
        affected.map(|package| advisory.fault(package))
    })
    .collect()
}

#[test]
fn no_locked_package_has_a_known_advisory() {
    let list = list();
    for file in LOCK_FILES {
        let faults = faults(&read(file), &list.advisory);
        assert!(faults.is_empty(), "{file}, by the list of {}:\n{}", list.date, faults.join("\n"));
    }
}

#[test]
fn an_affected_version_is_reported_with_its_patched_versions() {
    let advisories = list().advisory;
    let faults = |name: &str, version: &str| {
        let source = r#"source = "registry+https://github.com/rust-lang/crates.io-index""#;
        let text = format!("version = 4\n[[package]]\nname = \"{name}\"\nversion = \"{version}\"\n{source}\n");
        faults(&toml::from_str(&text).expect("a lock file"), &advisories)
    };
    let fault = "RUSTSEC-2026-0041 (Decompressing invalid data discloses memory), patched versions: >=0.11.6, <0.12.0 or >=0.12.1";
    assert_eq!(faults("lz4_flex", "0.10.0"), [format!("lz4_flex 0.10.0: {fault}")]);
    assert_eq!(faults("lz4_flex", "0.12.0"), [format!("lz4_flex 0.12.0: {fault}")]);
    assert_eq!(faults("lz4_flex", "0.11.6"), [""; 0]);
    assert_eq!(faults("lz4_flex", "0.12.1"), [""; 0]);
    assert_eq!(faults("owned-alloc", "0.2.0").len(), 2, "no version is patched");
    assert_eq!(faults("pyo3", "0.28.1").len(), 3, "each advisory has a line");
    assert_eq!(faults("ring", "0.17.14"), [""; 0], "its newest versions are unaffected");
    assert_eq!(faults("arrayref", "0.3.10").len(), 1, "its older versions are unaffected");
}

#[test]
fn each_advisory_finds_a_version() {
    for advisory in list().advisory {
        let before_patches = advisory.patched.iter().flat_map(|safe| &safe.comparators).map(version_before);
        let extremes = [Version::new(0, 0, 1), Version::new(HIGH, HIGH, HIGH)];
        let found = before_patches.chain(extremes).any(|version| advisory.affects_version(&version));
        assert!(found, "{} of {} affects no version", advisory.id, advisory.package);
    }
}

#[test]
fn an_advisory_is_accepted_only_for_a_locked_package_without_a_patch() {
    let locks: Vec<Lock> = LOCK_FILES.into_iter().map(read).collect();
    for advisory in list().advisory.iter().filter(|advisory| advisory.accepted.is_some()) {
        let affects = locks.iter().flat_map(|lock| &lock.package).any(|package| advisory.affects(package));
        assert!(affects, "{} affects no locked version of {}", advisory.id, advisory.package);
        assert!(advisory.patched.is_empty(), "{} has a patched version of {}", advisory.id, advisory.package);
    }
}

/// Returns a version just below that of a comparator.
fn version_before(comparator: &Comparator) -> Version {
    match (comparator.major, comparator.minor.unwrap_or(0), comparator.patch.unwrap_or(0)) {
        (0, 0, 0) => Version::new(0, 0, 0),
        (major, 0, 0) => Version::new(major - 1, HIGH, HIGH),
        (major, minor, 0) => Version::new(major, minor - 1, HIGH),
        (major, minor, patch) => Version::new(major, minor, patch - 1),
    }
}

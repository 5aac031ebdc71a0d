//! The checked-in header is the one that cbindgen generates from the sources.

use std::collections::BTreeSet;
use std::path::Path;
use std::{env, fs};

/// Environment variable. If it is set, the test writes the header.
const WRITE: &str = "BENCH_DRAGON_WRITE_HEADER";
/// Source files in the order of the header. Each function is in the file of its types.
const SOURCES: [&str; 11] = [
    "result",
    "show",
    "frames",
    "frame",
    "bench",
    "continuity",
    "description",
    "status",
    "alert",
    "command",
    "command_event",
];

#[test]
fn every_public_module_is_in_the_header() {
    let root = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).expect("src/lib.rs exists");
    let public: BTreeSet<&str> =
        root.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    assert_eq!(BTreeSet::from(SOURCES), public);
}

#[test]
fn the_checked_in_header_is_the_generated_one() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(package.join("cbindgen.toml")).expect("cbindgen.toml is a configuration");
    let builder = SOURCES.iter().fold(cbindgen::Builder::new().with_config(config), |builder, source| {
        builder.with_src(package.join(format!("src/{source}.rs")))
    });
    let mut generated = Vec::new();
    builder.generate().expect("cbindgen reads the sources").write(&mut generated);
    let generated = String::from_utf8(generated).expect("a header is text");

    let path = package.join("include/bench_dragon.h");
    if env::var_os(WRITE).is_some() {
        fs::write(&path, &generated).expect("the header can be written");
    }
    let checked_in = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        checked_in == generated,
        "{} is stale: regenerate it with `{WRITE}=1 cargo test --package bench-dragon-c --test header`",
        path.display()
    );
}

//! The header that is checked in is the one that cbindgen makes of the sources.

use std::collections::BTreeSet;
use std::path::Path;
use std::{env, fs};

/// Set, it lets the test write the header instead of looking at it.
const WRITE: &str = "BENCH_DRAGON_WRITE_HEADER";
/// In the order in which the header has them. Each function stands beside its types.
const SOURCES: [&str; 10] =
    ["result", "dragon", "frames", "frame", "bench", "continuity", "description", "status", "alert", "command"];

#[test]
fn every_public_module_is_in_the_header() {
    let root = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).expect("it is there");
    let public: BTreeSet<&str> =
        root.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';')).collect();
    assert_eq!(BTreeSet::from(SOURCES), public);
}

#[test]
fn the_header_is_that_of_the_sources() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(package.join("cbindgen.toml")).expect("cbindgen.toml is a configuration");
    let builder = SOURCES.iter().fold(cbindgen::Builder::new().with_config(config), |builder, source| {
        builder.with_src(package.join(format!("src/{source}.rs")))
    });
    let mut generated = Vec::new();
    builder.generate().expect("cbindgen understands the sources").write(&mut generated);
    let generated = String::from_utf8(generated).expect("a header is text");

    let path = package.join("include/bench_dragon.h");
    if env::var_os(WRITE).is_some() {
        fs::write(&path, &generated).expect("the header can be written");
    }
    let checked_in = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        checked_in == generated,
        "{} is stale; this makes it anew: {WRITE}=1 cargo test --package bench-dragon-c --test header",
        path.display()
    );
}

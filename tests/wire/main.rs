//! What a type of the bus is stands once, in `ipc/src/wire/`. Its forms in other languages are generated from there or
//! compared with it: the ROS 2 messages, the Python package, the page's script and the tables of the reference. The test
//! `header` of `ipc/c/` does the same for C.
//!
//! `BENCH_DRAGON_WRITE=1 cargo test --workspace --test wire --test header` writes all generated forms.

mod documents;
mod layouts;
mod page;
mod python;
mod ros;

use std::path::{Path, PathBuf};

/// A path in the repository.
fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn text(path: &str) -> String {
    std::fs::read_to_string(repository(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

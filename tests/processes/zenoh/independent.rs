//! A reader of another author: the stock Python package.

use std::ffi::OsStr;

use test_support::pytest;

use super::bridges::{Bridge, KEY};
use crate::stage::Stage;

#[test]
fn the_stock_zenoh_package_reads_every_frame_and_commands_where_that_is_allowed() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let sender = Bridge::sending(&stage, &["--allow-commands"]);
    let silent = Bridge::sending(&stage, &[]);
    let variables = [
        ("BENCH_DRAGON", OsStr::new(env!("CARGO_BIN_EXE_bench-dragon"))),
        ("BENCH_DRAGON_INSTANCE", OsStr::new(stage.domain().instance().as_str())),
        ("BENCH_DRAGON_ENDPOINT", OsStr::new(&sender.endpoint)),
        ("BENCH_DRAGON_SILENT_ENDPOINT", OsStr::new(&silent.endpoint)),
        ("BENCH_DRAGON_KEY", OsStr::new(KEY)),
    ];
    pytest::run("test_zenoh.py", &variables);
    server.stop();
    let sent = sender.stop();
    assert_eq!((&sent["commands"], &sent["refused"]), (&2.into(), &1.into()), "{sent}");
    silent.stop();
}

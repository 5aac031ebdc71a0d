//! The stock Python packages read the bus with no code of the project except the layouts; their tests are in `tests/python`.
//! The project's own package has its tests in its folder.

use std::ffi::OsStr;

use test_support::pytest::{run, run_at};

use crate::stage::Stage;

#[test]
fn the_stock_iceoryx2_package_reads_the_bus_live() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20", "--time-scale", "2", "--catch-up", "10"]);
    let variables = [
        ("BENCH_DRAGON", OsStr::new(env!("CARGO_BIN_EXE_bench-dragon"))),
        ("BENCH_DRAGON_INSTANCE", OsStr::new(stage.domain().instance().as_str())),
    ];
    run("test_live.py", &variables);
    server.stop();
}

#[test]
fn the_python_package_reads_and_commands_live_servers() {
    run_at("ipc/python/tests", &[("BENCH_DRAGON", OsStr::new(env!("CARGO_BIN_EXE_bench-dragon")))]);
}

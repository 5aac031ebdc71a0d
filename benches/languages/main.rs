//! Compares a woken reader in C with one in Python: from the sending of a frame until the head's position was read, at 1 kHz.
//! Both read the same server, in turns. `BENCH_DRAGON_PYTHON` names a Python that has the package `bench_dragon`; `tests/run`
//! makes one in `target/venv`.

#[path = "../shared/mod.rs"]
mod shared;

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use shared::{Figures, Program, domain, median, quantile};

/// Turns of each reader.
const TURNS: usize = 7;
/// Frames of a turn.
const FRAMES: usize = 2000;
const INSTANCE: &str = "bench-languages";
const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/languages");

fn main() {
    shared::require_no_arguments();
    let readers = [("c", vec![c_reader()]), ("python", vec![python(), Path::new(SOURCES).join("reader.py")])];
    let domain = domain(INSTANCE);
    let _server = Program::start(&domain, &["serve", "--rate", "1000"]);
    let mut all: [Vec<f64>; 2] = Default::default();
    let mut ratios = Vec::new();
    for _ in 0..TURNS {
        let medians = [0, 1].map(|reader| {
            let latencies = latencies_us(&readers[reader].1);
            let p50 = quantile(&latencies, 0.5);
            all[reader].extend(latencies);
            p50
        });
        ratios.push(medians[1] / medians[0]);
    }
    let mut figures = Figures::of("languages");
    for ((name, _), latencies) in readers.iter().zip(&mut all) {
        latencies.sort_by(f64::total_cmp);
        for (percentile, share) in [("p50", 0.5), ("p99", 0.99), ("p999", 0.999)] {
            figures.set(&format!("{name}_woken_sent_{percentile}_us"), quantile(latencies, share));
        }
    }
    ratios.sort_by(f64::total_cmp);
    figures.set("python_vs_c_woken_sent_p50", median(&ratios));
    figures.write();
}

/// Runs a reader. Returns its latencies in microseconds, sorted.
fn latencies_us(reader: &[PathBuf]) -> Vec<f64> {
    let mut command = Command::new(&reader[0]);
    let output = command.args(&reader[1..]).args([INSTANCE, &FRAMES.to_string()]).output().expect("the reader starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{reader:?}: {errors}");
    let text = String::from_utf8(output.stdout).expect("a reader prints numbers");
    let nanoseconds = text.lines().map(|line| line.parse::<f64>().expect("a reader prints numbers"));
    let mut latencies: Vec<f64> = nanoseconds.map(|nanoseconds| nanoseconds * 1e-3).collect();
    assert_eq!(latencies.len(), FRAMES, "a line for each frame");
    latencies.sort_by(f64::total_cmp);
    latencies
}

/// Builds the C library and the reader in C.
fn c_reader() -> PathBuf {
    let root = env!("CARGO_MANIFEST_DIR");
    let prefix = Path::new(env!("CARGO_TARGET_TMPDIR")).join("languages");
    run(Command::new(format!("{root}/ipc/c/install.sh")).arg(&prefix));
    let reader = prefix.join("reader");
    let library = prefix.join("lib/libbench_dragon_c.so");
    let mut compile = Command::new("gcc");
    compile.args(["-O2", "-std=c99", "-Wall", "-Wextra", "-Werror", "-o"]).arg(&reader);
    compile.arg(format!("{SOURCES}/reader.c")).arg(library).arg(format!("-I{}", prefix.join("include").display()));
    run(compile.arg(format!("-Wl,-rpath,{}", prefix.join("lib").display())));
    reader
}

fn python() -> PathBuf {
    let python = env::var_os("BENCH_DRAGON_PYTHON");
    python
        .expect("BENCH_DRAGON_PYTHON names a Python with the package bench_dragon, such as target/venv/bin/python")
        .into()
}

fn run(command: &mut Command) {
    assert!(command.status().expect("the tool is installed").success(), "{command:?} failed");
}

//! The figures of one bench. They are printed at once, and written as one flat JSON object.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde_json::{Map, Value};

/// The figures of one bench.
///
/// A key contains its unit. Values are numbers, strings, or null if a value could not be measured on this machine.
#[derive(Debug)]
pub struct Figures {
    bench: &'static str,
    values: Map<String, Value>,
}

impl Figures {
    /// The figures of the bench of this name. The first ones describe the machine and the date.
    pub fn of(bench: &'static str) -> Self {
        let mut figures = Self { bench, values: Map::new() };
        figures.set("cpu", cpu_model());
        figures.set("cores", std::thread::available_parallelism().map_or(0, usize::from));
        figures.set("kernel", fs::read_to_string("/proc/sys/kernel/osrelease").unwrap_or_default().trim());
        figures.set("measured_unix_s", SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs()));
        figures
    }

    /// Prints one figure and stores it for the file.
    pub fn set(&mut self, key: &str, value: impl Into<Value>) {
        let value = rounded(value.into());
        println!("{key:<44} {value}");
        self.values.insert(key.to_owned(), value);
    }

    /// Writes `bench/NAME.json` in cargo's target folder.
    pub fn write(self) {
        let path = target_folder().join("bench").join(format!("{}.json", self.bench));
        fs::create_dir_all(path.parent().expect("the file is in a folder")).expect("cargo's target folder is writable");
        let mut text = serde_json::to_string_pretty(&self.values).expect("a flat map is valid JSON");
        text.push('\n');
        fs::write(&path, text).expect("cargo's target folder is writable");
        println!("written to {}", path.display());
    }
}

/// Rounds a number to six significant digits, more than the accuracy of any clock here.
fn rounded(value: Value) -> Value {
    match value.as_f64() {
        Some(number) if value.is_f64() => format!("{number:.5e}").parse::<f64>().map_or(Value::Null, Value::from),
        _ => value,
    }
}

/// Cargo's target folder, by default or from `CARGO_TARGET_DIR`.
fn target_folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the folder for tests is in the target folder").to_owned()
}

/// Name of the processor from the kernel.
fn cpu_model() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or(": unknown");
    line.trim_start_matches([' ', '\t', ':']).to_owned()
}

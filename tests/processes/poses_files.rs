//! The files that `solve poses` writes: a workbook that a stock reader opens, and that is either complete or absent.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use test_support::process::{Ended, Process};
use test_support::pytest;

use crate::stage::program;

fn solve_poses(args: &[&str], folder: &Path) -> Ended {
    let mut command = program(&[&["solve", "poses"], args].concat());
    command.current_dir(folder);
    Process::start(command).end()
}

#[test]
fn openpyxl_reads_the_workbook_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let paper = ["--from", "0", "--to", "300", "--xlsx", "poses.xlsx", "--format", "json"];
    let ended = solve_poses(&paper, folder.path()).expect_clean();
    let (xlsx, json) = (folder.path().join("poses.xlsx"), folder.path().join("poses.json"));
    fs::write(&json, ended.stdout).expect("a file");
    pytest::run("test_poses.py", &[("POSES_XLSX", xlsx.as_os_str()), ("POSES_JSON", json.as_os_str())]);
}

#[test]
fn a_workbook_replaces_an_old_file_and_leaves_no_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("poses.xlsx");
    fs::write(&path, "something old").expect("a file");
    let ended = solve_poses(&["--at", "0,60", "--xlsx", "poses.xlsx"], folder.path()).expect_clean();
    assert_eq!(ended.stdout, "positions and speeds of 224 handles at 2 times written to poses.xlsx\n");
    assert!(fs::read(&path).expect("it is there").starts_with(b"PK"));
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
}

#[test]
fn a_workbook_that_cannot_be_written_is_reported_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("folder.xlsx")).expect("a folder");
    std::os::unix::fs::symlink("/dev/full", folder.path().join("full.xlsx")).expect("a link");
    for (file, why) in [
        ("none/poses.xlsx", "No such file or directory"),
        ("folder.xlsx", "Is a directory"),
        ("full.xlsx", "No space left on device"),
    ] {
        let ended = solve_poses(&["--at", "0", "--xlsx", file], folder.path());
        let start = format!("error: cannot write {file}: {why}");
        assert_eq!((ended.code(), ended.stdout.as_str()), (Some(1), ""), "{}", ended.stderr);
        assert!(ended.stderr.starts_with(&start) && ended.stderr.lines().count() == 1, "{}", ended.stderr);
    }
    let mut left: Vec<_> =
        fs::read_dir(folder.path()).expect("a folder").flatten().map(|entry| entry.file_name()).collect();
    left.sort();
    assert_eq!(left, [OsStr::new("folder.xlsx"), OsStr::new("full.xlsx")]);
}

#[test]
fn comma_separated_values_have_a_row_for_every_handle_at_every_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let steps = ["--from", "0.1", "--to", "0.4", "--step", "0.1"];
    let ended = solve_poses(&[&steps[..], &["--format", "csv"]].concat(), folder.path()).expect_clean();
    let json = solve_poses(&[&steps[..], &["--format", "json"]].concat(), folder.path()).expect_clean().last_json();
    let mut lines = ended.stdout.lines();
    assert_eq!(lines.next(), Some("time_s,handle,x_m,y_m,speed_mps"));
    let poses = json["poses"].as_array().expect("an array of poses");
    let times: Vec<_> = poses.iter().map(|pose| pose["time_s"].to_string()).collect();
    assert_eq!(times, ["0.1", "0.2", "0.3", "0.4"]);
    for pose in poses {
        for handle in pose["handles"].as_array().expect("an array of handles") {
            let keys = [&pose["time_s"], &handle["index"], &handle["x_m"], &handle["y_m"], &handle["speed_mps"]];
            let expected: Vec<f64> = keys.iter().map(|value| value.as_f64().expect("a number")).collect();
            let cells = lines.next().expect("a line for each handle").split(',');
            let values: Vec<f64> = cells.map(|cell| cell.parse().expect("a number")).collect();
            assert_eq!(values, expected);
        }
    }
    assert_eq!(lines.next(), None);
}

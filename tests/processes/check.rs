//! `solve check`: tables of other programs are compared with the exact poses, known mistakes get their names, and what is no table is
//! refused in one line.

use std::ffi::OsStr;
use std::fs;

use test_support::process::Process;
use test_support::pytest;

use crate::stage::{Stage, program};

#[test]
fn tables_of_scipy_are_right_and_their_mistakes_have_names() {
    pytest::run("test_check.py", &[("BENCH_DRAGON", OsStr::new(env!("CARGO_BIN_EXE_bench-dragon")))]);
}

#[test]
fn what_is_no_table_is_refused_in_one_line() {
    let stage = Stage::new();
    for (file, text, expected) in [
        ("none.csv", None, "none.csv cannot be read: No such file or directory (os error 2)\n"),
        ("poses.txt", Some("1,2"), "poses.txt must end in .xlsx or .csv"),
        ("empty.csv", Some("a,b\n1,2\n"), "empty.csv has no table"),
        ("broken.xlsx", Some("not a workbook"), "broken.xlsx is no workbook"),
        (
            "label.csv",
            Some(",0 s\n第222节龙身x (m),1\n"),
            "label.csv line 2: \"第222节龙身x (m)\" is no handle, must be 龙头",
        ),
        ("word.csv", Some(",0 s\n龙头x (m),eight\n"), "word.csv line 2: \"eight\" in column 2 is no number"),
        ("twice.csv", Some(",0 s\n龙头x (m),1\n龙头x (m),1\n"), "twice.csv line 3: has a number twice"),
        ("late.csv", Some(",900 s\n龙头x (m),1\n"), "late.csv has 900 s, must be from 0 to 432.758"),
        ("handle.csv", Some("time_s,handle,x_m,y_m\n0,224,1,2\n"), "handle.csv line 2: handle must be from 0 to 223"),
    ] {
        if let Some(text) = text {
            fs::write(stage.path(file), text).expect("the folder is writable");
        }
        let mut command = program(&["solve", "check", file]);
        command.current_dir(stage.path(""));
        let ended = Process::start(command).end();
        assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""), "{file}: {}", ended.stderr);
        assert!(ended.stderr.starts_with(&format!("error: {expected}")), "{}", ended.stderr);
        assert_eq!(ended.stderr.lines().count(), 1, "{}", ended.stderr);
    }
}

#[test]
fn the_text_says_how_many_are_right_and_which_mistake_is_made() {
    let stage = Stage::new();
    fs::write(stage.path("some.csv"), ",0 s\n龙头x (m),8.8\n龙头y (m),0.001\n龙头 (m/s),1\n")
        .expect("the folder is writable");
    let mut command = program(&["solve", "check", "some.csv"]);
    command.current_dir(stage.path(""));
    let ended = Process::start(command).end().expect_clean();
    assert_eq!(
        ended.stdout,
        "some.csv beside the paper's dragon: 224 handles, 1 time\n\
         positions   1 of 2 are right to 6 decimals, 1 to 3; largest difference 0.001000000 m at 0 s, handle 0 (龙头), y_m: \
         0.001000, exact 0.000000\n\
         speeds      1 of 1 are right to 6 decimals; largest difference 0.000000000 m/s at 0 s, handle 0 (龙头), speed_mps: \
         1.000000, exact 1.000000\n\
         verdict     wrong, by no known mistake\n"
    );
}

/// 0.2 µs from the exact contact, the handles' last decimals differ.
#[test]
fn exact_poses_of_the_time_that_a_table_states_are_right_beside_the_contact() {
    let stage = Stage::new();
    for at in ["412.473838", "412.473837", "412.47384"] {
        let mut solve = program(&["solve", "poses", "--at", at, "--contest", "near.xlsx"]);
        solve.current_dir(stage.path(""));
        Process::start(solve).end().expect_clean();
        let mut check = program(&["solve", "check", "near.xlsx"]);
        check.current_dir(stage.path(""));
        let ended = Process::start(check).end().expect_clean();
        assert!(ended.stdout.ends_with("verdict     right\n"), "{at}: {}", ended.stdout);
    }
}

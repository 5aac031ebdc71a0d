//! Bad input: one line on stderr with the input and the allowed values, exit status 2, and no trace on the bus.

use std::fs;

use test_support::process::{Ended, Process};

use crate::stage::{Stage, program};

/// Fails unless there is exactly one line of error that contains each of these texts once.
pub(crate) fn assert_one_error(ended: &Ended, code: i32, named: &[&str]) {
    let Ended { stdout, stderr, .. } = ended;
    assert_eq!((ended.code(), stdout.as_str()), (Some(code), ""), "{named:?}: {stderr}");
    assert!(stderr.starts_with("error: ") && stderr.ends_with('\n') && stderr.lines().count() == 1, "{stderr:?}");
    for name in named {
        assert_eq!(stderr.matches(name).count(), 1, "{name:?} in {stderr}");
    }
    assert!(!stderr.contains("panick") && !stderr.contains("RUST_BACKTRACE"), "{stderr}");
}

#[test]
fn bad_arguments_are_named_with_what_is_allowed() {
    let stage = Stage::new();
    fs::write(stage.path("file"), "no folder").expect("a file");
    let cases: &[(&[&str], &[&str])] = &[
        (&["dance"], &["unrecognized subcommand 'dance'"]),
        (&["serve", "--quick"], &["unexpected argument '--quick'"]),
        (&["serve", "--rate", "0"], &["--rate", "'0'", "from 1 to 100000"]),
        (&["serve", "--rate", "10000000"], &["--rate", "'10000000'", "from 1 to 100000"]),
        (&["serve", "--rate", "fast"], &["--rate", "'fast'"]),
        (&["serve", "--time-scale", "nan"], &["--time-scale", "'nan'", "from 0.001 to 1000"]),
        (&["serve", "--time-scale", "0"], &["--time-scale", "'0'", "from 0.001 to 1000"]),
        (&["serve", "--start-at", "inf"], &["--start-at", "'inf'", "a finite number"]),
        (&["serve", "--start-at", "432.76"], &["--start-at is 432.76, must be from 0 to 432.758"]),
        (&["serve", "--start-at", "-1"], &["--start-at is -1, must be from 0 to 432.758"]),
        (&["serve", "--start-at", "9", "--until", "8"], &["--until is 8, must be from 9 to 432.758"]),
        (&["serve", "--readers", "1000"], &["--readers", "'1000'", "from 0 to 24"]),
        (&["serve", "--parent", "1"], &["--parent is 1, must be the parent process"]),
        (&["serve", "--cpu", "1024"], &["--cpu", "'1024'", "must be from 0 to 1023"]),
        (&["serve", "--cpu", "-1"], &["--cpu", "'-1'", "must be from 0 to 1023"]),
        (&["serve", "--priority", "fifo:100"], &["--priority", "'fifo:100'", "other, fifo:N or rr:N, N from 1 to 99"]),
        (&["show", "--spin-us", "1001"], &["--spin-us", "'1001'", "must be from 0 to 1000"]),
        (&["show", "--start-at", "500"], &["--start-at is 500, must be from 0 to 432.758"]),
        (&["show", "--out", "file"], &["--out is file, must be a folder that can be created"]),
        (&["monitor", "--progress", "0"], &["--progress", "'0'", "from 0.01 to 3600"]),
        (&["record"], &["<FILE>"]),
        (&["record", "a.mcap", "--rotate-mb", "0"], &["--rotate-mb", "'0'", "from 1 to 1000000"]),
        (&["record", "--repair", "a.mcap", "--rotate-mb", "5"], &["--repair", "--rotate-mb"]),
        (&["record", "--check", "a.mcap"], &["--repair"]),
        (&["replay"], &["<FILE|FOLDER>"]),
        (&["replay", "a.mcap", "--readers", "25"], &["--readers", "'25'", "from 0 to 24"]),
        (&["ctl", "speed"], &["<MPS>"]),
        (&["ctl", "speed", "quick"], &["<MPS>", "'quick'"]),
        (&["ctl", "dance"], &["unrecognized subcommand 'dance'"]),
        (&["echo", "--count", "-1"], &["--count", "'-1'", "must be from 1 to"]),
        (&["echo", "--count", "0"], &["--count", "'0'", "must be from 1 to"]),
        (&["ctl", "speed", "11"], &["<MPS>", "'11'", "must be from 0 to 10"]),
        (
            &["record", "a.mcap", "--rotate-mb", "100", "--max-total-mb", "50"],
            &["--max-total-mb is 50", "--rotate-mb, which is 100"],
        ),
        (&["bridge", "osc", "--listen", "127.0.0.1:7400"], &["--allow <LIST>"]),
        (&["bridge", "osc", "--allow", "10.0.0.7"], &["--listen <ADDRESS:PORT>"]),
        (&["bridge", "osc", "--full"], &["--listen <ADDRESS:PORT>"]),
        (
            &["bridge", "osc", "--listen", "127.0.0.1:7400", "--allow", "10.0.0.7/24"],
            &["--allow", "'10.0.0.7/24'", "must be 10.0.0.0/24 for the network, or 10.0.0.7 for the machine"],
        ),
        (
            &["bridge", "osc", "--listen", "127.0.0.1:7400", "--allow", "house"],
            &["--allow", "'house'", "must be an address or a network, such as 10.0.0.7, 10.0.0.0/24 or fd00::/8"],
        ),
        (
            &["bridge", "osc", "--listen", "127.0.0.1:7400", "--allow", "::1", "--secret", "short"],
            &["--secret", "'short'", "must be 8 to 64 letters, digits, - and _"],
        ),
        (&["echo", "--format", "yaml"], &["--format", "'yaml'", "text, json"]),
        (&["hz", "--seconds", "x"], &["--seconds", "'x'"]),
        (&["latency", "--seconds", "0"], &["--seconds", "'0'", "must be from 0.01 to 1000000"]),
        (&["latency", "--seconds", "nan"], &["--seconds", "'nan'", "must be from 0.01 to 1000000"]),
        (&["latency", "--hgrm"], &["--hgrm <FILE>"]),
    ];
    for (args, named) in cases {
        assert_one_error(&stage.run(args), 2, named);
    }
}

#[test]
fn bad_questions_to_the_planner_are_named_with_what_is_allowed() {
    let cases: &[(&[&str], &[&str])] = &[
        (&["solve", "poses"], &["--at"]),
        (&["solve", "poses", "--at", "0,432.76"], &["--at is 432.76, must be from 0 to 432.758"]),
        (&["solve", "poses", "--at", "-1"], &["--at is -1, must be from 0 to 432.758"]),
        (&["solve", "poses", "--at", "nan"], &["--at", "'nan'", "a finite number"]),
        (&["solve", "poses", "--from", "0"], &["--to"]),
        (&["solve", "poses", "--at", "1", "--to", "2"], &["--at", "cannot be used with", "--to"]),
        (&["solve", "poses", "--at", "1", "--step", "2"], &["--at", "cannot be used with", "--step"]),
        (&["solve", "poses", "--from", "9", "--to", "8"], &["--to is 8, must be at least --from, which is 9"]),
        (&["solve", "poses", "--from", "0", "--to", "433"], &["--to is 433, must be from 0 to 432.758"]),
        (&["solve", "poses", "--from", "0", "--to", "9", "--step", "0"], &["--step", "'0'", "must be above 0"]),
        (&["solve", "poses", "--from", "1e-10", "--to", "9"], &["--from", "'1e-10'", "with at most nine decimals"]),
        (
            &["solve", "poses", "--from", "0", "--to", "300", "--step", "0.01"],
            &["--step is 0.01, which makes 30001 times from 0 to 300, must make at most 4464"],
        ),
        (&["solve", "poses", "--at", "1", "--xlsx", "a.csv"], &["--xlsx", "'a.csv'", "must end in .xlsx"]),
        (&["solve", "poses", "--at", "1", "--format", "yaml"], &["--format", "'yaml'", "text, json, csv"]),
        (&["solve", "why"], &["unrecognized subcommand 'why'"]),
    ];
    for (args, named) in cases {
        assert_one_error(&Process::start(program(args)).end(), 2, named);
    }
}

#[test]
fn bad_names_of_instances_are_named_with_what_is_allowed() {
    for name in ["", "Dragon", "a_b", "a/b", "..", "aaaaaaaaaaaaaaaaaaaaaaaaa"] {
        let command = program(&["ctl", "pause", "--instance", name]);
        let ended = Process::start(command).end();
        assert_one_error(&ended, 2, &["--instance", &format!("'{name}'"), "1 to 24 of a-z, 0-9 and -"]);
    }
}

#[test]
fn bad_configurations_are_named_by_key_value_and_what_is_allowed() {
    let stage = Stage::new();
    let cases: &[(&str, &[&str])] = &[
        ("[dragon]\nbenches = 0", &["[dragon] benches is 0, must be from 1 to"]),
        ("[dragon]\nbenches = 99999999999", &["[dragon] benches is 99999999999, must be from 1 to"]),
        ("[dragon]\nhole_offset_m = 1.1", &["[dragon] hole_offset_m is 1.1, must be at least 0 and under 1.1"]),
        ("[dragon]\nhole_offset_m = -0.1", &["[dragon] hole_offset_m is -0.1, must be at least 0"]),
        ("[dragon]\nwidth_m = nan", &["[dragon] width_m is NaN, must be from 0.01 to 100"]),
        ("[dragon]\nbody_length_m = 0", &["[dragon] body_length_m is 0, must be from 0.02 to 100"]),
        ("[dragon]\nhead_length_m = inf", &["[dragon] head_length_m is inf, must be"]),
        ("[dragon]\nlegs = 4", &["line 2, `legs = 4`: unknown field `legs`, expected one of `benches`"]),
        ("[route]\npitch_m = 0.2", &["pitch_m is 0.2, must be above width_m 0.3"]),
        ("[route]\npitch_m = nan", &["[route] pitch_m is NaN, must be"]),
        ("[route]\nstart_turns = -1.0", &["[route] start_turns is -1, must be"]),
        (
            "[route]\nkind = \"ring\"",
            &["line 2, `kind = \"ring\"`: unknown variant `ring`, expected one of `spiral`, `turnaround`"],
        ),
        ("[head]\nspeed_mps = 0.0", &["[head] speed_mps is 0, must be from 0.001 to 10"]),
        ("[serve]\nrate_hz = 0", &["[serve] rate_hz is 0, must be from 1 to 100000"]),
        ("[serve]\nrate_hz = 10000000", &["[serve] rate_hz is 10000000, must be from 1 to 100000"]),
        ("[serve]\nrate_hz = \"fast\"", &["invalid type: string \"fast\", expected a whole number"]),
        ("[serve]\ntime_scale = nan", &["[serve] time_scale is NaN, must be from 0.001 to 1000"]),
        ("[serve]\ncpu = 1024", &["[serve] cpu is 1024, must be from 0 to 1023"]),
        ("[serve]\npriority = \"high\"", &["priority is \"high\", must be other, fifo:N or rr:N"]),
        ("[serve]\nspin_us = -1", &["line 2, `spin_us = -1`: "]),
        ("[monitor]\nnear_m = -1.0", &["[monitor] near_m is -1, must be from 0 to 10"]),
        ("[lights]\n", &["line 1, `[lights]`: unknown field `lights`, expected one of"]),
        ("benches", &["line 1, `benches`: "]),
    ];
    for (text, named) in cases {
        fs::write(stage.path("stage.toml"), text).expect("a file");
        assert_one_error(&stage.run(&["serve", "--config", "stage.toml"]), 2, named);
    }
}

#[test]
fn files_that_are_missing_or_of_another_kind_are_named() {
    let stage = Stage::new();
    fs::write(stage.path("letter"), "not a recording").expect("a file");
    let cases: &[(&[&str], i32, &[&str])] = &[
        (&["serve", "--config", "none.toml"], 2, &["none.toml: cannot be read: No such file"]),
        (&["show", "--config", "none.toml"], 2, &["none.toml: cannot be read: No such file"]),
        (&["record", "--repair", "none.mcap"], 2, &["cannot read none.mcap: No such file"]),
        (&["record", "--repair", "letter"], 2, &["letter is not a recording of a bench dragon"]),
        (&["record", "none/a.mcap"], 2, &["cannot create none/a.mcap: No such file"]),
        (&["record", "letter"], 2, &["letter already exists and is not overwritten"]),
    ];
    for (args, code, named) in cases {
        assert_one_error(&stage.run(args), *code, named);
    }
    assert_eq!(fs::read(stage.path("letter")).expect("the file still exists"), b"not a recording");
}

#[test]
fn a_command_without_a_server_reports_how_to_start_one() {
    let stage = Stage::new();
    let instance = stage.domain().instance();
    let expected = format!(
        "no server runs on instance \"{instance}\": start the show, or by hand \
         `bench-dragon serve --config FILE --held --instance {instance}`"
    );
    for order in [&["pause"][..], &["resume"], &["speed", "1"], &["seek", "0"], &["hold"], &["release"], &["stop"]] {
        assert_one_error(&stage.run(&[&["ctl"], order].concat()), 1, &[&expected]);
    }
}

#[test]
fn a_call_without_a_subcommand_prints_the_help() {
    let ended = Process::start(program::<&str>(&[])).end();
    assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""));
    assert!(ended.stderr.contains("Usage: bench-dragon <SUBCOMMAND>"), "{}", ended.stderr);
}

#[test]
fn every_subcommand_has_help_with_an_example() {
    for command in [
        "show",
        "serve",
        "monitor",
        "record",
        "replay",
        "ctl",
        "echo",
        "hz",
        "latency",
        "solve",
        "doctor",
        "iox2-config",
    ] {
        let help = Process::start(program(&[command, "--help"])).end().expect_clean();
        assert!(help.stdout.contains("Example"), "{command}");
    }
}

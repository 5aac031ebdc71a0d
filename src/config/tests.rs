//! The text of a configuration, and its errors.

use bench_dragon_geometry::route::TurnaroundSpec;

use super::*;

fn error_of(text: &str) -> String {
    Config::from_toml(text).expect_err(text).to_string()
}

#[test]
fn the_document_without_keys_is_the_papers_dragon() {
    let config = Config::from_toml("").expect("every key has a default");
    assert_eq!(config.lead().dimensions().benches(), 223);
    assert_eq!(
        (config.tables().serve.rate_hz, config.tables().serve.time_scale, config.tables().head.speed_mps),
        (1000, 1.0, 1.0)
    );
    assert_eq!((config.tables().serve.catch_up_s, config.most_jumped()), (0.25, 250));
}

#[test]
fn a_document_is_read_without_a_dragon_on_its_route() {
    let document = ConfigDocument::from_toml("[route]\npitch_m = 0.2").expect("each value is in its range");
    let error = document.build().expect_err("the boards are wider than the pitch").to_string();
    assert!(error.starts_with("pitch_m is 0.2, must be above width_m"), "{error}");
}

#[test]
fn the_written_document_reads_back_the_same() {
    let text = "[route]\npitch_m = 0.6000000000000001\n[serve]\nrate_hz = 250\ncpu = 3\npriority = \"fifo:80\"\nspin_us = 9\ncatch_up_s = 0.5\n";
    let config = Config::from_toml(text).expect("the text is valid");
    let again = Config::from_toml(&config.to_toml()).expect("its own text is valid");
    assert_eq!(again.document.tables, config.document.tables);
}

#[test]
fn the_commands_of_a_show_are_kept_in_their_order() {
    let text = "[[show.also]]\ncommand = \"hz\"\n[[show.also]]\ncommand = \"bridge psn --name 'a b'\"\n";
    let config = Config::from_toml(text).expect("the text is valid");
    assert_eq!(config.also(), ["hz", "bridge psn --name 'a b'"]);
    let again = Config::from_toml(&config.to_toml()).expect("its own text is valid");
    assert_eq!(again.document.tables, config.document.tables);
    assert!(!Config::from_toml("").expect("every key has a default").to_toml().contains("show"));
}

#[test]
fn missing_keys_of_a_turnaround_have_the_papers_values() {
    let config = Config::from_toml("[route]\nkind = \"turnaround\"\nend_s = 60").expect("the text is valid");
    let plan = RouteSpec { end_s: Some(60.0), ..RouteSpec::from(TurnaroundSpec::default()) };
    assert_eq!(config.route(), &plan);
    assert_eq!((config.start_s(), config.end_s()), (-100.0, 60.0));
    let again = Config::from_toml(&config.to_toml()).expect("its own text is valid");
    assert_eq!(again.document.tables, config.document.tables);
}

#[test]
fn flags_override_the_document() {
    let flags = |tables: &mut Document| (tables.serve.rate_hz, tables.serve.time_scale) = (50, 20.0);
    let config = Config::load(None, flags).expect("both are in range");
    assert_eq!((config.tables().serve.rate_hz, config.tables().serve.time_scale), (50, 20.0));
}

#[test]
fn the_jump_limit_is_the_number_of_periods_within_catch_up_s() {
    for (catch_up_s, rate_hz, most) in [(0.0, 1000, 0), (0.25, 50, 12), (0.29, 100, 29), (10.0, 100_000, 1_000_000)] {
        let text = format!("[serve]\nrate_hz = {rate_hz}\ncatch_up_s = {catch_up_s:?}\n");
        assert_eq!(Config::from_toml(&text).expect("a valid text").most_jumped(), most, "{text}");
    }
}

#[test]
fn the_error_of_an_unknown_key_names_the_key_and_its_line() {
    let error = error_of("[route]\npitch_m = 0.55\npitsch = 1\n");
    assert!(error.starts_with("line 3, `pitsch = 1`: unknown field `pitsch`, expected one of"), "{error}");
}

#[test]
fn a_show_runs_a_bounded_number_of_commands() {
    let text = "[[show.also]]\ncommand = \"hz\"\n".repeat(MAX_ALSO + 1);
    assert_eq!(error_of(&text), "[[show.also]] occurs 9 times, at most 8 are allowed");
}

#[test]
fn areas_to_keep_out_of_are_bounded_in_number() {
    let area = "[[0, 0], [1, 0], [0, 1]]";
    let text = |count| format!("[stage]\nkeep_out = [{}]\n", vec![area; count].join(", "));
    assert_eq!(error_of(&text(33)), "[stage] keep_out has 33 areas, at most 32 are allowed");
    let config = Config::from_toml(&text(32)).expect("as many as are allowed");
    assert_eq!(config.stage().keep_out().len(), 32);
    assert_eq!(Config::from_toml(&config.to_toml()).expect("written and read").stage(), config.stage());
}

#[test]
fn a_formation_that_stands_in_the_way_of_its_stage_cannot_start() {
    let text = |stage: &str, guard: bool| format!("[monitor]\nguard = {guard}\n[stage]\n{stage}\n");
    let error = |stage: &str, guard| {
        let config = Config::from_toml(&text(stage, guard)).expect("a valid text");
        config.require_start().map_err(|error| error.to_string())
    };
    let area = "keep_out = [[[50, 0], [51, 0], [51, 1]], [[8, 0], [9, 0], [9, -1]]]";
    assert_eq!(
        error(area, false),
        Err("[stage] keep_out area 2 holds bench 0 at the start: begin its route elsewhere".to_owned())
    );
    let crowd = "crowd = [[-20, 20], [20, 20]]\nclear_m = 9\nguard = true";
    assert_eq!(error(crowd, false), Ok(()));
    let near = error(crowd, true).expect_err("nearer than 9 m");
    assert!(near.starts_with("[stage] crowd is 8.") && near.contains(" m from bench "), "{near}");
    assert!(near.ends_with(" at the start, must be at least clear_m 9 from it with guard"), "{near}");
    assert_eq!(error(&crowd.replace("= 9", "= 2"), true), Ok(()));
}

#[track_caller]
fn assert_one_line(text: &str, start: &str) {
    let error = error_of(text);
    assert!(error.starts_with(start) && !error.contains('\n'), "{text:?} gives {error:?}");
}

#[test]
fn every_error_of_the_stage_is_one_line_that_names_key_value_and_range() {
    for (text, start) in [
        ("[stage]\noutline = [[0, 0], [1, 0]]", "[stage] outline has 2 points, must have from 3 to 256"),
        (
            "[stage]\noutline = [[0, 0], [1, 0], [inf, 1]]",
            "[stage] outline point 3 has the coordinate inf, must be from -",
        ),
        (
            "[stage]\noutline = [[0, 0], [1, 1], [1, 0], [0, 1]]",
            "[stage] outline crosses or touches itself: the edges from points 1 and 3 meet",
        ),
        ("[stage]\noutline = [[0, 0], [1e-4, 0], [0, 1e-4]]", "[stage] outline encloses 5e-9 m², must enclose"),
        ("[stage]\noutline = [[0, 0], [1, 0], [2]]", "[stage] outline point 3 is [2], must be two numbers, [x, y]"),
        (
            "[stage]\noutline = [[0, 0], [1, 0, 3], [1, 1]]",
            "[stage] outline point 2 is [1, 0, 3], must be two numbers, [x, y]",
        ),
        (
            "[stage]\noutline = [[0, 0], [1, 0], [1, 1], [0, 0]]",
            "[stage] outline points 1 and 4 are the same, must differ: leave out one of them",
        ),
        (
            "[stage]\nkeep_out = [[[0, 0], [1, 0], [0, 1]], [[0, 0], [1, 1], [1, 0], [0, 1]]]",
            "[stage] keep_out area 2 crosses or touches itself: the edges from points 1 and 3 meet",
        ),
        ("[stage]\nkeep_out = [[0, 0], [1, 0], [0, 1]]", "line 2, `keep_out = [[0, 0], [1, 0], [0, 1]]`: invalid type"),
        ("[stage]\nkeep_out = [[[0, 0], [1, 0], [0]]]", "[stage] keep_out area 1 point 3 is [0], must be two numbers"),
        ("[stage]\ncrowd = [[0, 0]]", "[stage] crowd has 1 points, must have from 2 to 256"),
        ("[stage]\ncrowd = [[0, 0], [0, 0]]", "[stage] crowd points 1 and 2 are the same, must differ: leave out"),
        ("[stage]\ncrowd = [[0, 0], [0, inf]]", "[stage] crowd point 2 has the coordinate inf, must be from -"),
        ("[stage]\ncrowd = [[0, 9], [9, 9]]\nclear_m = -1", "[stage] clear_m is -1, must be from 0 to 100"),
        ("[stage]\ncrowd = [[0, 9], [9, 9]]\nclear_m = nan", "[stage] clear_m is NaN, must be from 0 to 100"),
        ("[stage]\nclear_m = 2", "[stage] clear_m is 2, only allowed with outline, keep_out or crowd"),
        ("[stage]\ncrowd = [[0, 9], [9, 9]]\nguard = true", "[stage] guard is true, needs clear_m: the distance"),
        (
            "[dragon]\npole_diameter_m = 0.05\n[stage]\ncrowd = [[0, 9], [9, 9]]\nclear_m = 2\nguard = true",
            "[stage] guard is true, needs wider bends than this run has, with play in the hinges: end it earlier ([route] end_s)",
        ),
        (
            "[dragon]\npole_diameter_m = 0.05\n[route]\nend_s = 300\n[ground]\nrise_x = 0.01\n[stage]\ncrowd = [[0, 9], [9, 9]]\n\
             clear_m = 2\nguard = true",
            "[stage] guard is true, needs hinges without play on ground: remove [dragon] pole_diameter_m, or guard",
        ),
    ] {
        assert_one_line(text, start);
    }
}

#[test]
fn every_error_is_one_line_that_names_key_value_and_range() {
    for (text, start) in [
        ("[serve]\nrate_hz = 0", "[serve] rate_hz is 0, must be from 1 to 100000"),
        ("[serve]\nrate_hz = 10000000", "[serve] rate_hz is 10000000, must be from 1 to 100000"),
        ("[serve]\ntime_scale = nan", "[serve] time_scale is NaN, must be from 0.001 to 1000"),
        ("[serve]\ncpu = 1024", "[serve] cpu is 1024, must be from 0 to 1023"),
        ("[serve]\ncatch_up_s = -0.25", "[serve] catch_up_s is -0.25, must be from 0 to 10"),
        ("[serve]\ncatch_up_s = nan", "[serve] catch_up_s is NaN, must be from 0 to 10"),
        ("[serve]\nspin_us = 1001", "[serve] spin_us is 1001, must be from 0 to 1000"),
        (
            "[serve]\npriority = \"fifo\"",
            "line 2, `priority = \"fifo\"`: priority is \"fifo\", must be other, fifo:N or rr:N, N from 1 to 99",
        ),
        ("[head]\nspeed_mps = -1.0", "[head] speed_mps is -1, must be from 0.001 to 10"),
        ("[dragon]\nbenches = 0", "[dragon] benches is 0, must be"),
        ("[dragon]\nhole_offset_m = 1.2", "[dragon] hole_offset_m is 1.2, must be"),
        ("[dragon]\nwidth_m = inf", "[dragon] width_m is inf, must be"),
        ("[route]\npitch_m = 0.2", "pitch_m is 0.2, must be above width_m"),
        ("[route]\npitch_m = nan", "[route] pitch_m is NaN, must be"),
        (
            "[route]\nkind = \"ring\"",
            "line 2, `kind = \"ring\"`: unknown variant `ring`, expected one of `spiral`, `turnaround`",
        ),
        ("[route]\nradius_ratio = 2", "[route] radius_ratio is 2, only allowed with kind = \"turnaround\""),
        (
            "[route]\nkind = \"turnaround\"\nstart_turns = 16",
            "[route] start_turns is 16, only allowed with kind = \"spiral\"",
        ),
        ("[route]\nkind = \"turnaround\"\nradius_ratio = 0", "[route] radius_ratio is 0, must be from 0.01 to 100"),
        ("[route]\nturn_line_m = 1", "[route] turn_line_m is 1, only allowed with kind = \"turnaround\""),
        (
            "[route]\nkind = \"turnaround\"\nturn_line_m = 9",
            "[route] turn_line_m is 9, must be 0 or more, and under turn_diameter_m 9",
        ),
        (
            "[route]\nkind = \"turnaround\"\nturn_diameter_m = -9",
            "[route] turn_diameter_m is -9, must be above 0 and at most 34000",
        ),
        (
            "[route]\nkind = \"turnaround\"\nturn_diameter_m = 5e-324",
            "[route] turn_diameter_m is 5e-324, must be above 0 and at most 34000",
        ),
        ("[route]\nkind = \"turnaround\"\nstart_s = 5\nend_s = 5", "[route] end_s is 5, must be above start_s 5"),
        (
            "[route]\nkind = \"turnaround\"\nend_s = 1e9",
            "[route] end_s is 1000000000, must be from -1000000 to 1000000",
        ),
        ("[dragon]\nbenches = -3", "line 2, `benches = -3`: "),
        ("[dragon", "line 1, `[dragon`: "),
        (
            "[serve]\nrate_hz = 1e3",
            "line 2, `rate_hz = 1e3`: invalid type: floating point `1000.0`, expected a whole number",
        ),
        ("[route]\npitch_m = \"x\"", "line 2, `pitch_m = \"x\"`: invalid type: string \"x\", expected a number"),
        ("[show]\nalso = 3", "line 2, `also = 3`: invalid type: integer `3`, expected a sequence"),
        ("[[show.also]]\nname = \"x\"", "line 2, `name = \"x\"`: unknown field `name`, expected `command`"),
        ("[[show.also]]", "line 1, `[[show.also]]`: missing field `command`"),
        ("[show]\nalos = []", "line 2, `alos = []`: unknown field `alos`, expected `stay` or `also`"),
        ("dragon = 3", "line 1, `dragon = 3`: invalid type: integer `3`, expected a table"),
        ("[route]\npitch_m = 1e308", "[route] pitch_m is 1e308, must be"),
    ] {
        assert_one_line(text, start);
    }
}

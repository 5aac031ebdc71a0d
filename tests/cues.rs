//! Cues: server, guard and cues together, tick by tick, without a bus.

use bench_dragon::config::{Config, Cue};
use bench_dragon::safety::guard::{Asked, ClearanceCheck, Guard};
use bench_dragon::source::server::motion::HeadState;
use bench_dragon::source::server::{ReachedCue, ServerSettings, Simulation, TickInputs};
use bench_dragon_ipc::{FrameHeader, Refusal, Request, RunStart, ShowState, Stop};
use proptest::prelude::*;
use test_support::property::random_cases;

const RUN_ID: u64 = 7;

/// A dragon of five benches on a straight route of 60 m, at 1 m/s and 100 ticks a second, with these cues.
fn straight(head: &str, cues: &str) -> String {
    format!(
        "cues = [{cues}]\n[serve]\nrate_hz = 100\n[dragon]\nbenches = 5\n[head]\n{head}\n\
         [route]\nkind = \"path\"\nsegments = [{{ kind = \"line\", length_m = 60 }}]\n"
    )
}

fn config(text: &str) -> Config {
    Config::from_toml(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// A show, with the cues that it has reached.
struct Night<'a> {
    config: &'a Config,
    simulation: Simulation,
    reached: Vec<usize>,
    tick: u64,
}

struct Reached<'a>(&'a mut Vec<usize>);

impl TickInputs for Reached<'_> {
    fn reached(&mut self, _head: HeadState, cue: ReachedCue) {
        self.0.push(cue.number);
    }
}

impl<'a> Night<'a> {
    fn new(config: &'a Config) -> Self {
        Self::starting(config, ServerSettings::planned_start(config, config.start_s()))
    }

    fn starting(config: &'a Config, start: RunStart) -> Self {
        let simulation = Simulation::of_run(config, &start, RUN_ID).expect("a sound start");
        Self { config, simulation, reached: Vec::new(), tick: 0 }
    }

    /// Plays a tick. Each dragon is where its timetable has it.
    fn play(&mut self) -> FrameHeader {
        self.simulation.tick(0, &mut Reached(&mut self.reached));
        let header = self.simulation.header(RUN_ID, self.tick, 0);
        self.tick += 1;
        let formation = self.config.formation();
        for (dragon, planned) in header.dragons().iter().zip(formation.dragons()) {
            let planned_m = planned.travel_m(formation.plan_s(header.course_m));
            assert!((dragon.travel_m - planned_m).abs() < 1e-9, "{dragon:?} at {} m", header.course_m);
        }
        header
    }

    /// Plays to a state.
    fn play_to(&mut self, state: ShowState) -> FrameHeader {
        for _ in 0..50_000 {
            let header = self.play();
            if header.show_state() == Some(state) {
                return header;
            }
        }
        panic!("never {state}: {:?}", self.simulation.motion().head());
    }

    fn ask(&mut self, request: Request) -> Result<(), Refusal> {
        self.simulation.request(request)
    }

    fn cue(&self, name: &str) -> &Cue {
        self.config.cues().iter().find(|cue| cue.name == name).expect("a cue of this name")
    }
}

const THREE: &str = "{ name = \"slow\", at_s = 10, speed_mps = 0.5 }, { name = \"stand\", at_s = 30, wait = true }, \
                     { name = \"fast\", at_m = 40, speed_mps = 2 }";

#[test]
fn a_show_follows_its_cues_and_waits_until_go() {
    for (head, rest_m, end_s) in [("", 20.0, 30.0 + 40.0 + 10.0), ("accel_mps2 = 0.5", 19.0, f64::NAN)] {
        let config = config(&straight(head, THREE));
        let mut night = Night::new(&config);
        let waiting = night.play_to(ShowState::Waiting);
        assert!((waiting.show_time_s() - 30.0).abs() < 1e-6, "{} s", waiting.show_time_s());
        assert!((waiting.head_travel_m - rest_m).abs() < 1e-9, "{} m", waiting.head_travel_m);
        assert_eq!((waiting.course_m, waiting.course_mps, waiting.head_speed_mps), (30.0, 0.0, 0.0));
        assert!(night.simulation.motion().stops().has(Stop::Waiting));
        assert_eq!(night.reached, [0, 1], "slow, and the wait itself");
        for _ in 0..500 {
            let later = night.play();
            assert_eq!((later.course_m, later.show_time_ns, later.state), (30.0, waiting.show_time_ns, waiting.state));
        }
        assert_eq!(night.ask(Request::Go), Ok(()));
        let first = night.play();
        assert!(first.course_m > 30.0 && first.show_state() == Some(ShowState::Running), "GO moves the next frame");
        let end = night.play_to(ShowState::Finished);
        assert_eq!((night.reached.as_slice(), end.head_travel_m), (&[0, 1, 2][..], 60.0));
        assert!(end_s.is_nan() || (end.show_time_s() - end_s).abs() < 1e-6, "{} s", end.show_time_s());
        assert!((config.end_s() - end.show_time_s()).abs() < 1e-6, "as planned: {} s", config.end_s());
    }
}

#[test]
fn a_wait_at_a_travel_is_where_the_head_stands_there_also_as_the_first_cue() {
    let cues = "{ name = \"a\", at_m = 10, wait = true }, { name = \"b\", at_m = 20, wait = true }";
    for (head, at_s) in [("", [10.0, 20.0]), ("accel_mps2 = 0.5", [12.0, 24.0])] {
        let config = config(&straight(head, cues));
        let planned_s: Vec<f64> = config.cues().iter().map(|cue| cue.at_s).collect();
        assert!(planned_s.iter().zip(at_s).all(|(planned_s, at_s)| (planned_s - at_s).abs() < 1e-9), "{planned_s:?}");
        let mut night = Night::new(&config);
        for at_m in [10.0, 20.0] {
            let waiting = night.play_to(ShowState::Waiting);
            assert!((waiting.head_travel_m - at_m).abs() < 1e-9, "{} m", waiting.head_travel_m);
            assert_eq!(night.ask(Request::Go), Ok(()));
        }
        assert_eq!(night.play_to(ShowState::Finished).head_travel_m, 60.0);
    }
}

#[test]
fn a_speed_of_0_is_a_stand_until_a_later_cue() {
    // Half of each ramp is at the slower speed: the start loses as much travel as the stand gains.
    for head in ["", "accel_mps2 = 0.5"] {
        let cues = "{ name = \"stand\", at_s = 10, speed_mps = 0 }, { name = \"on\", at_s = 30, speed_mps = 1 }";
        let config = config(&straight(head, cues));
        let mut night = Night::new(&config);
        while night.play().show_time_s() < 29.0 {}
        let standing = night.play();
        assert_eq!((standing.head_speed_mps, standing.show_state()), (0.0, Some(ShowState::Running)));
        assert!((standing.head_travel_m - 10.0).abs() < 1e-9, "{} m", standing.head_travel_m);
        let end = night.play_to(ShowState::Finished);
        assert_eq!((end.head_travel_m, night.reached.as_slice()), (60.0, &[0, 1][..]));
    }
}

#[test]
fn with_ramps_no_tick_changes_the_speed_at_once() {
    let config = config(&straight("accel_mps2 = 0.5", THREE));
    let mut night = Night::new(&config);
    let mut last_mps = 0.0;
    for tick in 0..12_000 {
        if tick % 100 == 0 {
            let _ = night.ask(Request::Go);
        }
        let header = night.play();
        assert!(
            (header.head_speed_mps - last_mps).abs() <= 0.5 * 0.01 + 1e-9,
            "{last_mps} to {}",
            header.head_speed_mps
        );
        last_mps = header.head_speed_mps;
    }
    assert_eq!(night.reached, [0, 1, 2]);
}

#[test]
fn go_is_refused_with_its_reason_where_no_cue_waits() {
    let config = config(&straight("", THREE));
    let start = RunStart { is_ready: true, ..ServerSettings::planned_start(&config, 0.0) };
    let mut night = Night::starting(&config, start);
    assert_eq!(night.ask(Request::Go), Err(Refusal::Ready));
    assert_eq!(night.ask(Request::Release), Ok(()));
    night.play();
    assert_eq!(night.ask(Request::Go), Err(Refusal::NothingWaits));
    night.play_to(ShowState::Waiting);
    assert_eq!(night.ask(Request::Resume), Ok(()));
    assert_eq!(night.ask(Request::Pause), Ok(()));
    assert_eq!(night.play().show_state(), Some(ShowState::Paused));
    assert_eq!(night.ask(Request::Go), Err(Refusal::Paused));
    assert_eq!(night.ask(Request::Resume), Ok(()));
    assert_eq!(night.play().show_state(), Some(ShowState::Waiting));
    assert_eq!(night.ask(Request::Hold), Ok(()));
    assert_eq!(night.ask(Request::Go), Err(Refusal::Held));
    assert_eq!(night.ask(Request::Release), Ok(()));
    assert_eq!(night.play().show_state(), Some(ShowState::Waiting));
    assert_eq!(night.ask(Request::Go), Ok(()));
    night.play_to(ShowState::Finished);
    assert_eq!(night.ask(Request::Go), Err(Refusal::Finished));
}

#[test]
fn two_gos_within_three_tenths_of_a_second_are_one() {
    let cues = "{ name = \"one\", at_s = 10, wait = true }, { name = \"two\", at_s = 10.1, wait = true }, \
                { name = \"three\", at_s = 10.2, wait = true }";
    let config = config(&straight("", cues));
    let mut night = Night::new(&config);
    night.play_to(ShowState::Waiting);
    assert_eq!((night.ask(Request::Go), night.ask(Request::Go)), (Ok(()), Ok(())));
    let second = night.play_to(ShowState::Waiting);
    assert_eq!(night.ask(Request::Go), Ok(()), "the second press of the same GO");
    for _ in 0..40 {
        assert_eq!(night.play().course_m, second.course_m, "one GO ends one wait");
    }
    assert_eq!(night.ask(Request::Go), Ok(()));
    assert!(night.play_to(ShowState::Waiting).course_m > second.course_m);
}

#[test]
fn missed_periods_are_hidden_by_a_stand_and_within_three_tenths_of_a_second_of_go() {
    let config = config(&straight("", "{ name = \"one\", at_s = 10, wait = true }"));
    let mut night = Night::new(&config);
    night.play_to(ShowState::Waiting);
    assert!(night.simulation.hides_missed_periods(), "a standing show does not show its lag");
    assert_eq!(night.ask(Request::Go), Ok(()));
    let is_hidden = |_| {
        night.play();
        night.simulation.hides_missed_periods()
    };
    assert_eq!((1..=32).map(is_hidden).collect::<Vec<_>>(), [[true; 29].as_slice(), &[false; 3]].concat());
}

#[test]
fn a_seek_to_a_cue_waits_there_and_a_restart_waits_there_again() {
    let config = config(&straight("accel_mps2 = 0.5", THREE));
    let mut night = Night::new(&config);
    let at_s = night.cue("stand").at_s;
    assert_eq!(night.ask(Request::Seek { show_time_s: at_s }), Ok(()));
    let sought = night.play();
    assert_eq!((sought.show_state(), sought.course_m), (Some(ShowState::Waiting), 30.0));
    assert_eq!(night.reached, [1]);
    let start = RunStart { travel_m: sought.course_m, ..ServerSettings::planned_start(&config, sought.show_time_s()) };
    let mut again = Night::starting(&config, start);
    assert_eq!(again.play().show_state(), Some(ShowState::Waiting));
    assert_eq!(again.ask(Request::Go), Ok(()));
    again.play_to(ShowState::Finished);
    assert_eq!(again.reached, [1, 2]);
    // A seek back and a second walk reach the cue again.
    assert_eq!(again.ask(Request::Seek { show_time_s: 29.0 }), Ok(()));
    again.play_to(ShowState::Waiting);
    assert_eq!(again.reached, [1, 2, 1]);
}

#[test]
fn pace_is_the_factor_on_plan_time_and_speed_is_that_of_the_leading_head_now() {
    let config = config(&straight("", "{ name = \"slow\", at_s = 10, speed_mps = 0.5 }"));
    let mut night = Night::new(&config);
    night.play();
    assert_eq!(night.ask(Request::Pace { factor: 0.8 }), Ok(()));
    night.play();
    assert_eq!(night.play().head_speed_mps, 0.8);
    while night.play().course_m < 11.0 {}
    assert_eq!(night.play().head_speed_mps, 0.4, "the pace lasts over the cue");
    assert_eq!(night.ask(Request::Speed { speed_mps: 1.5 }), Ok(()));
    let fast = night.play();
    assert_eq!((fast.head_speed_mps, fast.course_mps), (1.5, 3.0));
    assert_eq!(night.ask(Request::Speed { speed_mps: 6.0 }), Err(Refusal::OutOfRange { lowest: 0.0, highest: 5.0 }));
    assert_eq!(night.ask(Request::Pace { factor: 10.5 }), Err(Refusal::OutOfRange { lowest: 0.0, highest: 10.0 }));
}

#[test]
fn a_written_configuration_has_the_same_cues() {
    let text = straight("accel_mps2 = 0.5", THREE);
    let (first, again) = (config(&text), config(&config(&text).to_toml()));
    assert_eq!(first.cues(), again.cues());
    assert_eq!(first.to_toml(), again.to_toml());
    assert_eq!(first.cues()[2].at_s, first.timetable().time_s(40.0));
}

#[test]
fn marks_alone_leave_the_walk_of_one_dragon_as_it_is() {
    let (plain, marked) = (config(&straight("", "")), config(&straight("", "{ name = \"a\", at_s = 20 }")));
    let (mut plain, mut marked) = (Night::new(&plain), Night::new(&marked));
    for _ in 0..6100 {
        let [one, other] = [plain.play(), marked.play()];
        assert_eq!(
            (one.show_time_ns, one.head_travel_m, one.state),
            (other.show_time_ns, other.head_travel_m, other.state)
        );
    }
    assert_eq!(marked.reached, [0]);
}

#[test]
fn bad_cues_get_one_line() {
    for (head, cues, expected) in [
        ("", "{ name = \"\", at_s = 1 }", "[[cues]] name of number 1 is \"\", must be 1 to 48 printable characters"),
        (
            "",
            "{ name = \"a\", at_s = 1 }, { name = \"a\", at_s = 2 }",
            "[[cues]] \"a\": the name occurs twice, must be unique",
        ),
        ("", "{ name = \"a\" }", "[[cues]] \"a\": at_s or at_m is missing"),
        ("", "{ name = \"a\", at_s = 1, at_m = 1 }", "[[cues]] \"a\": at_s and at_m exclude each other"),
        (
            "",
            "{ name = \"a\", at_s = 60 }",
            "[[cues]] \"a\": at_s is 60, must be at least 0 and before the end of the plan at 60.000 s",
        ),
        (
            "",
            "{ name = \"a\", at_s = nan }",
            "[[cues]] \"a\": at_s is NaN, must be at least 0 and before the end of the plan at 60.000 s",
        ),
        (
            "",
            "{ name = \"a\", at_m = 61 }",
            "[[cues]] \"a\": at_m is 61, must be at least 0 and before the end at 60.000 m",
        ),
        (
            "",
            "{ name = \"a\", at_s = 5 }, { name = \"b\", at_s = 4 }",
            "[[cues]] \"b\": it is at 4.000 s, must be after \"a\" at 5.000 s",
        ),
        (
            "",
            "{ name = \"a\", at_s = 5, dragon = \"gold\" }",
            "[[cues]] \"a\": dragon is \"gold\", must be absent without [[dragons]]",
        ),
        (
            "",
            "{ name = \"a\", at_s = 5, speed_mps = 11 }",
            "[[cues]] \"a\": speed_mps is 11, must be 0, or from 0.001 to 10",
        ),
        (
            "",
            "{ name = \"a\", at_s = 5, speed_mps = 0 }",
            "[[cues]] \"a\": speed_mps is 0, and no later cue lets it walk on",
        ),
        (
            "accel_mps2 = 0.1",
            "{ name = \"a\", at_s = 20, speed_mps = 2 }, { name = \"b\", at_s = 25, speed_mps = 0.5 }",
            "[[cues]] \"a\": speed_mps is 2, and no ramp reaches it before \"b\"",
        ),
        (
            "accel_mps2 = 0.1",
            "{ name = \"a\", at_s = 40, speed_mps = 5 }",
            "[[cues]] \"a\": speed_mps is 5, and no ramp reaches it before the end",
        ),
    ] {
        let error = Config::from_toml(&straight(head, cues)).expect_err(cues).to_string();
        assert_eq!(error, expected);
    }
    let unknown = Config::from_toml(&straight("", "{ name = \"a\", at = 1 }")).expect_err("an unknown key").to_string();
    assert!(unknown.contains("unknown field `at`"), "{unknown}");
}

#[test]
fn the_first_wait_at_a_travel_is_that_of_its_dragon() {
    let config = config(&crossing(Some(0.5), 5.0, "{ name = \"a\", at_m = 8, dragon = \"silver\", wait = true }"));
    let silver = &config.formation().dragons()[1];
    let walked_m = silver.travel_m(config.cues()[0].at_s) - silver.dragon.start_travel_m();
    assert!((walked_m - 8.0).abs() < 1e-9, "{walked_m} m at {} s", config.cues()[0].at_s);
}

/// Two straight dragons whose routes cross at a right angle, with cues.
fn crossing(accel_mps2: Option<f64>, silver_s: f64, cues: &str) -> String {
    let straight = "route = { kind = \"path\", segments = [{ kind = \"line\", length_m = 40 }]";
    let ramp = accel_mps2.map_or_else(String::new, |accel_mps2| format!("accel_mps2 = {accel_mps2}, "));
    format!(
        "cues = [{cues}]\n[serve]\nrate_hz = 20\n[monitor]\nguard = true\n\
         [[dragons]]\nname = \"gold\"\nbenches = 5\n{straight} }}\nhead = {{ {ramp}speed_mps = 1.0 }}\n\
         [[dragons]]\nname = \"silver\"\nbenches = 4\n{straight}, start_x_m = 20, start_y_m = -20, start_heading_deg = 90 }}\n\
         head = {{ {ramp}speed_mps = 0.8, start_s = {silver_s} }}\n"
    )
}

proptest! {
    #![proptest_config(random_cases(24))]

    /// Whatever cues there are, and whenever GO comes, a guarded formation stays on its plan and above the margin, waits at each
    /// cue that waits, and ends, or rests at the margin.
    #[test]
    fn a_guarded_night_keeps_its_plan_and_its_margin(
        accel_mps2 in prop::option::of(0.2..2.0_f64),
        silver_s in 0.0..40.0_f64,
        cues in prop::collection::vec((1.5..12.0_f64, 0..5_u8, 0.3..1.5_f64), 0..5),
        go_every in 1..200_u64,
    ) {
        let mut at_s = 0.0;
        let cues: Vec<String> = (0..)
            .zip(cues)
            .map(|(number, (after_s, kind, speed_mps))| {
                at_s += after_s;
                let effect = match kind {
                    0 => "wait = true".to_owned(),
                    1 => format!("speed_mps = {speed_mps}"),
                    2 => format!("speed_mps = {speed_mps}, dragon = \"silver\""),
                    3 => format!("wait = true, speed_mps = {speed_mps}, dragon = \"gold\""),
                    _ => return format!("{{ name = \"{number}\", at_m = {at_s}, wait = true }}"),
                };
                format!("{{ name = \"{number}\", at_s = {at_s}, {effect} }}")
            })
            .collect();
        // Cues that no ramp reaches are refused.
        let Ok(config) = Config::from_toml(&crossing(accel_mps2, silver_s, &cues.join(", "))) else { return Ok(()) };
        let mut night = Night::new(&config);
        let mut guard = Guard::new(config.formation(), &config, RUN_ID);
        let mut check = ClearanceCheck::new(config.formation().clone());
        let margin_m = config.tables().monitor.margin_m;
        let mut waited = Vec::new();
        let mut end = None;
        for tick in 0..20_000_u64 {
            let header = night.play();
            if let Some(nearest) = check.nearest(header.course_m) {
                prop_assert!(nearest.clearance_m >= margin_m, "{nearest:?} at {} m", header.course_m);
            }
            let asked = night.simulation.motion().limits().asked_m.map(|travel_m| Asked { travel_m, tick });
            for _ in 0..3 {
                let Some(grant) = guard.advance(&header, asked) else { break };
                prop_assert_eq!(night.ask(grant), Ok(()));
                prop_assert!(guard.note_reply(grant, Ok(tick + 1)));
            }
            if header.show_state() == Some(ShowState::Waiting) && waited.last() != Some(&header.course_m) {
                waited.push(header.course_m);
            }
            if tick % go_every == 0 {
                let _ = night.ask(Request::Go);
            }
            if header.show_state() == Some(ShowState::Finished) || guard.is_final(&header) {
                end = Some(header);
                break;
            }
        }
        let Some(end) = end else { panic!("no end: {:?}", night.simulation.motion().head()) };
        let waits_m: Vec<f64> = config.waits_m().iter().copied().filter(|wait_m| *wait_m < end.course_m).collect();
        prop_assert!(waited.starts_with(&waits_m), "{waited:?}, planned {waits_m:?}");
        if end.show_state() == Some(ShowState::Finished) {
            let dragons = end.dragons().iter().zip(config.formation().dragons());
            for (dragon, planned) in dragons {
                prop_assert_eq!(dragon.travel_m, planned.dragon.end_travel_m());
            }
        }
    }
}

//! Several dragons on one clock: server, guard and monitor together, tick by tick, without a bus.

use std::collections::VecDeque;

use bench_dragon::config::Config;
use bench_dragon::safety::guard::{Asked, ClearanceCheck, Guard};
use bench_dragon::safety::monitor::Monitor;
use bench_dragon::source::server::motion::MotionPlan;
use bench_dragon::source::server::{ServerSettings, Simulation};
use bench_dragon_geometry::clearance::{CourseSearch, first_meeting};
use bench_dragon_ipc::{Alert, AlertKind, DragonState, FrameHeader, HandleState, Refusal, Request, ShowState};
use proptest::prelude::*;
use test_support::property::random_cases;

const RUN_ID: u64 = 7;
/// Rounding of a clearance in metres.
const ROUNDING_M: f64 = 1e-9;

/// Two straight dragons of 5 benches. The second one crosses the route of the first one at a right angle, 20 m ahead of both.
fn crossing(silver_head: &str, margin_m: f64) -> Config {
    let straight = "route = { kind = \"path\", segments = [{ kind = \"line\", length_m = 60 }]";
    let text = format!(
        "[serve]\nrate_hz = 100\n[monitor]\nguard = true\nmargin_m = {margin_m}\n\
         [[dragons]]\nname = \"gold\"\nbenches = 5\n{straight} }}\nhead = {{ accel_mps2 = 0.5 }}\n\
         [[dragons]]\nname = \"silver\"\nbenches = 5\n{straight}, start_x_m = 20, start_y_m = -20, start_heading_deg = 90 }}\n\
         head = {{ {silver_head} }}\n"
    );
    Config::from_toml(&text).expect("a valid configuration")
}

/// A show of a server, its guard, and a monitor that gets every frame.
struct Rehearsal<'a> {
    simulation: Simulation,
    guard: Option<Guard<'a>>,
    monitor: Monitor,
    handles: Vec<HandleState>,
    tick: u64,
    late: VecDeque<FrameHeader>,
    alerts: Vec<Alert>,
}

impl<'a> Rehearsal<'a> {
    fn new(config: &'a Config, is_guarded: bool) -> Self {
        let mut start = ServerSettings::planned_start(config, config.start_s());
        start.is_guarded = is_guarded;
        let plan = MotionPlan::of_run(config, &start, RUN_ID).expect("a planned start");
        let serve = &config.tables().serve;
        Self {
            simulation: Simulation::new(config.formation().clone(), plan, serve.rate_hz, serve.time_scale),
            guard: is_guarded.then(|| Guard::new(config.formation(), config, RUN_ID)),
            monitor: Monitor::new(config),
            handles: vec![HandleState::default(); config.formation().layout().handles()],
            tick: 0,
            late: VecDeque::new(),
            alerts: Vec::new(),
        }
    }

    /// Plays a tick. The guard sees the frame of three ticks before.
    fn play(&mut self) -> FrameHeader {
        self.simulation.tick(0, &mut ());
        let header = self.simulation.header(RUN_ID, self.tick, 0);
        self.simulation.write(&mut self.handles);
        self.tick += 1;
        self.monitor.observe(&header, &self.handles, None);
        self.alerts.extend_from_slice(self.monitor.alerts());
        self.late.push_back(header);
        if self.late.len() > 3 {
            let seen = self.late.pop_front().expect("four frames");
            self.guard_sees(&seen);
        }
        header
    }

    fn guard_sees(&mut self, header: &FrameHeader) {
        let Some(guard) = &mut self.guard else { return };
        let tick = self.tick - 1;
        let asked = self.simulation.motion().limits().asked_m.map(|travel_m| Asked { travel_m, tick });
        for _ in 0..3 {
            let Some(grant) = guard.advance(header, asked) else { return };
            self.simulation.request(grant).expect("the grant is on the course");
            assert!(guard.note_reply(grant, Ok(self.tick)), "not a grant: {grant:?}");
        }
    }

    /// Plays until the show has finished, or rests for ever.
    fn play_to_rest(&mut self) -> FrameHeader {
        for _ in 0..40_000 {
            let header = self.play();
            let is_final = self.guard.as_ref().is_some_and(|guard| guard.is_final(&header));
            if header.show_state() == Some(ShowState::Finished) || is_final && self.late.len() >= 3 {
                return header;
            }
        }
        panic!("the show does not end: {:?}, {:?}", self.simulation.motion().head(), self.simulation.motion().stops());
    }
}

#[test]
fn the_unchanged_plan_has_the_poses_of_plan_time_and_ends_in_time() {
    let config = crossing("speed_mps = 0.8, accel_mps2 = 0.2, start_s = 35", 0.0005);
    let mut rehearsal = Rehearsal::new(&config, false);
    let (formation, planned_mps) = (config.formation(), config.tables().head.speed_mps);
    loop {
        let header = rehearsal.play();
        let plan_s = header.show_time_s();
        assert!((header.course_m - planned_mps * plan_s).abs() < 1e-9, "{} m at {plan_s} s", header.course_m);
        for (dragon, planned) in header.dragons().iter().zip(formation.dragons()) {
            assert!((dragon.travel_m - planned.travel_m(plan_s)).abs() < 1e-9, "{dragon:?} at {plan_s} s");
            assert!((dragon.speed_mps - planned.speed_mps(plan_s)).abs() < 1e-9, "{dragon:?} at {plan_s} s");
        }
        let states = header.dragons().iter().map(|dragon| dragon.dragon_state().expect("a known state"));
        let expected = match plan_s {
            0.0 => Some([DragonState::Standing, DragonState::Standing]),
            1.0..=34.0 => Some([DragonState::Walking, DragonState::Standing]),
            36.0..=60.0 => Some([DragonState::Walking, DragonState::Walking]),
            63.0..=110.0 => Some([DragonState::Ended, DragonState::Walking]),
            _ => None,
        };
        assert!(expected.is_none_or(|expected| states.eq(expected)), "{:?} at {plan_s} s", header.dragons());
        if header.show_state() == Some(ShowState::Finished) {
            assert!((plan_s - config.end_s()).abs() < 1e-6, "{plan_s} s, planned {} s", config.end_s());
            return;
        }
    }
}

#[test]
fn a_pause_changes_when_but_not_where() {
    let config = crossing("speed_mps = 0.8, start_s = 35", 0.0005);
    let mut rehearsal = Rehearsal::new(&config, false);
    let (mut last, mut rested) = (FrameHeader::default(), 0);
    for tick in 0..6000 {
        match tick {
            2000 => rehearsal.simulation.request(Request::Pause).expect("a running show"),
            2500 => rehearsal.simulation.request(Request::Resume).expect("a paused show"),
            _ => {}
        }
        let header = rehearsal.play();
        for (dragon, planned) in header.dragons().iter().zip(config.formation().dragons()) {
            assert!((dragon.travel_m - planned.travel_m(header.course_m)).abs() < 1e-9, "off the plan: {dragon:?}");
        }
        let change_mps = (header.course_mps - last.course_mps).abs();
        assert!(tick < 2 || change_mps <= 0.5 * 0.01 + 1e-9, "{change_mps} m/s in tick {tick}");
        rested += u32::from(header.course_mps == 0.0);
        last = header;
    }
    assert!(rested > 200, "it rested {rested} ticks");
}

#[test]
fn dragons_whose_plan_collides_come_to_rest_before_they_touch() {
    for margin_m in [0.0005, 0.3] {
        let config = crossing("accel_mps2 = 0.5", margin_m);
        let meeting =
            first_meeting(config.formation(), margin_m, 0.0, config.end_s()).expect("no limit").expect("it collides");
        let mut rehearsal = Rehearsal::new(&config, true);
        let rest = rehearsal.play_to_rest();
        assert_eq!(rest.show_state(), Some(ShowState::Held));
        assert!((rest.course_m - meeting.time_s).abs() < 1e-6, "{} m, and {meeting:?}", rest.course_m);
        let nearest = ClearanceCheck::new(config.formation().clone()).nearest(rest.course_m).expect("ten benches");
        assert_eq!(nearest.benches, meeting.benches);
        assert!((margin_m..margin_m + 1e-6).contains(&nearest.clearance_m), "{nearest:?}");
        assert!(rest.dragons().iter().all(|dragon| dragon.speed_mps == 0.0), "{:?}", rest.dragons());
        assert!(rehearsal.alerts.iter().all(|alert| alert.alert_kind() != Some(AlertKind::Contact)));
        // Beyond the place is no way: a seek there is refused for ever, and one back is not.
        let beyond = Request::Seek { show_time_s: meeting.time_s + 0.2 };
        for _ in 0..10 {
            assert_eq!(rehearsal.simulation.request(beyond), Err(Refusal::NotProved));
            rehearsal.play();
        }
        while rehearsal.simulation.request(Request::Seek { show_time_s: 3.0 }).is_err() {
            rehearsal.play();
        }
        assert!(rehearsal.play().course_m < meeting.time_s);
    }
}

#[test]
fn all_dragons_rest_before_a_board_of_one_is_too_near_to_the_crowd() {
    let crossing = crossing("speed_mps = 0.8, start_s = 35", 0.0005).to_toml();
    let stage = "[stage]\ncrowd = [[0, 12], [60, 12]]\nclear_m = 2\nguard = true\n";
    let config = Config::from_toml(&format!("{stage}{crossing}")).expect("a valid configuration");
    let mut rehearsal = Rehearsal::new(&config, true);
    let rest = rehearsal.play_to_rest();
    // Silver begins at y = -20 and walks towards the crowd, and its head's board reaches 0.275 m beyond its handle.
    let silver_m = 20.0 + 10.0 - 0.275;
    assert_eq!(rest.show_state(), Some(ShowState::Held));
    assert!((rest.dragons()[1].travel_m - silver_m).abs() < 1e-7, "{:?}", rest.dragons());
    assert!(rest.dragons().iter().all(|dragon| dragon.speed_mps == 0.0), "{:?}", rest.dragons());
    let standing = rehearsal.guard.as_ref().expect("guarded").final_rest(&rest).border.expect("a border is the reason");
    assert_eq!((standing.bench, standing.border), (5, 0), "the head of silver");
    assert!((standing.distance_m - 2.0).abs() < 1e-7, "{standing:?}");
    let beyond = Request::Seek { show_time_s: rest.show_time_s() + 1.0 };
    for _ in 0..10 {
        assert_eq!(rehearsal.simulation.request(beyond), Err(Refusal::NotProved));
        rehearsal.play();
    }
}

#[test]
fn the_monitor_reports_the_contact_of_two_dragons_between_two_frames() {
    let text = crossing("accel_mps2 = 0.5", 0.0005).to_toml().replace("rate_hz = 100", "rate_hz = 3");
    let config = Config::from_toml(&text).expect("the written configuration is valid");
    let meeting = first_meeting(config.formation(), 0.0, 0.0, config.end_s()).expect("no limit").expect("it collides");
    let mut rehearsal = Rehearsal::new(&config, false);
    rehearsal.play_to_rest();
    let contact =
        rehearsal.alerts.iter().find(|alert| alert.alert_kind() == Some(AlertKind::Contact)).expect("a contact");
    assert_eq!(contact.pair().map(|pair| pair.map(|bench| bench as usize)), Some(meeting.benches));
    assert!((contact.show_time_ns as f64 * 1e-9 - meeting.time_s).abs() < 1e-8, "{contact:?}, {meeting:?}");
    let parted = rehearsal.alerts.iter().filter(|alert| alert.alert_kind() == Some(AlertKind::Parted)).count();
    assert!(parted > 0, "dragons that cross part again");
    assert_eq!(rehearsal.monitor.unswept, 0);
}

#[test]
fn the_monitor_reports_boards_in_an_area_between_two_frames_of_several_dragons() {
    let crossing = crossing("speed_mps = 0.8, start_s = 35", 0.0005).to_toml().replace("rate_hz = 100", "rate_hz = 1");
    // A spike whose tip is 0.05 m in the way of the boards of silver, which walk up the line x = 20.
    let stage = "[stage]\nkeep_out = [[[20.1, 5.0], [25, 5.01], [25, 4.99]]]\n";
    let config = Config::from_toml(&format!("{stage}{crossing}")).expect("a valid configuration");
    let mut rehearsal = Rehearsal::new(&config, false);
    rehearsal.play_to_rest();
    let events: Vec<_> = rehearsal
        .alerts
        .iter()
        .filter(|alert| alert.bench().is_some())
        .map(|alert| (alert.alert_kind().expect("a known kind"), alert.bench(), alert.show_time_ns as f64 * 1e-9))
        .collect();
    // The head of silver is bench 5. The boards overlap on their hinges, so their row is in the spike as a whole.
    let [(AlertKind::KeepOut, Some(5), enters_s), (AlertKind::Clear, Some(9), leaves_s)] = events[..] else {
        panic!("{events:?}")
    };
    let links_m = (3.41 - 0.55) + 4.0 * (2.20 - 0.55);
    for (at_s, travel_m) in [(enters_s, 25.0 - 0.275), (leaves_s, 25.0 + links_m + 0.275)] {
        let expected_s = 35.0 + travel_m / 0.8;
        assert!((at_s - expected_s).abs() < 1e-3, "{at_s} s, expected {expected_s} s");
    }
    assert_eq!(rehearsal.monitor.unswept, 0);
}

/// Two or three dragons near each other. Most of them meet.
fn formations() -> impl Strategy<Value = Config> {
    let route = prop_oneof![
        2 => (20.0..60.0_f64).prop_map(|length_m| format!("segments = [{{ kind = \"line\", length_m = {length_m} }}]")),
        1 => (2.0..8.0_f64, 40.0..300.0_f64).prop_map(|(radius_m, turn_deg)| {
            format!("segments = [{{ kind = \"arc\", radius_m = {radius_m}, turn_deg = {turn_deg} }}, {{ kind = \"line\", length_m = 9 }}]")
        }),
    ];
    let place = (-15.0..15.0_f64, -15.0..15.0_f64, 0.0..360.0_f64);
    let head = (0.3..2.0_f64, prop::option::of(0.1..2.0_f64), 0.0..20.0_f64);
    let dragon = (2..15_u32, route, place, head);
    (prop::collection::vec(dragon, 2..4), 0.0005..0.2_f64).prop_filter_map("an impossible formation", |(dragons, margin_m)| {
        let dragons = dragons.into_iter().enumerate().map(|(number, (benches, route, place, head))| {
            let ((x_m, y_m, heading_deg), (speed_mps, accel_mps2, start_s)) = (place, head);
            let accel = accel_mps2.map_or(String::new(), |accel_mps2| format!(", accel_mps2 = {accel_mps2}"));
            format!(
                "[[dragons]]\nname = \"d{number}\"\nbenches = {benches}\nroute = {{ kind = \"path\", start_x_m = {x_m}, \
                 start_y_m = {y_m}, start_heading_deg = {heading_deg}, {route} }}\n\
                 head = {{ speed_mps = {speed_mps}, start_s = {start_s}{accel} }}\n"
            )
        });
        let head = format!("[serve]\nrate_hz = 50\n[monitor]\nguard = true\nmargin_m = {margin_m}\n");
        let text = std::iter::once(head).chain(dragons).collect::<String>();
        Config::from_toml(&text).ok()
    })
}

proptest! {
    #![proptest_config(random_cases(48))]

    #[test]
    fn no_pair_of_any_formation_comes_under_the_margin(
        config in formations(),
        commands in prop::collection::vec((0_u32..300, 0..4_u8, 0.1..4.0_f64), 0..6),
    ) {
        let margin_m = config.tables().monitor.margin_m;
        let mut check = ClearanceCheck::new(config.formation().clone());
        prop_assume!(check.nearest(0.0).is_none_or(|nearest| nearest.clearance_m > margin_m + 1e-6));
        let mut rehearsal = Rehearsal::new(&config, true);
        for (ticks, command, value) in commands {
            for _ in 0..ticks {
                rehearsal.play();
            }
            let request = match command {
                0 => Request::Pause,
                1 => Request::Resume,
                2 => Request::Hold,
                _ => Request::Speed { speed_mps: value },
            };
            let _ = rehearsal.simulation.request(request);
        }
        let _ = rehearsal.simulation.request(Request::Release);
        // Before its first grant a guarded show refuses to resume.
        for _ in 0..10 {
            rehearsal.play();
        }
        let _ = rehearsal.simulation.request(Request::Resume);
        rehearsal.simulation.request(Request::Speed { speed_mps: 3.0 }).expect("the value is in range");
        let rest = rehearsal.play_to_rest();
        // Between the ticks too, by the search for the clearance a little under the margin.
        let below_m = margin_m - ROUNDING_M;
        let under = CourseSearch::within(config.formation(), below_m).first(0.0, rest.course_m).expect("no limit");
        prop_assert_eq!(under, None);
        if rest.show_state() == Some(ShowState::Held) {
            let ahead_m = (rest.course_m + 1e-5).min(config.formation().end_m());
            let ahead = CourseSearch::within(config.formation(), margin_m + 1e-5).first(rest.course_m, ahead_m).expect("no limit");
            prop_assert!(ahead.is_some(), "it rests at {} m for no reason", rest.course_m);
        } else {
            prop_assert_eq!(rest.course_m, config.formation().end_m());
        }
        let contacts = rehearsal.alerts.iter().filter(|alert| alert.alert_kind() == Some(AlertKind::Contact)).count();
        prop_assert_eq!(contacts, 0);
    }
}

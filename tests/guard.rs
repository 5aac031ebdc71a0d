//! The guard and a guarded head, tick by tick, without a bus. No clearance falls below the margin: for any dragon, speed, time
//! scale and seek, and with late or missing grants.

use std::collections::VecDeque;
use std::sync::Arc;

use bench_dragon::config::Config;
use bench_dragon::safety::guard::{Asked, ClearanceCheck, FAULT_M, Guard};
use bench_dragon::source::server::motion::{HeadState, Motion, MotionPlan, MotionSettings};
use bench_dragon_geometry::clearance::{PairClearance, play_reach_m};
use bench_dragon_geometry::dragon::Dragon;
use bench_dragon_geometry::planner::least_clearance;
use bench_dragon_geometry::stage::Border;
use bench_dragon_ipc::{FrameHeader, Refusal, Request, ShowState, Status};
use proptest::prelude::*;
use test_support::property::random_cases;

const RUN_ID: u64 = 7;
/// Greatest difference in metres between the proof's clearance and one computed in another way: the rounding of poses.
const ROUNDING_M: f64 = 1e-10;

/// Greatest clearance beyond the margin where the head rests, in metres.
const SPARE_M: f64 = 1e-8;

/// A guarded head and its guard. Frames and grants pass between them some ticks late.
struct Rehearsal<'a> {
    config: &'a Config,
    dragon: &'a Dragon,
    motion: Motion,
    guard: Guard<'a>,
    check: ClearanceCheck,
    tick: u64,
    lag_ticks: usize,
    late: VecDeque<(FrameHeader, Option<f64>)>,
    margin_m: f64,
    /// Interval of travel that the head has walked since the last seek, in metres.
    leg_m: [f64; 2],
}

impl<'a> Rehearsal<'a> {
    fn new(config: &'a Config, start_travel_m: f64, lag_ticks: usize) -> Self {
        let dragon: &Dragon = config.lead();
        let plan = MotionSettings {
            speed_mps: config.tables().head.speed_mps,
            start_speed_mps: config.tables().head.speed_mps,
            accel_mps2: config.tables().head.accel_mps2,
            start_s: start_travel_m / config.tables().head.speed_mps,
            first_s: config.start_s(),
            last_s: config.end_s(),
            guarded_run: Some(RUN_ID),
            most_jumped: config.most_jumped(),
            ..MotionSettings::plain(config.tick_s(), start_travel_m, dragon.end_travel_m())
        };
        Self {
            config,
            dragon,
            motion: Motion::new(MotionPlan::new(plan).expect("the settings are sound")),
            guard: guard(config),
            check: ClearanceCheck::new(Arc::clone(config.formation())),
            tick: 0,
            lag_ticks,
            late: VecDeque::new(),
            margin_m: config.tables().monitor.margin_m,
            leg_m: [start_travel_m; 2],
        }
    }

    /// Replaces the guard by a new one, without the grants of the last one.
    fn restart_guard(&mut self) {
        self.guard = guard(self.config);
        self.late.clear();
    }

    /// Plays one tick, and passes an earlier one to the guard.
    fn play(&mut self) -> HeadState {
        self.play_after(0)
    }

    /// Plays one tick after missed periods, and passes an earlier one to the guard.
    fn play_after(&mut self, missed: u64) -> HeadState {
        self.motion.miss(missed);
        self.motion.advance();
        let head = self.motion.head();
        let time_scale = self.config.tables().serve.time_scale * self.motion.catch_up().pace();
        let header = head.header(RUN_ID, self.tick, 0, time_scale, 0);
        self.tick += 1;
        self.leg_m[1] = head.travel_m;
        self.late.push_back((header, self.motion.limits().asked_m));
        if self.late.len() > self.lag_ticks {
            let (header, asked_m) = self.late.pop_front().expect("the queue is not empty");
            self.guard_sees(&header, asked_m);
        }
        head
    }

    fn guard_sees(&mut self, header: &FrameHeader, asked_m: Option<f64>) {
        let asked = asked_m.map(|travel_m| Asked { travel_m, tick: header.tick });
        for _ in 0..3 {
            let Some(grant) = self.guard.advance(header, asked) else { return };
            self.motion.request(grant).expect("the grant is for this run and within it");
            assert!(self.guard.note_reply(grant, Ok(self.tick)), "not a grant: {grant:?}");
        }
    }

    /// Lifts a hold, if there is one.
    fn release(&mut self) {
        let outcome = self.motion.request(Request::Release);
        assert!(matches!(outcome, Ok(()) | Err(Refusal::NotHeld | Refusal::HeldByGuard)), "{outcome:?}");
    }

    /// Repeats a seek until the guard has proved the target, or had enough ticks to prove it.
    fn seek(&mut self, show_time_s: f64) {
        for _ in 0..=self.lag_ticks + 1 {
            match self.motion.request(Request::Seek { show_time_s }) {
                Ok(()) => {
                    self.assert_apart_on_leg();
                    self.leg_m = [self.motion.head().travel_m; 2];
                    return;
                }
                Err(refusal) => assert_eq!(refusal, Refusal::NotProved),
            }
            self.play();
        }
        let target_m = self.config.tables().head.speed_mps * show_time_s;
        assert!(!self.is_apart_at(target_m), "a seek to {target_m} m is refused for no reason");
    }

    fn is_apart_at(&mut self, travel_m: f64) -> bool {
        self.check.nearest(travel_m).is_none_or(|pair| pair.clearance_m >= self.margin_m - ROUNDING_M)
    }

    /// Fails unless the clearance is at least the margin on the whole interval, between ticks too, by the planner's own search.
    fn assert_apart_on_leg(&self) {
        let [from_m, to_m] = self.leg_m;
        if from_m < to_m
            && let Some(nearest) = least_clearance(self.dragon, from_m, to_m, |_| ()).expect("the search has no limit")
        {
            assert!(nearest.pair.clearance_m >= self.margin_m - ROUNDING_M, "{from_m} to {to_m} m: {nearest:?}");
        }
    }

    /// Plays until the head rests permanently.
    fn play_to_rest(&mut self) -> HeadState {
        loop {
            let head = self.play();
            let header = head.header(RUN_ID, self.tick, 0, self.config.tables().serve.time_scale, 0);
            if head.state == ShowState::Finished || self.late.len() >= self.lag_ticks && self.guard.is_final(&header) {
                return head;
            }
        }
    }
}

fn guard(config: &Config) -> Guard<'_> {
    Guard::new(config.formation(), config, RUN_ID)
}

/// Configurations with both kinds of routes. Most of them have a contact.
fn configs() -> impl Strategy<Value = Config> {
    let dragon = (2..60_u32, 1.5..4.0_f64, 1.0..3.0_f64, 0.2..0.4_f64, 0.05..0.3_f64);
    let spiral = (1.2..2.5_f64, 2.0..9.0_f64).prop_map(|(widths, turns)| (widths, format!("start_turns = {turns}")));
    let turnaround = (1.5..4.0_f64, 4.0..9.0_f64, 0.5..3.0_f64).prop_map(|(widths, diameter_m, ratio)| {
        let ends = "start_s = -30\nend_s = 30";
        (widths, format!("kind = \"turnaround\"\nturn_diameter_m = {diameter_m}\nradius_ratio = {ratio}\n{ends}"))
    });
    let route = prop_oneof![3 => spiral, 1 => turnaround];
    let pace = (0.2..3.0_f64, prop::option::of(0.05..5.0_f64), 20..1000_u32, prop_oneof![Just(1.0), 0.5..400.0_f64]);
    let margin_m = prop_oneof![Just(0.0005), 0.000_01..0.05_f64];
    (dragon, route, pace, margin_m).prop_filter_map("an impossible dragon", |(dragon, route, pace, margin_m)| {
        let (benches, head_m, body_m, width_m, offset_m) = dragon;
        let (widths, route) = route;
        let (speed_mps, accel_mps2, rate_hz, time_scale) = pace;
        let accel = accel_mps2.map_or(String::new(), |accel_mps2| format!("accel_mps2 = {accel_mps2}"));
        let text = format!(
            "[dragon]\nbenches = {benches}\nhead_length_m = {head_m}\nbody_length_m = {body_m}\nwidth_m = {width_m}\n\
             hole_offset_m = {offset_m}\n[route]\npitch_m = {}\n{route}\n[head]\nspeed_mps = {speed_mps}\n{accel}\n\
             [serve]\nrate_hz = {rate_hz}\ntime_scale = {time_scale:?}\n[monitor]\nmargin_m = {margin_m}\nguard = true\n",
            widths * width_m,
        );
        Config::from_toml(&text).ok()
    })
}

/// Events of a show, each with the number of ticks before it.
type Events = Vec<(u32, Event)>;

#[derive(Clone, Copy, Debug)]
enum Event {
    Speed(f64),
    Seek(f64),
    GuardRestart,
    Hold,
    Release,
    /// Number of missed periods.
    Miss(u64),
}

fn events() -> impl Strategy<Value = Events> {
    let event = prop_oneof![
        (0.0..10.0_f64).prop_map(Event::Speed),
        (0.0..1.0_f64).prop_map(Event::Seek),
        Just(Event::GuardRestart),
        Just(Event::Hold),
        Just(Event::Release),
        (1..400_u64).prop_map(Event::Miss),
    ];
    prop::collection::vec((0..400_u32, event), 0..8)
}

proptest! {
    #![proptest_config(random_cases(100))]

    #[test]
    fn no_clearance_falls_under_the_margin(
        config in configs(),
        start in 0.0..1.0_f64,
        lag_ticks in 0..30_usize,
        events in events(),
    ) {
        let dragon = Arc::clone(config.lead());
        let at = |share: f64| dragon.start_travel_m() + share * (dragon.end_travel_m() - dragon.start_travel_m());
        let mut rehearsal = Rehearsal::new(&config, at(start), lag_ticks);
        for (ticks, event) in events {
            for _ in 0..ticks {
                rehearsal.play();
            }
            match event {
                Event::Seek(share) => rehearsal.seek(at(share) / config.tables().head.speed_mps),
                Event::GuardRestart => rehearsal.restart_guard(),
                Event::Speed(speed_mps) => rehearsal.motion.request(Request::Speed { speed_mps }).expect("the value is in range"),
                Event::Hold => rehearsal.motion.request(Request::Hold).expect("hold is always accepted"),
                Event::Release => rehearsal.release(),
                Event::Miss(missed) => {
                    rehearsal.play_after(missed);
                }
            }
        }
        rehearsal.release();
        rehearsal.motion.request(Request::Speed { speed_mps: 3.0 }).expect("the value is in range");
        let head = rehearsal.play_to_rest();
        rehearsal.assert_apart_on_leg();
        if head.state == ShowState::Held {
            let ahead_m = (head.travel_m + 1e-6).min(dragon.end_travel_m());
            let ahead = least_clearance(&dragon, head.travel_m, ahead_m, |_| ()).expect("the search has no limit").expect("something is in the way");
            prop_assert!(ahead.pair.clearance_m < rehearsal.margin_m + SPARE_M, "it rests too early: {ahead:?}");
        } else {
            prop_assert_eq!((head.state, head.travel_m), (ShowState::Finished, dragon.end_travel_m()));
        }
    }
}

#[test]
fn the_papers_dragon_rests_half_a_millimetre_before_its_contact() {
    for (time_scale, rate_hz) in [(1.0, 1000), (20.0, 1000), (400.0, 50), (0.01, 20_000)] {
        let text = format!("[serve]\nrate_hz = {rate_hz}\ntime_scale = {time_scale:?}\n[monitor]\nguard = true\n");
        let config = Config::from_toml(&text).expect("a valid configuration");
        let start_m = if time_scale < 1.0 { 412.454 } else { 405.0 };
        let mut rehearsal = Rehearsal::new(&config, start_m, 3);
        let head = rehearsal.play_to_rest();
        assert_eq!((head.state, head.show_time_ns / 1000), (ShowState::Held, 412_454_969), "at {time_scale} times");
        let nearest = rehearsal.check.nearest(head.travel_m).expect("223 benches");
        assert_eq!(nearest.benches, [0, 8]);
        assert!((0.0005..0.000_501).contains(&nearest.clearance_m), "{nearest:?}");
    }
}

#[test]
fn a_head_that_starts_too_near_never_moves() {
    let config = Config::from_toml("[monitor]\nguard = true\n").expect("a valid configuration");
    let mut rehearsal = Rehearsal::new(&config, 412.46, 0);
    for _ in 0..100 {
        let head = rehearsal.play();
        assert_eq!((head.state, head.travel_m), (ShowState::Held, 412.46));
    }
    rehearsal.seek(300.0);
    assert!(rehearsal.play().travel_m >= 300.0, "from there on it walks");
}

#[test]
fn large_steps_do_not_make_a_guarded_head_stop_at_every_tick() {
    for (rate_hz, time_scale, lag_ticks) in
        [(1, 1.0, 1), (1, 20.0, 1), (2, 20.0, 1), (50, 1000.0, 1), (1000, 400.0, 20)]
    {
        let text = format!("[serve]\nrate_hz = {rate_hz}\ntime_scale = {time_scale:?}\n[monitor]\nguard = true\n");
        let config = Config::from_toml(&text).expect("a valid configuration");
        let mut rehearsal = Rehearsal::new(&config, 100.0, lag_ticks);
        while rehearsal.play().state == ShowState::Held {}
        let head = rehearsal.play();
        for tick in 1..=4 {
            let next = rehearsal.play();
            let expected_m = head.travel_m + f64::from(tick) * config.tick_s();
            assert_eq!(next.state, ShowState::Running, "{rate_hz} Hz, {time_scale} times");
            assert!((next.travel_m - expected_m).abs() < 1e-9, "{rate_hz} Hz, {time_scale} times: {next:?}");
        }
    }
}

#[test]
fn jumps_over_missed_periods_do_not_make_a_guarded_head_rest() {
    for (rate_hz, time_scale, catch_up_s) in [(1000, 1.0, 0.25), (1000, 400.0, 0.25), (50, 20.0, 2.0), (7, 1.0, 10.0)] {
        let text = format!(
            "[serve]\nrate_hz = {rate_hz}\ntime_scale = {time_scale:?}\ncatch_up_s = {catch_up_s}\n[monitor]\nguard = true\n"
        );
        let config = Config::from_toml(&text).expect("a valid configuration");
        let mut rehearsal = Rehearsal::new(&config, 0.0, 1);
        while rehearsal.play().state == ShowState::Held {}
        let mut last = rehearsal.play();
        // The jumps stay before the first contact.
        let jumps = (300.0 / (config.tick_s() * (config.most_jumped() + 1) as f64)).min(20.0) as u32;
        for _ in 0..jumps {
            let next = rehearsal.play_after(config.most_jumped());
            let step_m = config.tick_s() * (config.most_jumped() + 1) as f64;
            assert_eq!(next.state, ShowState::Running, "{text}: at {} m", next.travel_m);
            assert!((next.travel_m - last.travel_m - step_m).abs() < 1e-9, "{text}: {last:?} {next:?}");
            last = next;
        }
        assert!(jumps > 1);
    }
}

/// A frame of a walking head of one dragon.
fn walking(config: &Config, travel_m: f64, speed_mps: f64) -> FrameHeader {
    FrameHeader {
        run_id: RUN_ID,
        head_travel_m: travel_m,
        head_speed_mps: speed_mps,
        time_scale: config.tables().serve.time_scale,
        state: ShowState::Running.to_wire(),
        ..FrameHeader::default()
    }
    .of_one_dragon()
}

#[test]
fn a_grant_reaches_one_and_a_half_horizons_and_the_braking_distance_ahead() {
    for (text, speed_mps, horizon_m) in [
        // Half a second and two jumps of 0.25 s, at the planned speed; 0.5 m/s is slower.
        ("", 0.5, 1.0),
        ("[head]\nspeed_mps = 2.0\n", 3.0, 3.0),
        // 3²/(2·0.1) m to brake.
        ("[head]\naccel_mps2 = 0.1\n[serve]\ntime_scale = 2.0\ncatch_up_s = 1.0\n", 3.0, 2.5 * 2.0 * 3.0 + 45.0),
        // Three ticks.
        ("[serve]\nrate_hz = 2\ncatch_up_s = 0.0\n", 1.0, 1.5),
    ] {
        let config = Config::from_toml(&format!("{text}\n[monitor]\nguard = true\n")).expect("a valid configuration");
        let granted = guard(&config).advance(&walking(&config, 100.0, speed_mps), None);
        let Some(Request::Grant { from_m, to_m, is_final, .. }) = granted else { panic!("{text}: {granted:?}") };
        let expected_m = 100.0 + 1.5 * horizon_m;
        assert!((to_m - expected_m).abs() < 1e-9, "{text}: to {to_m} m, expected {expected_m} m");
        assert_eq!((from_m, is_final), (100.0, false), "{text}");
    }
}

/// A grant for an earlier seek may be under way when the last seek is refused, and come after the grant for that one.
#[test]
fn a_grant_that_a_late_one_has_replaced_is_given_again() {
    let config = Config::from_toml("[monitor]\nguard = true\n").expect("a valid configuration");
    let mut rehearsal = Rehearsal::new(&config, 10.0, 0);
    let _ = rehearsal.play();
    let ask = |rehearsal: &mut Rehearsal<'_>, show_time_s| {
        assert_eq!(rehearsal.motion.request(Request::Seek { show_time_s }), Err(Refusal::NotProved));
        let asked = rehearsal.motion.limits().asked_m.map(|travel_m| Asked { travel_m, tick: rehearsal.tick });
        let header = rehearsal.motion.head().header(RUN_ID, rehearsal.tick, 0, 1.0, 0);
        let grant = rehearsal.guard.advance(&header, asked).expect("a grant for the target");
        let taken = rehearsal.tick + 1;
        assert!(rehearsal.guard.note_reply(grant, Ok(taken)));
        // Statuses up to the tick of the grant ask for nothing new.
        for tick in [rehearsal.tick, taken] {
            assert_eq!(rehearsal.guard.advance(&header, asked.map(|asked| Asked { tick, ..asked })), None);
        }
        rehearsal.tick = taken + 1;
        grant
    };
    let late = ask(&mut rehearsal, 300.0);
    for _ in 0..2 {
        let grant = ask(&mut rehearsal, 100.0);
        for grant in [grant, late] {
            rehearsal.motion.request(grant).expect("the grant is for this run");
        }
    }
    let grant = ask(&mut rehearsal, 100.0);
    rehearsal.motion.request(grant).expect("the grant is for this run");
    rehearsal.motion.request(Request::Seek { show_time_s: 100.0 }).expect("the target is proved");
}

/// A guard that has read no frame for a while takes the head to be where it was. Seeks and their grants may have replaced the travel there.
#[test]
fn a_status_asks_for_the_target_of_a_refused_seek() {
    let status = Status { asked_m: 12.5, tick: 40, ..Status::default() };
    assert_eq!(Asked::of(&status), Some(Asked { travel_m: 12.5, tick: 40 }));
    assert_eq!(Asked::of(&Status { asked_m: Status::NONE, ..status }), None);
}

#[test]
fn travel_at_the_last_known_place_of_the_head_is_granted_again_as_a_whole() {
    let config = Config::from_toml("[monitor]\nguard = true\n").expect("a valid configuration");
    let mut rehearsal = Rehearsal::new(&config, 10.0, 0);
    let _ = rehearsal.play();
    let last_read = rehearsal.motion.head().header(RUN_ID, rehearsal.tick, 0, 1.0, 0);
    let ask = |rehearsal: &mut Rehearsal<'_>, show_time_s| {
        assert_eq!(rehearsal.motion.request(Request::Seek { show_time_s }), Err(Refusal::NotProved));
        rehearsal.tick += 2;
        let asked = rehearsal.motion.limits().asked_m.map(|travel_m| Asked { travel_m, tick: rehearsal.tick });
        let grant = rehearsal.guard.advance(&last_read, asked).expect("a grant for the target");
        rehearsal.motion.request(grant).expect("the grant is for this run");
        assert!(rehearsal.guard.note_reply(grant, Ok(rehearsal.tick)));
        grant
    };
    let _ = ask(&mut rehearsal, 100.0);
    rehearsal.motion.request(Request::Seek { show_time_s: 100.0 }).expect("the target is proved");
    let _ = ask(&mut rehearsal, 300.0);
    let back_s = last_read.course_m + 0.1;
    let Request::Grant { from_m, .. } = ask(&mut rehearsal, back_s) else { panic!("a grant") };
    assert!(
        from_m <= last_read.course_m,
        "only {from_m} m and further is granted, not all that the guard takes for granted"
    );
    rehearsal.motion.request(Request::Seek { show_time_s: back_s }).expect("the target is proved");
}

#[test]
fn a_guard_whose_grants_the_source_does_not_take_gives_no_more() {
    let config = Config::from_toml("[monitor]\nguard = true\n").expect("a valid configuration");
    let frame = walking(&config, 100.0, 1.0);
    for (refusal, is_asked_again) in
        [(Refusal::Replayed, false), (Refusal::NotGuarded, false), (Refusal::Finished, true)]
    {
        let mut guard = guard(&config);
        let grant = guard.advance(&frame, None).expect("a grant");
        assert!(!guard.note_reply(grant, Err(refusal)));
        assert_eq!(guard.advance(&frame, None).is_some(), is_asked_again, "{refusal:?}");
    }
}

#[test]
fn the_forecast_is_the_show_time_of_the_contact_at_the_planned_speed() {
    let config =
        Config::from_toml("[head]\nspeed_mps = 0.5\n[monitor]\nguard = true\n").expect("a valid configuration");
    let mut rehearsal = Rehearsal::new(&config, 405.0, 0);
    let head = rehearsal.play_to_rest();
    let rest = rehearsal.guard.final_rest(&head.header(RUN_ID, rehearsal.tick, 0, 1.0, 0));
    let forecast_s = rest.forecast_s.expect("the paper's dragon touches itself");
    assert!((forecast_s - 2.0 * 412.473_838).abs() < 2e-6, "{forecast_s} s");
    assert!(rest.is_free && rest.border.is_none() && rest.travel_m == head.travel_m);
}

#[test]
fn a_frame_agrees_to_the_tolerance() {
    let config =
        |benches| Config::from_toml(&format!("[dragon]\nbenches = {benches}\n")).expect("a valid configuration");
    let (pairs, none) = (config(223), config(2));
    let mut check = ClearanceCheck::new(Arc::clone(pairs.formation()));
    let frame = walking(&pairs, 300.0, 1.0);
    let right = check.nearest(300.0).expect("223 benches");
    for (difference_m, agrees) in
        [(0.0, true), (0.9 * FAULT_M, true), (-0.9 * FAULT_M, true), (1.1 * FAULT_M, false), (-1.1 * FAULT_M, false)]
    {
        let measured = PairClearance { clearance_m: right.clearance_m + difference_m, ..right };
        assert_eq!(check.agrees(&frame, Some(measured)), agrees, "{difference_m} m");
    }
    assert!(!check.agrees(&frame, None), "three benches have a nearest pair");
    let off_course = walking(&pairs, -1.0, 1.0);
    assert!(!check.agrees(&off_course, None), "no frame is off the course");
    let mut check = ClearanceCheck::new(Arc::clone(none.formation()));
    assert!(check.agrees(&frame, None) && !check.agrees(&frame, Some(right)), "two benches have no pair");
    let three = config(3);
    let mut check = ClearanceCheck::new(Arc::clone(three.formation()));
    assert!(!check.agrees(&off_course, None), "three benches have one pair");
}

/// A straight dragon of five benches, whose head walks from x = 0 to x = 60, with a stage of these keys.
fn on_stage(stage: &str, rest: &str) -> Config {
    let text = format!(
        "[dragon]\nbenches = 5\n[route]\nkind = \"path\"\nsegments = [{{ kind = \"line\", length_m = 60 }}]\n\
         [monitor]\nguard = true\n[serve]\nrate_hz = 100\n[stage]\n{stage}\nguard = true\n{rest}"
    );
    Config::from_toml(&text).expect("a valid configuration")
}

/// The board of the head reaches 0.275 m beyond its handle. A border is 40 m ahead.
#[test]
fn the_head_rests_before_a_board_is_too_near_to_a_border() {
    let borders = [
        "crowd = [[40, -9], [40, 9]]",
        "keep_out = [[[99, 0], [98, 0], [98, 1]], [[40, -1], [42, -1], [42, 1], [40, 1]]]",
        "outline = [[-30, -9], [40, -9], [40, 9], [-30, 9]]",
    ];
    for (border, stage) in borders.into_iter().enumerate() {
        for (clear_m, accel) in [(2.0, ""), (2.0, "[head]\naccel_mps2 = 0.3\n"), (0.0, "")] {
            let config = on_stage(&format!("{stage}\nclear_m = {clear_m}"), accel);
            let mut rehearsal = Rehearsal::new(&config, 0.0, 3);
            let head = rehearsal.play_to_rest();
            let rest_m = 40.0 - 0.275 - clear_m;
            assert_eq!(head.state, ShowState::Held, "{stage}");
            assert!((head.travel_m - rest_m).abs() < 1e-8, "{stage}: {} m, expected {rest_m}", head.travel_m);
            let header = head.header(RUN_ID, rehearsal.tick, 0, 1.0, 0);
            let standing = rehearsal.guard.final_rest(&header).border.expect("a border is the reason");
            assert_eq!((standing.bench, standing.border), (0, usize::from(border == 1)), "{stage}");
            assert!((standing.distance_m - clear_m).abs() < 1e-8, "{standing:?}");
            // Beyond the place is no way: a seek there is refused for ever, and one back is not.
            for _ in 0..10 {
                let beyond = Request::Seek { show_time_s: 40.5 };
                assert_eq!(rehearsal.motion.request(beyond), Err(Refusal::NotProved), "{stage}");
                rehearsal.play();
            }
            while rehearsal.motion.request(Request::Seek { show_time_s: 3.0 }).is_err() {
                rehearsal.play();
            }
            assert!(rehearsal.play().travel_m < rest_m);
        }
    }
}

#[test]
fn with_play_the_head_rests_before_a_pose_that_the_play_allows_is_too_near() {
    for (stage, border) in
        [("crowd = [[40, -9], [40, 9]]", 0), ("outline = [[-30, -9], [40, -9], [40, 9], [-30, 9]]", 0)]
    {
        let rigid = on_stage(&format!("{stage}\nclear_m = 2.0"), "").to_toml();
        let text = rigid.replacen("[dragon]\n", "[dragon]\npole_diameter_m = 0.05\n", 1);
        let config = Config::from_toml(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let (play_m, reach_m) = (0.0025, play_reach_m(config.lead(), 0).expect("a straight run"));
        assert!((config.lead().dimensions().play_m() - play_m).abs() < 1e-12 && reach_m < 5.0 * play_m, "{reach_m} m");
        let mut rehearsal = Rehearsal::new(&config, 0.0, 3);
        let head = rehearsal.play_to_rest();
        assert_eq!(head.state, ShowState::Held, "{stage}");
        // The head's board may be off by the play, straight ahead.
        let nominal_m = 40.0 - 0.275 - 2.0;
        let rest_m = nominal_m - reach_m..=nominal_m - play_m;
        assert!(rest_m.contains(&(head.travel_m + 1e-8)), "{stage}: {} m, expected in {rest_m:?}", head.travel_m);
        let header = head.header(RUN_ID, rehearsal.tick, 0, 1.0, 0);
        let standing = rehearsal.guard.final_rest(&header).border.expect("a border is the reason");
        assert_eq!((standing.bench, standing.border), (0, border), "{stage}");
        for _ in 0..10 {
            let beyond = Request::Seek { show_time_s: nominal_m };
            assert_eq!(rehearsal.motion.request(beyond), Err(Refusal::NotProved), "{stage}");
            rehearsal.play();
        }
    }
}

#[test]
fn a_dragon_whose_tail_comes_onto_the_stage_walks_until_its_head_would_leave_it() {
    // Of the boards behind the head, some stand outside at the start.
    let config = on_stage("outline = [[-5, -9], [40, -9], [40, 9], [-5, 9]]\nclear_m = 0.5", "");
    let mut rehearsal = Rehearsal::new(&config, 0.0, 3);
    let head = rehearsal.play_to_rest();
    assert!((head.travel_m - (40.0 - 0.275 - 0.5)).abs() < 1e-8, "{head:?}");
}

#[test]
fn a_guard_without_stage_guard_lets_boards_near_the_crowd() {
    let text = on_stage("crowd = [[40, -9], [40, 9]]\nclear_m = 2", "").to_toml();
    let config = Config::from_toml(&text.replace("clear_m = 2.0\nguard = true", "clear_m = 2.0")).expect("valid");
    assert!(config.guarded_stage().is_none());
    let head = Rehearsal::new(&config, 0.0, 3).play_to_rest();
    assert_eq!((head.state, head.travel_m), (ShowState::Finished, 60.0));
}

proptest! {
    #![proptest_config(random_cases(60))]

    /// A crowd stands along a random line near the route. No board comes nearer than `clear_m`, except to where the show is sought.
    #[test]
    fn no_board_comes_nearer_to_a_crowd_than_allowed(
        config in configs(), start in 0.0..1.0_f64, lag_ticks in 0..30_usize, clear_m in 0.0..1.0_f64,
        (place, off_m, heading) in (0.0..1.0_f64, -4.0..4.0_f64, -3.0..3.0_f64), events in events(),
    ) {
        let (lead, formation) = (config.lead(), config.formation());
        let at = |share: f64| lead.start_travel_m() + share * (lead.end_travel_m() - lead.start_travel_m());
        let centre = formation.boards_at(at(place))[0].centre;
        let along = glam::DVec2::from_angle(heading);
        let ends = [-1.0, 1.0].map(|side| (centre + off_m * along.perp() + 2.0 * side * along).to_array());
        let [[x, y], [to_x, to_y]] = ends;
        let stage = format!("[stage]\ncrowd = [[{x:?}, {y:?}], [{to_x:?}, {to_y:?}]]\nclear_m = {clear_m:?}\nguard = true\n");
        let config = Config::from_toml(&(config.to_toml() + &stage)).expect("a valid configuration");
        let crowd = Border::crowd(&ends).expect("a line");
        let least_m = |travel_m: f64| {
            let boards = config.formation().boards_at(travel_m);
            boards.iter().map(|board| crowd.distance_m(board)).fold(f64::INFINITY, f64::min)
        };
        let mut rehearsal = Rehearsal::new(&config, at(start), lag_ticks);
        // Where the head stands at first it may be too near. Then it never moves.
        let (mut last_m, mut moved) = (at(start), false);
        let mut check = |travel_m: f64| -> Result<(), TestCaseError> {
            if travel_m != last_m {
                moved = true;
                prop_assert!(least_m(travel_m) >= clear_m - 1e-8, "{} m from the crowd at {travel_m} m", least_m(travel_m));
            }
            last_m = travel_m;
            Ok(())
        };
        for (ticks, event) in events {
            for _ in 0..ticks.min(60) {
                check(rehearsal.play().travel_m)?;
            }
            match event {
                Event::GuardRestart => rehearsal.restart_guard(),
                Event::Speed(speed_mps) => rehearsal.motion.request(Request::Speed { speed_mps }).expect("the value is in range"),
                Event::Hold => rehearsal.motion.request(Request::Hold).expect("hold is always accepted"),
                Event::Release => rehearsal.release(),
                Event::Miss(missed) => check(rehearsal.play_after(missed).travel_m)?,
                Event::Seek(_) => {}
            }
        }
        rehearsal.release();
        rehearsal.motion.request(Request::Speed { speed_mps: 3.0 }).expect("the value is in range");
        let head = rehearsal.play_to_rest();
        check(head.travel_m)?;
        if moved && head.state == ShowState::Held {
            let spare_m = (head.travel_m + 1e-6).min(lead.end_travel_m());
            let ahead = least_clearance(lead, head.travel_m, spare_m, |_| ()).expect("the search has no limit");
            let is_at_pair = ahead.is_some_and(|ahead| ahead.pair.clearance_m < rehearsal.margin_m + SPARE_M);
            prop_assert!(is_at_pair || least_m(head.travel_m) < clear_m + 1e-6, "it rests too early");
        }
    }
}

//! The monitor on frames of a simulation, without a bus. Its alerts do not depend on the intervals between the frames.

use bench_dragon::config::Config;
use bench_dragon::safety::forecast::Forecast;
use bench_dragon::safety::monitor::Monitor;
use bench_dragon::source::server::motion::{MotionPlan, MotionSettings};
use bench_dragon::source::server::{ServerSettings, Simulation};
use bench_dragon_ipc::{Alert, AlertKind, FrameHeader, HandleState, Request};

const FIRST_CONTACT_S: f64 = 412.473_837_682;

/// A show of the paper's dragon, and its monitor.
struct Rehearsal {
    simulation: Simulation,
    monitor: Monitor,
    handles: Vec<HandleState>,
    tick: u64,
    alerts: Vec<Alert>,
}

impl Rehearsal {
    fn new(time_scale: f64, start_s: f64) -> Self {
        let config =
            Config::load(None, |tables| tables.serve.time_scale = time_scale).expect("the paper's dragon is valid");
        let plan = MotionSettings {
            start_s,
            start_travel_m: start_s,
            ..MotionSettings::plain(config.tick_s(), 0.0, config.lead().end_travel_m())
        };
        Self {
            simulation: Simulation::new(
                config.formation().clone(),
                MotionPlan::new(plan).expect("the settings are sound"),
                config.tables().serve.rate_hz,
                time_scale,
            ),
            monitor: Monitor::new(&config),
            handles: vec![HandleState::default(); config.lead().dimensions().benches() + 1],
            tick: 0,
            alerts: Vec::new(),
        }
    }

    /// Plays one tick that the monitor does not get.
    fn lose_frame(&mut self) -> FrameHeader {
        self.simulation.tick(0, &mut ());
        let head = self.simulation.write(&mut self.handles);
        let header = head.header(1, self.tick, 0, 1.0, self.handles.len() as u32 - 1);
        self.tick += 1;
        header
    }

    /// Plays one tick that the monitor gets.
    fn play_frame(&mut self, forecast: Option<&Forecast>) -> FrameHeader {
        let header = self.lose_frame();
        self.monitor.observe(&header, &self.handles, forecast).expect("222 pairs are not neighbours");
        self.alerts.extend_from_slice(self.monitor.alerts());
        header
    }

    fn play_until(&mut self, show_time_s: f64) {
        while self.play_frame(None).show_time_s() < show_time_s {}
    }

    fn told(&self, kind: AlertKind) -> Vec<(f64, [u32; 2])> {
        let of_kind = self.alerts.iter().filter(|alert| alert.alert_kind() == Some(kind));
        of_kind.map(|alert| (alert.show_time_ns as f64 * 1e-9, alert.pair().expect("alerts of pairs"))).collect()
    }

    fn assert_first_contact(&self, what: &str) {
        let (time_s, pair) = *self.told(AlertKind::Contact).first().expect(what);
        assert_eq!(pair, [0, 8], "{what}");
        assert!((time_s - FIRST_CONTACT_S).abs() <= 2e-9, "{what}: contact at {time_s} s");
    }
}

#[test]
fn contact_is_exact_at_every_time_scale() {
    for time_scale in [1.0, 20.0, 400.0, 1000.0] {
        let mut rehearsal = Rehearsal::new(time_scale, 412.0);
        rehearsal.play_until(412.6);
        rehearsal.assert_first_contact(&format!("at {time_scale} times"));
    }
}

#[test]
fn contact_in_a_gap_of_lost_frames_is_found() {
    let mut rehearsal = Rehearsal::new(20.0, 410.0);
    rehearsal.play_frame(None);
    let mut last = rehearsal.lose_frame();
    while last.show_time_s() < 414.0 {
        last = rehearsal.lose_frame();
    }
    rehearsal.play_frame(None);
    rehearsal.assert_first_contact("after a gap of 4 s");
}

#[test]
fn a_contact_that_begins_and_ends_within_one_step_is_reported() {
    let mut rehearsal = Rehearsal::new(1000.0, 412.0);
    for _ in 0..5 {
        rehearsal.play_frame(None);
    }
    let parted = rehearsal.told(AlertKind::Parted);
    assert_eq!(parted.first().map(|(_, pair)| *pair), Some([0, 8]), "{parted:?}");
    rehearsal.assert_first_contact("steps of a whole second");
}

#[test]
fn every_frame_of_one_dragon_with_cues_is_swept() {
    let cues = "[[cues]]\nname = \"applause\"\nat_s = 100.0\nspeed_mps = 1.0\nwait = true\n";
    let config = Config::from_toml(&format!("{cues}[serve]\ntime_scale = 1000.0\n")).expect("a cue at 100 s");
    assert!(config.formation().has_plan_course());
    let start = ServerSettings::planned_start(&config, 412.0);
    let mut rehearsal = Rehearsal::new(1000.0, 412.0);
    rehearsal.simulation = Simulation::of_run(&config, &start, 1).expect("a sound start");
    rehearsal.monitor = Monitor::new(&config);
    for tick in 0..5 {
        rehearsal.simulation.tick(0, &mut ());
        let header = rehearsal.simulation.header(1, tick, 0);
        rehearsal.simulation.write(&mut rehearsal.handles);
        rehearsal.monitor.observe(&header, &rehearsal.handles, None).expect("222 pairs are not neighbours");
        rehearsal.alerts.extend_from_slice(rehearsal.monitor.alerts());
    }
    assert_eq!(rehearsal.monitor.unswept, 0);
    assert_eq!(rehearsal.told(AlertKind::Parted).first().map(|(_, pair)| *pair), Some([0, 8]));
    rehearsal.assert_first_contact("in a plan with a cue");
}

#[test]
fn the_near_miss_is_near_and_no_contact() {
    let mut rehearsal = Rehearsal::new(20.0, 407.0);
    rehearsal.play_until(411.0);
    assert!(rehearsal.told(AlertKind::Near).iter().any(|(_, pair)| *pair == [0, 11]));
    assert_eq!(rehearsal.told(AlertKind::Contact), []);
}

#[test]
fn each_pair_is_reported_once_when_it_comes_near_touches_and_parts() {
    let mut rehearsal = Rehearsal::new(20.0, 411.0);
    rehearsal.play_until(415.2);
    for kind in [AlertKind::Near, AlertKind::Contact, AlertKind::Parted] {
        let of_pair = rehearsal.told(kind).iter().filter(|(_, pair)| *pair == [0, 8]).count();
        assert_eq!(of_pair, 1, "{kind} of benches 0 and 8");
    }
}

#[test]
fn the_travel_across_a_seek_is_not_swept() {
    let mut rehearsal = Rehearsal::new(1.0, 100.0);
    rehearsal.play_frame(None);
    rehearsal.simulation.request(Request::Seek { show_time_s: 430.0 }).expect("430 s is inside the run");
    let header = rehearsal.play_frame(None);
    assert_eq!(header.show_time_s(), 430.0);
    let contacts = rehearsal.told(AlertKind::Contact);
    assert!(!contacts.is_empty(), "benches overlap at 430 s");
    assert!(contacts.iter().all(|(time_s, _)| *time_s == 430.0), "contacts are measured at 430 s only: {contacts:?}");
}

#[test]
fn a_change_of_speed_keeps_the_contact_at_its_place() {
    let mut rehearsal = Rehearsal::new(20.0, 412.0);
    rehearsal.play_frame(None);
    rehearsal.simulation.request(Request::Speed { speed_mps: 0.25 }).expect("0.25 m/s is allowed");
    rehearsal.play_until(414.0);
    let (time_s, pair) = rehearsal.told(AlertKind::Contact)[0];
    let expected_s = 412.0 + (FIRST_CONTACT_S - 412.0) / 0.25;
    assert_eq!(pair, [0, 8]);
    assert!((time_s - expected_s).abs() <= 1e-8, "contact at {time_s} s, expected at {expected_s} s");
}

#[test]
fn a_forecast_neither_hides_nor_moves_a_contact() {
    let free_to_m = FIRST_CONTACT_S - 1e-6;
    let forecast = Forecast { from_m: 0.0, free_to_m, contact: None, play: None };
    let mut rehearsal = Rehearsal::new(20.0, 412.0);
    while rehearsal.play_frame(Some(&forecast)).show_time_s() < 412.6 {}
    rehearsal.assert_first_contact("with a forecast of free ground");
}

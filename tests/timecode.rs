//! A motion that follows timecode, tick by tick, with no clock and no socket.

use bench_dragon::source::server::motion::{HeadState, Motion, MotionPlan, MotionSettings};
use bench_dragon::source::timecode::{
    Follower, FollowerEvent, FollowerSettings, Position, ShowPosition, TimecodeSample,
};
use bench_dragon_ipc::{Request, ShowState};

const RATE_HZ: u64 = 1000;
const TICK_NS: u64 = 1_000_000_000 / RATE_HZ;
const LAST_S: f64 = 400.0;
/// Seconds of a frame of timecode, and how many ticks it lasts.
const FRAME_S: f64 = 0.04;
const FRAME_TICKS: u64 = 40;
const DAY_S: f64 = 86_400.0;

/// A show, and the timecode source that it follows.
struct Rehearsal {
    rate_hz: u64,
    motion: Motion,
    follower: Follower,
    tick: u64,
    events: Vec<FollowerEvent>,
}

/// One tick: the head, its time scale and the position of the source's clock.
#[derive(Clone, Copy, Debug)]
struct Moment {
    head: HeadState,
    time_scale: f64,
    clock_s: Option<f64>,
}

impl Rehearsal {
    fn new(plan: MotionSettings) -> Self {
        Self::with_offset(plan, 0.0)
    }

    fn with_offset(plan: MotionSettings, offset_s: f64) -> Self {
        Self::at_rate(RATE_HZ, plan, offset_s)
    }

    fn at_rate(rate_hz: u64, plan: MotionSettings, offset_s: f64) -> Self {
        let period_s = 1.0 / rate_hz as f64;
        // Slow shows hear one packet per tick.
        let timeout_ns = (2_000_000_000 / rate_hz).max(1_000_000_000);
        let settings = FollowerSettings { offset_s, timeout_ns, period_s, first_s: 0.0, last_s: LAST_S };
        let mut motion = Motion::new(MotionPlan::new(plan).expect("the settings are sound"));
        motion.set_stands(true);
        Self { rate_hz, motion, follower: Follower::new(settings), tick: 0, events: Vec::new() }
    }

    /// Plays ticks. The source's clock is at `clock_s` of the seconds since the first tick. The source sends at the start of
    /// each timecode frame, and the packet arrives up to two ticks late. After a day, the clock starts again at 0.
    fn play(&mut self, ticks: u64, clock_s: impl Fn(f64) -> Option<f64>) -> Vec<Moment> {
        (0..ticks).map(|tick| self.tick(clock_s(tick as f64 / self.rate_hz as f64))).collect()
    }

    fn tick(&mut self, clock_s: Option<f64>) -> Moment {
        let due_ns = 5_000_000_000 + self.tick * 1_000_000_000 / self.rate_hz;
        let frame_ticks = (FRAME_TICKS * self.rate_hz / RATE_HZ).max(1);
        if let Some(position_s) = clock_s.filter(|_| self.tick.is_multiple_of(frame_ticks)) {
            let late_ns = self.tick / frame_ticks * 7 % 3 * TICK_NS;
            let position = Position { since_midnight_s: position_s.rem_euclid(DAY_S), day_s: DAY_S };
            self.follower.hear(TimecodeSample { position, arrived_ns: (due_ns + late_ns).saturating_sub(2 * TICK_NS) });
        }
        let (show_time_s, is_stopped) = (self.motion.next_sim_s(), self.motion.is_stopped());
        let show = ShowPosition { show_time_s, is_stopped, is_resumed: false };
        let (order, event) = self.follower.steer(due_ns, show);
        self.events.extend(event);
        if let Some(show_time_s) = order.seek_s {
            self.follower.note_seek(self.motion.request(Request::Seek { show_time_s }).is_ok());
        }
        self.motion.set_stands(order.stands);
        self.motion.set_tick(order.time_scale / self.rate_hz as f64);
        self.motion.advance();
        self.tick += 1;
        Moment { head: self.motion.head(), time_scale: order.time_scale, clock_s }
    }
}

fn plan() -> MotionSettings {
    MotionSettings::plain(1.0 / RATE_HZ as f64, 0.0, LAST_S)
}

impl Moment {
    fn sim_s(&self) -> f64 {
        self.head.show_time_ns as f64 * 1e-9
    }

    /// Delay of the show behind the source, in seconds.
    fn difference_s(&self) -> f64 {
        self.clock_s.expect("the clock's position is known") - self.sim_s()
    }
}

/// Checks that successive running ticks differ by the time scale ÷ the rate, and returns the ticks that jumped.
fn seeks(moments: &[Moment]) -> Vec<Moment> {
    let is_seek = |pair: &&[Moment]| {
        let step_s = pair[1].sim_s() - pair[0].sim_s();
        let is_step = (step_s - pair[1].time_scale / RATE_HZ as f64).abs() <= 1.5e-9;
        let is_rest = step_s == 0.0;
        assert!(is_step || is_rest || step_s.abs() > 0.5, "{pair:?}");
        !is_step && !is_rest
    };
    moments.windows(2).filter(is_seek).map(|pair| pair[1]).collect()
}

fn assert_near(moments: &[Moment], within_s: f64) {
    for moment in moments {
        assert!(moment.difference_s().abs() < within_s, "{moment:?}");
    }
}

#[test]
fn a_show_stands_until_the_first_timecode_and_seeks_to_it() {
    let mut rehearsal = Rehearsal::new(plan());
    let before = rehearsal.play(480, |_| None);
    assert!(before.iter().all(|moment| moment.head.state == ShowState::Paused && moment.head.show_time_ns == 0));
    let moments = rehearsal.play(10_000, |elapsed_s| Some(60.0 + elapsed_s));
    assert_eq!(seeks(&[&before[479..], &moments[..]].concat()).len(), 1);
    assert!(
        moments[..FRAME_TICKS as usize].iter().all(|moment| moment.head.show_time_ns == 0),
        "one packet alone is not followed"
    );
    assert_near(&moments[FRAME_TICKS as usize..], FRAME_S / 4.0);
    assert!(matches!(rehearsal.events[..], [FollowerEvent::Follows { .. }]), "{:?}", rehearsal.events);
}

#[test]
fn a_faster_or_slower_timecode_is_followed_without_a_jump() {
    for pace in [0.96, 0.999, 1.001, 1.04] {
        let mut rehearsal = Rehearsal::new(plan());
        let moments = rehearsal.play(40_000, |elapsed_s| Some(20.0 + pace * elapsed_s));
        assert_eq!(seeks(&moments[FRAME_TICKS as usize..]).len(), 0, "at pace {pace}");
        assert_near(&moments[20_000..], FRAME_S / 4.0);
        let mean = moments[20_000..].iter().map(|moment| moment.time_scale).sum::<f64>() / 20_000.0;
        assert!((mean - pace).abs() < 1e-3, "{mean} for {pace}");
    }
}

#[test]
fn a_pace_that_changes_at_once_costs_no_seek_and_is_followed_at_any_rate() {
    for (rate_hz, from, to) in [1, 2, 10, 1000]
        .into_iter()
        .flat_map(|rate| [(0.95, 1.05), (1.05, 0.95), (1.0, 1.0476), (1.0, 0.95)].map(|(from, to)| (rate, from, to)))
    {
        let mut rehearsal = Rehearsal::at_rate(rate_hz, plan(), 0.0);
        rehearsal.play(30 * rate_hz, |elapsed_s| Some(20.0 + from * elapsed_s));
        let changed_s = 20.0 + from * 30.0;
        let moments = rehearsal.play(60 * rate_hz, |elapsed_s| Some(changed_s + to * elapsed_s));
        for pair in moments.windows(2) {
            let step_s = pair[1].sim_s() - pair[0].sim_s();
            assert!((step_s - pair[1].time_scale / rate_hz as f64).abs() <= 1.5e-9, "{rate_hz} Hz, {to}: {pair:?}");
        }
        assert_near(&moments[50 * rate_hz as usize..], FRAME_S / 2.0);
    }
}

#[test]
fn a_small_difference_is_corrected_by_the_time_scale_and_never_backwards() {
    for leap_s in [-0.4, 0.4] {
        let mut rehearsal = Rehearsal::new(plan());
        rehearsal.play(2_000, |elapsed_s| Some(20.0 + elapsed_s));
        let moments = rehearsal.play(30_000, |elapsed_s| Some(22.0 + leap_s + elapsed_s));
        assert_eq!(seeks(&moments).len(), 0);
        for pair in moments.windows(2) {
            assert!(pair[1].head.show_time_ns > pair[0].head.show_time_ns);
            assert!((Follower::LEAST_TIME_SCALE..=Follower::GREATEST_TIME_SCALE).contains(&pair[1].time_scale));
        }
        assert_near(&moments[25_000..], FRAME_S / 4.0);
    }
}

#[test]
fn a_large_difference_is_one_seek() {
    let mut rehearsal = Rehearsal::new(plan());
    let mut before = rehearsal.play(2_000, |elapsed_s| Some(20.0 + elapsed_s));
    for start_s in [200.0, 5.0] {
        let moments = rehearsal.play(5_000, |elapsed_s| Some(start_s + elapsed_s));
        assert_near(&moments[FRAME_TICKS as usize..], FRAME_S / 4.0);
        before.extend(moments);
    }
    let seeks: Vec<f64> = seeks(&before[100..]).iter().map(|moment| moment.sim_s().round()).collect();
    assert_eq!(seeks, [200.0, 5.0]);
}

#[test]
fn without_timecode_the_show_continues_by_itself_until_it_returns() {
    let mut rehearsal = Rehearsal::new(plan());
    rehearsal.play(20_000, |elapsed_s| Some(20.0 + 1.02 * elapsed_s));
    let alone = rehearsal.play(5_000, |_| None);
    assert_eq!(seeks(&alone).len(), 0);
    assert!(alone.iter().all(|moment| moment.head.state == ShowState::Running));
    assert!(alone[1_100..].iter().all(|moment| moment.time_scale == 1.0));
    let back_s = alone[4_999].sim_s() + 0.2;
    let moments = rehearsal.play(30_000, |elapsed_s| Some(back_s + elapsed_s));
    assert_eq!(seeks(&moments).len(), 0);
    assert_near(&moments[25_000..], FRAME_S / 4.0);
    let names = [
        matches!(rehearsal.events[0], FollowerEvent::Follows { .. }),
        matches!(rehearsal.events[1], FollowerEvent::Lost { .. }),
    ];
    assert!(
        names == [true; 2] && matches!(rehearsal.events[2], FollowerEvent::Follows { .. }),
        "{:?}",
        rehearsal.events
    );
    assert_eq!(rehearsal.events.len(), 3);
}

#[test]
fn a_standing_timecode_stops_the_show_also_if_it_is_lost_then() {
    let mut rehearsal = Rehearsal::new(plan());
    rehearsal.play(2_000, |elapsed_s| Some(20.0 + elapsed_s));
    let standing = rehearsal.play(1_000, |_| Some(21.96));
    let rest = standing[200].head;
    assert_eq!(
        (rest.state, rest.show_time_ns),
        (ShowState::Paused, 21_960_000_000),
        "the head rests at the position of the timecode"
    );
    assert!(standing[200..].iter().all(|moment| moment.head == rest));
    let lost = rehearsal.play(3_000, |_| None);
    assert!(lost.iter().all(|moment| moment.head == rest), "a lost timecode does not start a stopped show");
    let moments = rehearsal.play(20_000, |elapsed_s| Some(21.96 + elapsed_s));
    assert_eq!(seeks(&moments).len(), 0);
    assert_near(&moments[15_000..], FRAME_S / 4.0);
}

#[test]
fn before_the_runs_start_the_show_stands_there_and_after_its_end_it_is_finished() {
    let mut rehearsal = Rehearsal::with_offset(plan(), -62.0);
    let moments = rehearsal.play(5_000, |elapsed_s| Some(60.0 + elapsed_s));
    assert!(moments[..1_990].iter().all(|moment| moment.head.show_time_ns == 0));
    assert!((moments[4_999].sim_s() - 2.999).abs() < FRAME_S, "{:?}", moments[4_999]);
    let moments = rehearsal.play(3_000, |elapsed_s| Some(460.0 + elapsed_s));
    assert_eq!(moments[2_999].head.state, ShowState::Finished);
    let moments = rehearsal.play(1_000, |elapsed_s| Some(72.0 + elapsed_s));
    assert_eq!(moments[999].head.state, ShowState::Running, "the show plays again");
    assert!((moments[999].sim_s() - 10.999).abs() < FRAME_S, "{:?}", moments[999]);
}

#[test]
fn a_show_starts_on_time_if_its_timecode_is_lost_before_the_cue() {
    let mut rehearsal = Rehearsal::with_offset(plan(), -62.0);
    rehearsal.play(1_000, |elapsed_s| Some(55.0 + elapsed_s));
    let moments = rehearsal.play(10_000, |_| None);
    let (before, after) = moments.split_at(5_997);
    assert!(before.iter().all(|moment| (moment.head.state, moment.head.show_time_ns) == (ShowState::Paused, 0)));
    assert!((after[3_999].sim_s() - 3.998).abs() < 0.01, "{:?}", after[3_999]);
    assert!(
        matches!(rehearsal.events[..], [FollowerEvent::Follows { .. }, FollowerEvent::Lost { .. }]),
        "{:?}",
        rehearsal.events
    );
}

#[test]
fn one_stray_packet_moves_nothing() {
    for stray_s in [0.0, 25.0, 300.0, LAST_S, 50_000.0] {
        let astray = |elapsed_s: f64, position_s| Some(if elapsed_s == 1.0 { stray_s } else { position_s });
        let mut rehearsal = Rehearsal::new(plan());
        let mut moments = rehearsal.play(2_000, |elapsed_s| Some(20.0 + elapsed_s));
        moments.extend(rehearsal.play(2_000, |elapsed_s| astray(elapsed_s, 22.0 + elapsed_s)));
        moments.retain(|moment| moment.clock_s != Some(stray_s));
        assert_near(&moments[FRAME_TICKS as usize..], FRAME_S / 4.0);
        rehearsal.play(1_000, |_| Some(23.96));
        let rest = rehearsal.motion.head();
        let standing = rehearsal.play(2_000, |elapsed_s| astray(elapsed_s, 23.96));
        assert!(standing.iter().all(|moment| moment.head == rest), "{stray_s}");
        assert!(
            matches!(rehearsal.events[..], [FollowerEvent::Follows { .. }, FollowerEvent::Stands { .. }]),
            "{:?}",
            rehearsal.events
        );
    }
}

#[test]
fn a_show_continues_past_midnight() {
    let mut rehearsal = Rehearsal::with_offset(plan(), -86_340.0);
    let moments = rehearsal.play(20_000, |elapsed_s| Some(86_390.0 + elapsed_s));
    let moments = &moments[FRAME_TICKS as usize..];
    assert_eq!(seeks(moments).len(), 0);
    assert!(moments.iter().all(|moment| (moment.difference_s() - 86_340.0).abs() < FRAME_S / 4.0));
}

#[test]
fn before_midnight_a_show_that_starts_then_stands_at_its_start() {
    let mut rehearsal = Rehearsal::new(plan());
    let moments = rehearsal.play(20_000, |elapsed_s| Some(86_390.0 + elapsed_s));
    assert!(
        moments[..9_990].iter().all(|moment| (moment.head.state, moment.head.show_time_ns) == (ShowState::Paused, 0))
    );
    assert!((moments[19_999].difference_s() - DAY_S).abs() < FRAME_S, "{:?}", moments[19_999]);
}

/// With an acceleration, the head brakes for two seconds from 1 m/s, during which show time continues.
#[test]
fn a_head_that_brakes_for_a_standing_timecode_is_not_moved_back() {
    let mut rehearsal = Rehearsal::new(MotionSettings { accel_mps2: Some(0.5), ..plan() });
    let mut moments = rehearsal.play(10_000, |elapsed_s| Some(20.0 + elapsed_s));
    moments.extend(rehearsal.play(6_000, |_| Some(29.96)));
    assert_eq!(moments[15_999].head.state, ShowState::Paused);
    assert!((moments[15_999].sim_s() - 32.1).abs() < 0.1, "{:?}", moments[15_999]);
    moments.extend(rehearsal.play(80_000, |elapsed_s| Some(29.96 + elapsed_s)));
    for pair in moments[FRAME_TICKS as usize..].windows(2) {
        let walked_m = pair[1].head.travel_m - pair[0].head.travel_m;
        assert!((0.0..0.002).contains(&walked_m) && pair[1].sim_s() >= pair[0].sim_s(), "{pair:?}");
    }
    assert_near(&moments[95_000..], FRAME_S);
    // A large jump of the source is a seek.
    let moments = rehearsal.play(1_000, |elapsed_s| Some(200.0 + elapsed_s));
    assert_near(&moments[FRAME_TICKS as usize..], FRAME_S / 4.0);
}

#[test]
fn the_timecode_leads_until_it_is_lost() {
    let mut rehearsal = Rehearsal::new(plan());
    let mut leads = |ticks, clock_s: Option<f64>| {
        rehearsal.play(ticks, |elapsed_s| clock_s.map(|clock_s| clock_s + elapsed_s));
        rehearsal.follower.leads()
    };
    assert_eq!([leads(100, None), leads(2_000, Some(20.0)), leads(2_000, None)], [false, true, false]);
}

#[test]
fn an_operators_stop_overrides_the_timecode_and_the_missed_time_is_one_seek() {
    for (stop, go) in [(Request::Pause, Request::Resume), (Request::Hold, Request::Release)] {
        let mut rehearsal = Rehearsal::new(plan());
        rehearsal.play(2_000, |elapsed_s| Some(20.0 + elapsed_s));
        rehearsal.motion.request(stop).expect("the command is accepted");
        let stopped = rehearsal.play(2_000, |elapsed_s| Some(22.0 + elapsed_s));
        assert!(stopped.iter().all(|moment| moment.head.show_time_ns == stopped[0].head.show_time_ns));
        rehearsal.motion.request(go).expect("the command is accepted");
        let moments = rehearsal.play(2_000, |elapsed_s| Some(24.0 + elapsed_s));
        assert_eq!(seeks(&moments).len(), 0, "the first tick is already at the timecode");
        assert_near(&moments[1..], FRAME_S / 2.0);
    }
}

#[test]
fn a_guarded_show_seeks_to_the_timecode_where_its_travel_is_proved() {
    let mut rehearsal = Rehearsal::new(MotionSettings { guarded_run: Some(7), ..plan() });
    let moments = rehearsal.play(1_000, |elapsed_s| Some(100.0 + elapsed_s));
    assert!(moments.iter().all(|moment| moment.head.show_time_ns == 0));
    let asked_m = rehearsal.motion.limits().asked_m.expect("the motion asks for a proof");
    assert!((100.0..101.0).contains(&asked_m), "{asked_m}");
    let grant = Request::Grant { run_id: 7, from_m: asked_m, to_m: asked_m + 5.0, is_final: false };
    rehearsal.motion.request(grant).expect("the grant is for this run");
    let moments = rehearsal.play(2_000, |elapsed_s| Some(101.0 + elapsed_s));
    assert_near(&moments[200..], FRAME_S);
}

#[test]
fn a_walk_keeps_its_travel_where_the_time_scale_changes() {
    for accel_mps2 in [None, Some(0.5)] {
        let mut motion =
            Motion::new(MotionPlan::new(MotionSettings { accel_mps2, ..plan() }).expect("the settings are sound"));
        motion.advance();
        let mut ticks_s = 0.0;
        for tick in 0..20_000_u32 {
            if tick % 40 == 0 {
                motion.set_tick((1.0 + 0.1 * f64::from(tick % 7) / 7.0) / RATE_HZ as f64);
            }
            let next_s = motion.next_sim_s();
            motion.advance();
            ticks_s = motion.head().show_time_ns as f64 * 1e-9;
            assert!((next_s - ticks_s).abs() < 1e-9);
        }
        let expected_m = accel_mps2.map_or(ticks_s, |_| ticks_s - 1.0);
        assert!((motion.head().travel_m - expected_m).abs() < 1e-8, "{:?} at {ticks_s}", motion.head());
    }
}

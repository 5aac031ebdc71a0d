//! Loose hinges: no pose that the play allows touches before the guaranteed travel, and some pose touches soon after it.
//!
//! The poses are made here, from the definition and with a follower of its own: the poles walk on the spiral r = b·θ, two
//! neighbours from d − 2c to d + 2c apart, and each hole is within c of its pole.

#![allow(clippy::print_stdout, reason = "a test prints its figures")]

use std::f64::consts::TAU;
use std::sync::Arc;
use std::thread;

use bench_dragon_geometry::clearance::{
    ClearanceSearch, PlayEnd, PlaySearch, PossibleTouch, ProvenTravel, first_breach, first_possible_touch,
    first_touching_pose, play_reach_m,
};
use bench_dragon_geometry::dragon::{Board, Dimensions, Dragon, Meter};
use bench_dragon_geometry::route::Route;
use bench_dragon_geometry::stage::{Border, Outline, Stage};
use fastrand::Rng;
use glam::DVec2;
use test_support::dragons::paper_benches;
use test_support::property::case_count;

const PITCH_M: f64 = 0.55;
const START_TURNS: f64 = 16.0;
/// Benches of the random poses: a turn and a half. Those behind repeat their poses.
const BENCHES: usize = 14;
/// Number of random poses, and threads that draw them.
const POSES: u32 = 1_000_000;
const THREADS: u32 = 2;

fn dragon(benches: usize, pole_m: f64) -> Dragon {
    let dimensions = paper_benches(benches).with_poles(0.055, pole_m).expect("valid poles");
    Dragon::new(dimensions, Arc::new(Route::spiral(PITCH_M, START_TURNS).expect("the paper's spiral")))
        .expect("it stands")
}

fn earliest(dragon: &Dragon) -> PossibleTouch {
    let mut search = PlaySearch::at(dragon, 0.0, 0.0).expect("no limit").expect("the hinges have play");
    search.advance(dragon.end_travel_m()).expect("no limit").expect("the paper's dragon touches itself")
}

/// A point of the spiral, at an angle from its centre.
fn at(angle: f64) -> DVec2 {
    DVec2::from_angle(angle) * (PITCH_M / TAU * angle)
}

/// The angle behind `angle` at which the distance is `length_m`: Newton's method from outside.
fn behind(angle: f64, length_m: f64) -> f64 {
    let front = at(angle);
    let mut rear = angle + length_m / (PITCH_M / TAU * angle) * 1.2;
    for _ in 0..20 {
        let (outward, radius_m) = (DVec2::from_angle(rear), PITCH_M / TAU * rear);
        let chord = radius_m * outward - front;
        let gap_m = chord.length() - length_m;
        if gap_m.abs() < 1e-13 {
            break;
        }
        let velocity = PITCH_M / TAU * outward + radius_m * outward.perp();
        rear -= gap_m * chord.length() / chord.dot(velocity);
    }
    assert!((at(rear).distance(front) - length_m).abs() < 1e-12, "the follower reaches its distance");
    rear
}

/// Angle of the head after a travel: Newton's method on the closed form of the arc.
fn head_angle(travel_m: f64) -> f64 {
    let arc = |angle: f64| 0.5 * PITCH_M / TAU * (angle * angle.hypot(1.0) + angle.asinh());
    let wanted_m = arc(TAU * START_TURNS) - travel_m;
    let mut angle = TAU * START_TURNS;
    for _ in 0..50 {
        angle -= (arc(angle) - wanted_m) / (PITCH_M / TAU * angle.hypot(1.0));
    }
    angle
}

/// How a bench lies on its poles: its heading turns by `turn` from the line of the poles, and the middle of its holes is `middle`
/// off that of the poles, in metres, along and across that line.
#[derive(Clone, Copy, Default)]
struct Lie {
    turn: f64,
    middle: DVec2,
}

/// The board that lies so; `None` if a hole would leave its pole.
fn board(dimensions: &Dimensions, bench: usize, [front, rear]: [DVec2; 2], lie: Lie) -> Option<Board> {
    let line = (front - rear).normalize();
    let middle = 0.5 * (front + rear) + line.rotate(lie.middle);
    let half = 0.5 * dimensions.link_m(bench) * line.rotate(DVec2::from_angle(lie.turn));
    let [hole, other] = [middle + half, middle - half];
    let holds = hole.distance(front).max(other.distance(rear)) <= dimensions.play_m() + 1e-9;
    holds.then(|| Board::from_handles(hole, other, dimensions.length_m(bench), dimensions.width_m()))
}

/// The lie with a share of the greatest turn that the distance of the poles leaves, and with the middle as far off in a direction
/// as a share of what is then left.
fn lie_of(dimensions: &Dimensions, bench: usize, poles: [DVec2; 2], turn_share: f64, off: DVec2) -> Lie {
    let (play_m, link_m) = (dimensions.play_m(), dimensions.link_m(bench));
    let longer_m = 0.5 * (poles[0].distance(poles[1]) - link_m);
    let most_m = (play_m * play_m - longer_m * longer_m).max(0.0).sqrt();
    let mut turn = (turn_share * 2.0 * most_m / link_m).asin();
    let offset_of = |turn: f64| 0.5 * (link_m * DVec2::from_angle(turn) - DVec2::X * poles[0].distance(poles[1]));
    // A turned board is shorter along the line.
    while offset_of(turn).length() > play_m + 1e-12 {
        turn *= 0.9;
    }
    let offset = offset_of(turn);
    Lie { turn, middle: (play_m - offset.length()).max(0.0) * off }
}

/// A random lie. Many are at the limit of the play.
fn random_lie(random: &mut Rng, dimensions: &Dimensions, bench: usize, poles: [DVec2; 2]) -> Lie {
    let turn_share = [2.0 * random.f64() - 1.0, 1.0, -1.0][random.usize(..3)];
    let share = if random.bool() { 1.0 } else { random.f64().sqrt() };
    lie_of(dimensions, bench, poles, turn_share, share * DVec2::from_angle(TAU * random.f64()))
}

/// A link's length: any, or one of the extremes.
fn random_length(random: &mut Rng, dimensions: &Dimensions, bench: usize, style: u8) -> f64 {
    let share = match style {
        0 => 2.0 * random.f64() - 1.0,
        1 => 1.0,
        2 => -1.0,
        _ => [-1.0, 1.0][random.usize(..2)],
    };
    dimensions.link_m(bench) + 2.0 * share * dimensions.play_m()
}

/// The least clearance of random poses with the head up to 30 m before a travel, most of them shortly before.
fn least_clearance_m(dimensions: &Dimensions, to_m: f64, poses: u32, seed: u64) -> f64 {
    let mut random = Rng::with_seed(seed);
    let (mut search, mut boards, mut least_m) = (ClearanceSearch::default(), Vec::new(), f64::INFINITY);
    for _ in 0..poses {
        let mut angle = head_angle(to_m - 30.0 * random.f64().powi(2));
        let style = random.u8(..4);
        boards.clear();
        for bench in 0..dimensions.benches() {
            let rear = behind(angle, random_length(&mut random, dimensions, bench, style));
            let poles = [at(angle), at(rear)];
            let lie = random_lie(&mut random, dimensions, bench, poles);
            boards.push(board(dimensions, bench, poles, lie).expect("an allowed lie"));
            angle = rear;
        }
        least_m = least_m.min(search.nearest(&boards).expect("there are pairs").clearance_m);
    }
    least_m
}

#[test]
fn a_million_random_poses_never_touch_before_the_guaranteed_travel() {
    let dragon = dragon(BENCHES, 0.050);
    let free_to_m = earliest(&dragon).travel_m;
    let poses = case_count(POSES) / THREADS;
    let draw = |seed| least_clearance_m(dragon.dimensions(), free_to_m, poses, seed);
    let least_m = thread::scope(|scope| {
        let threads: Vec<_> = (0..THREADS).map(|seed| scope.spawn(move || draw(u64::from(seed)))).collect();
        threads.into_iter().map(|thread| thread.join().expect("no panic")).fold(f64::INFINITY, f64::min)
    });
    assert!(least_m > 0.0 && least_m < 0.01, "least clearance {least_m} m");
}

/// The lies of a bench that reach furthest, for a few turns.
fn extreme_lies(dimensions: &Dimensions, bench: usize, poles: [DVec2; 2], towards: DVec2) -> Vec<Lie> {
    let (play_m, link_m) = (dimensions.play_m(), dimensions.link_m(bench));
    let most = (2.0 * play_m / link_m).asin();
    let line = (poles[0] - poles[1]).normalize();
    let towards = DVec2::new(line.dot(towards), line.perp_dot(towards));
    let turns = (-8..=8).map(|k| most * f64::from(k) / 8.0);
    let lie = |turn: f64| {
        let offset = 0.5 * (link_m * DVec2::from_angle(turn) - DVec2::X * poles[0].distance(poles[1]));
        // The middle is within c of both −offset and +offset: as far as possible towards, by bisection.
        let (mut low, mut high) = (0.0, 2.0 * play_m);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            let fits = [offset, -offset].iter().all(|&other| (towards * middle + other).length() <= play_m);
            if fits { low = middle } else { high = middle }
        }
        (offset.length() <= play_m).then_some(Lie { turn, middle: towards * low })
    };
    turns.filter_map(lie).collect()
}

/// Whether some pose touches with the head at a travel: the pair of benches `first` and `first + offset`, with links of all
/// lengths between.
fn touches(dimensions: &Dimensions, travel_m: f64, first: usize, offset: usize) -> bool {
    let play_m = dimensions.play_m();
    let lengths = |bench: usize, steps: i32| {
        (-steps..=steps).map(move |k| dimensions.link_m(bench) + 2.0 * play_m * f64::from(k) / f64::from(steps))
    };
    let mut front = head_angle(travel_m);
    for bench in 0..first {
        front = behind(front, dimensions.link_m(bench) - 2.0 * play_m);
    }
    lengths(first, 4).any(|own_m| {
        let second = behind(front, own_m);
        lengths(1, 40).any(|between_m| {
            let mut other = second;
            for _ in first + 1..first + offset {
                other = behind(other, between_m);
            }
            lengths(1, 4).any(|other_m| {
                let [ours, theirs] = [[front, second], [other, behind(other, other_m)]].map(|angles| angles.map(at));
                let nominal = [(first, ours), (first + offset, theirs)]
                    .map(|(bench, [a, b])| Board::from_handles(a, b, dimensions.length_m(bench), dimensions.width_m()));
                let approach = nominal[0].approach(&nominal[1]);
                if approach.clearance_m > 6.0 * play_m {
                    return false;
                }
                let ours_lies = extreme_lies(dimensions, first, ours, approach.direction);
                let their_lies = extreme_lies(dimensions, first + offset, theirs, -approach.direction);
                let our_boards = ours_lies.iter().filter_map(|&lie| board(dimensions, first, ours, lie));
                let their_boards: Vec<Board> =
                    their_lies.iter().filter_map(|&lie| board(dimensions, first + offset, theirs, lie)).collect();
                our_boards.into_iter().any(|ours| their_boards.iter().any(|theirs| ours.overlaps(theirs)))
            })
        })
    })
}

#[test]
fn some_pose_touches_within_half_a_metre_of_the_guaranteed_travel() {
    let dragon = dragon(223, 0.050);
    let earliest_m = earliest(&dragon).travel_m;
    let touches_at =
        |travel_m: f64| (0..2).any(|first| (7..13).any(|offset| touches(dragon.dimensions(), travel_m, first, offset)));
    assert!(!touches_at(earliest_m), "a pose touches at {earliest_m} m");
    let found = (1..=10).map(|step| earliest_m + 0.05 * f64::from(step)).find(|&travel_m| touches_at(travel_m));
    println!("guaranteed {earliest_m} m, a pose touches at {found:?}");
    assert!(found.is_some(), "no pose touches up to half a metre after {earliest_m} m");
}

#[test]
fn a_near_miss_of_one_and_a_half_plays_does_not_end_the_proof() {
    let dimensions = Dimensions::new(13, 2.17, 1.77, 0.3, 0.22).expect("benches");
    let dimensions = dimensions.with_poles(0.06, 0.05).expect("valid poles");
    let dragon = Dragon::new(dimensions, Arc::new(Route::spiral(0.501, 4.58).expect("a spiral"))).expect("it stands");
    // The nearest poses of benches 0 and 9 that a search finds are 7 mm apart, at 11.1 m.
    let earliest_m = earliest(&dragon).travel_m;
    let pose = first_touching_pose(&dragon, 0.0, earliest_m, dragon.end_travel_m()).expect("no limit");
    let pose = pose.expect("a pose touches");
    println!("guaranteed {earliest_m} m, {pose:?}");
    assert!(earliest_m > 14.0 && pose.travel_m < earliest_m + 0.5, "{earliest_m} m, {pose:?}");
}

#[test]
fn the_guards_proof_ends_where_a_pose_may_come_under_the_margin() {
    let dragon = dragon(60, 0.050);
    for margin_m in [0.0005, 0.01] {
        let mut search = PlaySearch::at(&dragon, margin_m, 0.0).expect("no limit").expect("the hinges have play");
        let touch = search.advance(dragon.end_travel_m()).expect("no limit").expect("it comes near itself");
        let mut proven = ProvenTravel::at(&dragon, margin_m, 300.0).expect("it stands free");
        proven.extend(dragon.end_travel_m(), usize::MAX);
        assert!((proven.end_m() - touch.travel_m).abs() < 2e-3, "{} {touch:?}", proven.end_m());
        assert!(proven.is_whole());
        // Where the nominal pose is free, but another one is not, there is no proof.
        let rigid = Dragon::new(paper_benches(60), Arc::new(dragon.route().clone())).expect("it stands");
        let differs = |travel_m: &f64| {
            let [loose, rigid] = [&dragon, &rigid].map(|dragon| ProvenTravel::at(dragon, margin_m, *travel_m).is_ok());
            !loose && rigid
        };
        assert!((0..60).map(|step| touch.travel_m + 0.1 * f64::from(step)).any(|travel_m| differs(&travel_m)));
    }
}

/// A square about the centre of the spiral that no board may enter.
fn stage(clear_m: f64) -> Stage {
    let corners = [[-0.8, -0.8], [0.8, -0.8], [0.8, 0.8], [-0.8, 0.8]];
    Stage::new(vec![Border::keep_out(Outline::new(&corners).expect("a square"))], clear_m)
}

/// The least distance from the borders of a stage in random poses, with the head up to 3 m before a travel.
fn least_distance_m(dimensions: &Dimensions, stage: &Stage, to_m: f64, poses: u32, seed: u64) -> f64 {
    let (mut random, mut least_m) = (Rng::with_seed(seed), f64::INFINITY);
    for _ in 0..poses {
        let (mut angle, style) = (head_angle(to_m - 3.0 * random.f64().powi(2)), random.u8(..4));
        // Benches further behind are further out.
        for bench in 0..4 {
            let rear = behind(angle, random_length(&mut random, dimensions, bench, style));
            let poles = [at(angle), at(rear)];
            let lie = random_lie(&mut random, dimensions, bench, poles);
            let board = board(dimensions, bench, poles, lie).expect("an allowed lie");
            let distances_m = stage.borders().iter().map(|border| border.distance_m(&board));
            least_m = distances_m.fold(least_m, f64::min);
            angle = rear;
        }
    }
    least_m
}

#[test]
fn no_pose_that_the_play_allows_comes_too_near_to_a_border_on_proven_travel() {
    let run = Route::spiral(PITCH_M, START_TURNS).and_then(|spiral| spiral.between(0.0, 400.0));
    let run = Arc::new(run.expect("the paper's spiral"));
    let dimensions = paper_benches(BENCHES).with_poles(0.055, 0.050).expect("valid poles");
    let loose = Dragon::new(dimensions, Arc::clone(&run)).expect("it stands");
    let rigid = Dragon::new(paper_benches(BENCHES), run).expect("it stands");
    let reach_m = play_reach_m(&loose, 0).expect("wide bends").max(play_reach_m(&loose, 1).expect("wide bends"));
    assert!(reach_m > 0.005 && reach_m < 0.015 && play_reach_m(&rigid, 0) == Some(0.0), "{reach_m} m");
    for clear_m in [1.3, 1.6] {
        let border = stage(clear_m);
        let proven_m = |dragon: &Dragon, from_m: f64| {
            let proven = ProvenTravel::at(dragon, 0.0, from_m).expect("it stands free");
            let mut proven = proven.within_borders(&border).expect("it is far from the centre");
            proven.extend(dragon.end_travel_m(), usize::MAX);
            assert!(proven.is_whole(), "{}", proven.end_m());
            proven.end_m()
        };
        let [end_m, rigid_m] = [&loose, &rigid].map(|dragon| proven_m(dragon, 200.0));
        let nominal = |clear_m: f64| {
            let breach = first_breach(&rigid, &stage(clear_m), clear_m).expect("no limit").expect("it comes near");
            breach.travel_m
        };
        // The play takes some travel, and not more than its bound does.
        assert!(end_m < rigid_m - 1e-3 && (rigid_m - nominal(clear_m)).abs() < 1e-6, "{end_m} m, {rigid_m} m");
        assert!(end_m > nominal(clear_m + reach_m) - 0.05, "{end_m} m, {} m", nominal(clear_m + reach_m));
        assert!((proven_m(&loose, end_m - 1.0) - end_m).abs() < 1e-3, "a later proof ends at the same place");
        let least = |to_m: f64| least_distance_m(loose.dimensions(), &border, to_m, 100_000, 3);
        let (least_m, later_m) = (least(end_m), least(rigid_m));
        println!(
            "clear {clear_m} m: proven to {end_m} m, without play to {rigid_m} m; least {least_m} m, then {later_m} m"
        );
        assert!(least_m >= clear_m - 1e-9, "a pose is {least_m} m near on proven travel");
        assert!(later_m < clear_m - 1e-3, "without the play in the proof, poses would be too near: {later_m} m");
        // A corner of the square may be behind the dragon soon, but not at once.
        let refused = (1..=1000_u32).find_map(|step| {
            let proven = ProvenTravel::at(&loose, 0.0, end_m + 0.001 * f64::from(step)).ok()?;
            proven.within_borders(&border).err()
        });
        assert!(refused.is_some_and(|breach| breach.bench < 2), "nothing is proved behind {end_m} m: {refused:?}");
    }
    // The whole spiral has bends that are too tight for the bound.
    let tight = dragon(BENCHES, 0.050);
    assert_eq!(play_reach_m(&tight, 0), None);
    let proven = ProvenTravel::at(&tight, 0.0, 100.0).expect("it stands free");
    assert!(proven.within_borders(&stage(1.0)).is_err(), "nothing is proved without a bound");
}

#[test]
fn nothing_is_proved_where_a_pole_might_stop() {
    // The brackets of the poles end at 432.497 m, the run at 432.758 m.
    let dragon = dragon(3, 0.020);
    let travel_m = dragon.end_travel_m() - 1e-4;
    let search = PlaySearch::at(&dragon, 0.0, travel_m).expect("no limit").expect("the hinges have play");
    assert!(!search.is_known_here() && search.end_m() < travel_m && search.touch_here().is_none());
    let end = first_possible_touch(&dragon, 0.0, travel_m, dragon.end_travel_m()).expect("no limit");
    assert_eq!(end, Some(PlayEnd { travel_m, benches: None }));
    assert!(ProvenTravel::at(&dragon, 0.0005, travel_m).is_err());
    let mut proven = ProvenTravel::at(&dragon, 0.0005, search.end_m() - 0.1).expect("the poses are known there");
    proven.extend(dragon.end_travel_m(), usize::MAX);
    assert!(proven.is_whole() && proven.end_m() <= search.end_m() && proven.end_m() >= proven.begin_m());
}

#[test]
fn a_search_without_work_left_proves_nothing() {
    let dragon = dragon(60, 0.050);
    let metered = dragon.metered(&Meter::of(100));
    assert!(ProvenTravel::at(&metered, 0.0005, 100.0).is_err());
    assert!(ProvenTravel::at(&dragon, 0.0005, 100.0).is_ok());
}

#[test]
fn a_search_that_starts_later_or_in_parts_finds_the_same() {
    let dragon = dragon(40, 0.052);
    let whole = earliest(&dragon);
    for from_m in [100.0, 401.3, whole.travel_m - 0.3] {
        let mut search = PlaySearch::at(&dragon, 0.0, from_m).expect("no limit").expect("the hinges have play");
        let mut to_m = from_m;
        let touch = std::iter::from_fn(|| {
            to_m += 0.7;
            Some(search.advance(to_m).expect("no limit"))
        });
        let touch = touch.take(1000).flatten().next().expect("it touches");
        assert!((touch.travel_m - whole.travel_m).abs() < 0.02, "from {from_m}: {touch:?}, not {whole:?}");
    }
}

#[test]
fn without_play_nothing_changes() {
    let rigid = paper_benches(40);
    let snug = rigid.with_poles(0.055, 0.055).expect("valid poles");
    assert_eq!((snug, snug.play_m()), (rigid, 0.0));
    let dragon =
        Dragon::new(snug, Arc::new(Route::spiral(PITCH_M, START_TURNS).expect("a spiral"))).expect("it stands");
    assert!(dragon.taut().is_none() && PlaySearch::at(&dragon, 0.0, 0.0).expect("no limit").is_none());
}

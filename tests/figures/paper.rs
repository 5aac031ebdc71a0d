//! The paper's dragon on its routes, as input of the figures.

use bench_dragon::output::figure::{
    Caption, ChartQuantity, Circle, ClearanceOverTime, ContactMark, ContactView, DragonInPlan, Drawing, HandleSpeed,
    LargestSpeed, NearMissMark, NearestPair, PlanView, SensitivityChart, SpeedLine, SpeedProfile, SpeedRange,
    SpeedsOverTime, StageInPlan, TurnMarks,
};
use bench_dragon_geometry::clearance::{ClearanceSearch, PairClearance, first_contact};
use bench_dragon_geometry::dragon::{Board, Handle};
use bench_dragon_geometry::planner::{QuickestRun, RunLimits};
use bench_dragon_geometry::route::Route;
use glam::DVec2;
use test_support::dragons::{boards_at, handles_at, paper_dragon, paper_turnaround, turning_dragon};

/// Every figure with its name.
pub(crate) fn drawings() -> [(&'static str, Drawing); 7] {
    [
        ("plan", plan_view().draw()),
        ("turnaround", turning_plan_view().draw()),
        ("contact", contact_view().draw()),
        ("clearance", clearance_over_time().draw()),
        ("speeds", speeds_over_time().draw()),
        ("profile", speed_profile().draw()),
        ("sensitivity", sensitivity().draw()),
    ]
}

fn corners(boards: &[Board]) -> Vec<[DVec2; 4]> {
    boards.iter().map(Board::corners).collect()
}

fn polyline(route: &Route, from_m: f64, to_m: f64) -> Vec<DVec2> {
    let steps = ((to_m - from_m) / 0.1).ceil();
    let travel_m = |step: i32| from_m + (to_m - from_m) * f64::from(step) / steps;
    (0..=steps as i32).map(|step| route.point(route.parameter(travel_m(step))).position).collect()
}

fn positions(handles: &[Handle]) -> Vec<DVec2> {
    handles.iter().map(|handle| handle.position).collect()
}

pub(crate) fn plan_view() -> PlanView {
    let dragon = paper_dragon();
    let handles = handles_at(&dragon, 300.0);
    PlanView {
        caption: Caption::new("The dragon at 300 s"),
        dragon: DragonInPlan {
            route: polyline(dragon.route(), -440.0, dragon.route().end_travel_m()),
            boards: corners(&boards_at(&dragon, 300.0)),
            hinges: positions(&handles),
            stage: StageInPlan::default(),
        },
        circle: None,
        turn: None,
        pair: None,
    }
}

fn nearest_pair(boards: &[Board]) -> NearestPair {
    let PairClearance { benches, clearance_m, point } =
        ClearanceSearch::default().nearest(boards).expect("there are more than two boards");
    let half = 0.5 * clearance_m * boards[benches[0]].approach(&boards[benches[1]]).direction;
    NearestPair { benches, clearance_m, points: [point - half, point + half] }
}

pub(crate) fn turning_plan_view() -> PlanView {
    let turnaround = paper_turnaround(2.0);
    let [entry_arc, exit_arc] = turnaround.arcs();
    let (middle_m, end_m) = (entry_arc.length_m(), entry_arc.length_m() + exit_arc.length_m());
    let dragon = turning_dragon();
    let handles = handles_at(&dragon, 40.0);
    let boards = boards_at(&dragon, 40.0);
    PlanView {
        caption: Caption::new("The dragon on its turnaround at 40 s"),
        dragon: DragonInPlan {
            route: polyline(dragon.route(), -460.0, 100.0),
            boards: corners(&boards),
            hinges: positions(&handles),
            stage: StageInPlan::default(),
        },
        circle: Some(Circle { centre: DVec2::ZERO, radius_m: 4.5, name: "turning circle".to_owned() }),
        pair: Some(nearest_pair(&boards)),
        turn: Some(TurnMarks {
            arcs: [polyline(dragon.route(), 0.0, middle_m), polyline(dragon.route(), middle_m, end_m)],
            line: Vec::new(),
            seams: [0.0, middle_m, end_m]
                .map(|travel_m| dragon.route().point(dragon.route().parameter(travel_m)).position)
                .to_vec(),
        }),
    }
}

pub(crate) fn contact_view() -> ContactView {
    let dragon = paper_dragon();
    let contact = first_contact(&dragon, 0.0, dragon.end_travel_m())
        .expect("the search has no limit")
        .expect("the paper's dragon touches itself");
    let handles = handles_at(&dragon, contact.travel_m);
    ContactView {
        caption: Caption::new(format!("First contact, at {:.6} s: benches 0 and 8", contact.travel_m)),
        dragon: DragonInPlan {
            route: polyline(dragon.route(), -440.0, dragon.route().end_travel_m()),
            boards: corners(&boards_at(&dragon, contact.travel_m)),
            hinges: positions(&handles),
            stage: StageInPlan::default(),
        },
        pair: NearestPair { benches: contact.benches, clearance_m: 0.0, points: [contact.point; 2] },
    }
}

/// The least clearance a hundred times a second over the last minute, and four times a second before.
pub(crate) fn clearance_over_time() -> ClearanceOverTime {
    let dragon = paper_dragon();
    let contact = first_contact(&dragon, 0.0, dragon.end_travel_m())
        .expect("the search has no limit")
        .expect("the paper's dragon touches itself");
    let mut search = ClearanceSearch::default();
    let mut nearest =
        |time_s: f64| search.nearest(&boards_at(&dragon, time_s)).expect("there are more than two boards");
    let coarse = (0..1408).map(|step| 0.25 * f64::from(step));
    let fine = (0..).map(|step| 352.0 + 0.01 * f64::from(step)).take_while(|time_s| *time_s < contact.travel_m);
    let pairs: Vec<(f64, PairClearance)> = coarse.chain(fine).map(|time_s| (time_s, nearest(time_s))).collect();
    let is_low = |three: &&[(f64, PairClearance)]| {
        let [before, low, after] = [0, 1, 2].map(|index| three[index].1.clearance_m);
        low < before && low < after && three.iter().all(|(_, pair)| pair.benches == three[1].1.benches)
    };
    let near_miss = |three: &[(f64, PairClearance)]| {
        let (time_s, PairClearance { clearance_m, benches, .. }) = three[1];
        NearMissMark { time_s, clearance_m, benches }
    };
    ClearanceOverTime {
        caption: Caption::new("Least clearance up to the first contact"),
        samples: pairs.iter().map(|(time_s, pair)| DVec2::new(*time_s, pair.clearance_m)).collect(),
        near_misses: pairs.windows(3).filter(is_low).map(near_miss).collect(),
        contact: Some(ContactMark { time_s: contact.travel_m, benches: contact.benches }),
    }
}

fn speed_profile() -> SpeedProfile {
    let limits = RunLimits { handle_mps: 2.0, head_mps: 2.0, accel_mps2: 0.5 };
    let run = QuickestRun::of(&turning_dragon(), &limits, &[], 0.1).expect("the paper's dragon turns");
    let line = |name: &str, speed_mps: &dyn Fn(f64) -> f64| {
        let points = |from_m: i32, to_m: i32| {
            let travels_m = (8 * from_m..=8 * to_m).map(|step| f64::from(step) / 8.0);
            travels_m.map(|travel_m| DVec2::new(travel_m, speed_mps(travel_m))).collect()
        };
        SpeedLine { name: name.to_owned(), points: points(-100, 100), detail: points(2, 26) }
    };
    SpeedProfile {
        caption: Caption::new("The quickest show"),
        lines: vec![
            line("limit", &|travel_m| run.cap_mps(travel_m)),
            line("quickest", &|travel_m| run.optimum_mps(travel_m)),
            line("cues", &|travel_m| run.walk_mps(travel_m)),
        ],
        detail_m: 2.0..=26.0,
    }
}

pub(crate) fn speeds_over_time() -> SpeedsOverTime {
    let dragon = turning_dragon();
    let times: Vec<f64> = (0..=4000).map(|step| -100.0 + 0.05 * f64::from(step)).collect();
    let chains: Vec<Vec<Handle>> = times.iter().map(|time_s| handles_at(&dragon, *time_s)).collect();
    let line = |handle: usize| {
        let samples = times.iter().zip(&chains).map(|(time_s, chain)| DVec2::new(*time_s, chain[handle].speed_ratio));
        let name = if handle == 0 { "head".to_owned() } else { format!("handle {handle}") };
        HandleSpeed { name, samples: samples.collect() }
    };
    let range = |time_s: f64, chain: &[Handle]| {
        let speeds = || chain.iter().map(|handle| handle.speed_ratio);
        let (least_mps, most_mps) = (speeds().fold(f64::MAX, f64::min), speeds().fold(0.0, f64::max));
        SpeedRange { time_s, least_mps, most_mps }
    };
    let all = times.iter().zip(&chains).flat_map(|(time_s, chain)| {
        chain.iter().enumerate().map(|(handle, state)| (state.speed_ratio, *time_s, handle))
    });
    let (speed_mps, time_s, handle) = all.max_by(|a, b| a.0.total_cmp(&b.0)).expect("there are samples");
    SpeedsOverTime {
        caption: Caption::new("Speeds on the turnaround, head at 1 m/s"),
        all: times.iter().zip(&chains).map(|(time_s, chain)| range(*time_s, chain)).collect(),
        handles: [0, 1, 2, 5, 51, 201].map(line).into(),
        largest: Some(LargestSpeed { time_s, speed_mps, handle }),
        limit_mps: Some(2.0),
        detail_s: Some(-2.0..=30.0),
    }
}

/// Invented data: lines that rise, fall, bend, jump and end.
pub(crate) fn sensitivity() -> SensitivityChart {
    let parameters = ["pitch", "head length", "body length", "width", "hole offset", "speed"].map(str::to_owned);
    let curve = |parameter: usize, size: f64| {
        let point = |step: i32| {
            let change = f64::from(step);
            let slope = [1.0, -0.4, 0.2, -0.8, 0.1, 0.0][parameter];
            let value = size * (1.0 + 0.01 * slope * change + 0.0005 * slope * change * change);
            let jump = if parameter == 3 && step > 2 { 0.02 * size } else { 0.0 };
            (change, (parameter != 1 || step < 4).then_some(value + jump))
        };
        (-5..=5).map(point).collect()
    };
    let quantity = |(name, size): (&str, f64)| ChartQuantity {
        name: name.to_owned(),
        curves: (0..6).map(|parameter| curve(parameter, size)).collect(),
    };
    let quantities = [
        ("first contact (s)", 412.474),
        ("least clearance (mm)", 0.865),
        ("largest speed ÷ head speed", 1.604_793),
        ("smallest pitch (m)", 0.450_337),
    ];
    SensitivityChart {
        caption: Caption::new("What a change of one parameter by up to ±5 % does"),
        parameters: parameters.into(),
        quantities: quantities.map(quantity).into(),
    }
}

//! Measures how soon a question ends after it is cancelled: each question is asked again and again, and cancelled at instants
//! that are spread evenly over its time.

#![allow(missing_docs, reason = "a bench has no public items")]

mod shared;

use std::hint::black_box;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_geometry::clearance::{first_contact, first_possible_touch, first_touching_pose};
use bench_dragon_geometry::dragon::{Dragon, Meter, Question};
use bench_dragon_geometry::planner::{
    Parameter, Sensitivity, Setting, Staging, clearance_profile, guaranteed_pitch, largest_speed_ratio,
    least_clearance, near_misses, passage_through, shortest_turn, shortest_turn_with_line, smallest_pitch,
    walk_through,
};
use bench_dragon_geometry::route::{Route, SpiralSpec, Turnaround};
use test_support::dragons::paper_benches;

use shared::{Figures, quantile};

/// Work that no question here exceeds, in steps.
const WORK: u64 = 100_000_000_000;
/// Cancels of each question.
const CANCELS: u32 = 100;

/// A question: its name, and how it is asked.
struct Asked {
    name: &'static str,
    ask: Box<dyn Fn(&Meter) + Sync>,
}

fn question<A>(name: &'static str, ask: impl Fn(&Meter) -> A + Sync + 'static) -> Asked {
    Asked {
        name,
        ask: Box::new(move |meter| {
            black_box(ask(meter));
        }),
    }
}

/// A question about a dragon on a route.
fn walk<A>(name: &'static str, benches: usize, route: Route, ask: impl Fn(&Dragon) -> A + Sync + 'static) -> Asked {
    let dragon = Dragon::new(paper_benches(benches), Arc::new(route)).expect("the dragon stands");
    question(name, move |meter| ask(&dragon.metered(meter)))
}

fn questions() -> Vec<Asked> {
    let spiral = || Route::spiral(0.55, 16.0).expect("the paper's spiral");
    let contact = |dragon: &Dragon| first_contact(dragon, 0.0, dragon.end_travel_m());
    // The paper's dragon touches itself at 412.473838 m, the one on the street with spirals later than at 420 m.
    let misses = |dragon: &Dragon| near_misses(dragon, 0.0, 412.0, 0.02, |_| ());
    let least = |dragon: &Dragon| least_clearance(dragon, 0.0, 412.0, |_| ());
    let turnaround = Turnaround::new(1.7, 9.0, 2.0).expect("the paper's turnaround");
    let staging = Staging { clearance_m: 0.05, speed_ratio: 2.0 };
    let loose = paper_benches(223).with_poles(0.055, 0.050).expect("valid poles");
    let nominal = smallest_pitch(&loose, 16.0, 9.0, 0.0, &Meter::unlimited()).expect("there is a smallest pitch");
    let plan = SpiralSpec::default();
    let setting = Setting { dimensions: paper_benches(223), route: plan.into(), speed_mps: 1.0, accel_mps2: None };
    let parameters = Parameter::ALL.into_iter().filter(|parameter| setting.has(*parameter)).collect();
    let study = Sensitivity { setting, turn_diameter_m: 9.0, range: 0.05, steps: 2, parameters };
    let loose_dragon = Dragon::new(loose, Arc::new(spiral())).expect("the dragon stands");
    vec![
        walk("contact_paper", 223, spiral(), contact),
        walk("contact_street_with_spirals", 223, shared::mixed(), contact),
        walk("contact_winding_street", 223, shared::winding(670), contact),
        walk("contact_on_hills", 223, shared::on_hills(), contact),
        walk("contact_of_100000_benches", 100_000, spiral(), contact),
        question("place_100000_benches", move |meter| {
            Dragon::with_meter(paper_benches(100_000), Arc::new(spiral()), meter.clone())
        }),
        walk("near_misses_paper", 223, spiral(), misses),
        walk("near_misses_street_with_spirals", 223, shared::mixed(), misses),
        walk("least_clearance_street_with_spirals", 223, shared::mixed(), least),
        walk("curve_of_600_points", 223, spiral(), |dragon| {
            let points = (0..600).map(|point| 0.6 * f64::from(point)).collect::<Vec<_>>();
            clearance_profile(dragon, &points, || ())
        }),
        question("speed_limit", move |meter| {
            passage_through(turnaround, paper_benches(223), meter).map(|dragon| largest_speed_ratio(&dragon))
        }),
        question("passage", move |meter| walk_through(turnaround, paper_benches(223), staging, meter, |_| ())),
        question("smallest_pitch", move |meter| smallest_pitch(&paper_benches(223), 16.0, 9.0, 0.0, meter)),
        question("smallest_pitch_with_poles", move |meter| {
            guaranteed_pitch(&plan.into(), &loose, 16.0, 9.0, 0.0, &nominal, meter)
        }),
        question("contact_with_poles", move |meter| {
            let dragon = loose_dragon.metered(meter);
            let possible = first_possible_touch(&dragon, 0.0, 0.0, dragon.end_travel_m()).ok().flatten();
            possible.map(|possible| first_touching_pose(&dragon, 0.0, possible.travel_m, dragon.end_travel_m()))
        }),
        question("shortest_turn", move |meter| shortest_turn(turnaround, paper_benches(223), staging, meter, |_| ())),
        question("shortest_turn_with_line", move |meter| {
            shortest_turn_with_line(turnaround, paper_benches(223), staging, None, meter, |_| ())
        }),
        question("sensitivity", move |meter| study.study(meter, || ())),
    ]
}

/// Time in which a question is answered.
fn answered(asked: &Asked) -> Duration {
    let begun = Instant::now();
    (asked.ask)(&Meter::of(WORK));
    begun.elapsed()
}

/// Time from the cancel to the end of a question that is cancelled after `wait`; `None` if it was answered before.
///
/// The kernel adds the processor time of a running thread to that of its process once a tick, so that cannot be measured.
fn delay(asked: &Asked, wait: Duration) -> Option<Duration> {
    let question = Question::default();
    let meter = question.meter(WORK);
    let begun = Instant::now();
    thread::scope(|scope| {
        let ended = scope.spawn(|| {
            (asked.ask)(&meter);
            Instant::now()
        });
        thread::sleep(wait.saturating_sub(begun.elapsed()));
        let cancelled = Instant::now();
        question.cancel();
        ended.join().expect("the question is answered").checked_duration_since(cancelled)
    })
}

fn main() {
    let mut figures = Figures::of("cancel");
    let only = std::env::args().nth(1).filter(|argument| !argument.starts_with("--"));
    for asked in questions().iter().filter(|asked| only.as_ref().is_none_or(|only| asked.name == only)) {
        let whole = answered(asked).min(answered(asked));
        let wait = |cancel| whole.mul_f64(f64::from(cancel) / f64::from(CANCELS));
        let mut delays_us: Vec<f64> = (0..CANCELS)
            .filter_map(|cancel| delay(asked, wait(cancel)))
            .map(|delay| delay.as_secs_f64() * 1e6)
            .collect();
        delays_us.sort_by(f64::total_cmp);
        figures.set(&format!("{}_whole_ms", asked.name), whole.as_secs_f64() * 1e3);
        figures.set(&format!("{}_p50_us", asked.name), quantile(&delays_us, 0.5));
        figures.set(&format!("{}_p90_us", asked.name), quantile(&delays_us, 0.9));
        figures.set(&format!("{}_greatest_us", asked.name), quantile(&delays_us, 1.0));
    }
    figures.write();
}

//! The cost of many dragons beside that of one with as many benches.

use bench_dragon::config::Config;
use bench_dragon::safety::monitor::Monitor;
use bench_dragon::source::server::motion::MotionPlan;
use bench_dragon::source::server::{ServerSettings, Simulation};
use bench_dragon_geometry::clearance::ClearanceSearch;
use bench_dragon_geometry::dragon::Board;
use bench_dragon_ipc::{FrameHeader, HandleState};

use crate::shared::{Figures, median, nanoseconds_a_call};

/// Dragons of the formation, and the benches of each.
const DRAGONS: usize = 20;
const BENCHES: usize = 223;
/// Turns of both shows. The results are medians.
pub(crate) const ROUNDS: usize = 15;
/// Ticks of a turn.
const TICKS: usize = 50;

/// A show, tick by tick, in plain memory.
struct Show {
    config: Config,
    simulation: Simulation,
    monitor: Monitor,
    search: ClearanceSearch,
    boards: Vec<Board>,
    handles: Vec<HandleState>,
    header: FrameHeader,
}

/// The nanoseconds of each part of a tick, in all turns.
#[derive(Default)]
struct Costs {
    step: Vec<f64>,
    clearance: Vec<f64>,
    monitor: Vec<f64>,
}

impl Show {
    fn of(toml: &str) -> Self {
        let config = Config::from_toml(toml).expect("a valid configuration");
        let start = ServerSettings::planned_start(&config, config.start_s());
        let plan = MotionPlan::of_run(&config, &start, 1).expect("a planned start");
        let formation = config.formation();
        Self {
            simulation: Simulation::new(formation.clone(), plan, 1000, 1.0),
            monitor: Monitor::new(&config),
            search: ClearanceSearch::of(formation.layout()),
            boards: Vec::new(),
            handles: vec![HandleState::default(); formation.layout().handles()],
            header: FrameHeader::default(),
            config,
        }
    }

    fn step(&mut self) {
        self.simulation.tick(0, &mut ());
        self.header = self.simulation.header(1, self.header.tick + 1, 0);
        self.simulation.write(&mut self.handles);
    }

    /// Measures the parts of some ticks.
    fn turn(&mut self, costs: &mut Costs) {
        costs.step.push(nanoseconds_a_call(TICKS, || self.step()));
        self.monitor.observe(&self.header, &self.handles, None);
        let with_monitor = nanoseconds_a_call(TICKS, || {
            self.step();
            self.monitor.observe(&self.header, &self.handles, None);
        });
        let with_clearance = nanoseconds_a_call(TICKS, || {
            self.step();
            let place = |handle: &HandleState| handle.position_m.into();
            self.config.formation().place_boards(&self.handles, place, &mut self.boards);
            self.search.nearest(&self.boards).expect("many pairs");
        });
        let step_ns = costs.step[costs.step.len() - 1];
        costs.monitor.push(with_monitor - step_ns);
        costs.clearance.push(with_clearance - step_ns);
    }
}

/// Sets the costs of both shows, and their ratios.
pub(crate) fn many_dragons(figures: &mut Figures) {
    // Wide coils, so that no boards are near each other for lack of room.
    let spiral = "pitch_m = 0.55\nstart_turns = 75\n";
    let one = format!("[dragon]\nbenches = {}\n[route]\n{spiral}", DRAGONS * BENCHES);
    let dragon = |number: usize| {
        let (x_m, y_m) = (100 * (number % 5), 100 * (number / 5));
        format!(
            "[[dragons]]\nname = \"d{number}\"\nbenches = {BENCHES}\n[dragons.route]\n{spiral}start_x_m = {x_m}\nstart_y_m = {y_m}\n"
        )
    };
    let mut shows = [Show::of(&one), Show::of(&(0..DRAGONS).map(dragon).collect::<String>())];
    let mut costs = [Costs::default(), Costs::default()];
    for _ in 0..ROUNDS {
        for (show, costs) in shows.iter_mut().zip(&mut costs) {
            show.turn(costs);
        }
    }
    let part = |name: &str, of: fn(&mut Costs) -> &mut Vec<f64>, costs: &mut [Costs; 2], figures: &mut Figures| {
        let [one, many] = costs.each_mut().map(|costs| {
            of(costs).sort_by(f64::total_cmp);
            median(of(costs))
        });
        figures.set(&format!("{name}_ns_one_of_4460"), one);
        figures.set(&format!("{name}_ns_20_of_223"), many);
        figures.set(&format!("{name}_ratio_20_dragons_to_one"), many / one);
    };
    part("step", |costs| &mut costs.step, &mut costs, figures);
    part("clearance", |costs| &mut costs.clearance, &mut costs, figures);
    part("monitor", |costs| &mut costs.monitor, &mut costs, figures);
}

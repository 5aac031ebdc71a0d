//! Positions and speeds of all handles at given times, as tables and as JSON.

use bench_dragon_geometry::dragon::{self, ChainSolver};
use bench_dragon_geometry::formation::Planned;
use serde::Serialize;

use super::table::{Cell, Column, Table};
use crate::config::{Config, FormationDocument};

/// Greatest number of handles at all times together. A workbook of this size needs some 600 MB of memory, and 20 MB on the disk.
pub(crate) const MAX_POSITIONS: usize = 1_000_000;

/// Shown decimals of metres and of metres per second.
const DECIMALS: usize = 6;

/// The poses of all dragons at some times.
#[derive(Serialize)]
pub(crate) struct Poses {
    pub(crate) poses: Vec<Pose>,
    /// Whether tables show heights.
    #[serde(skip)]
    has_heights: bool,
}

/// The poses of all dragons at a time.
#[derive(Serialize)]
pub(crate) struct Pose {
    pub(crate) time_s: f64,
    pub(crate) handles: Vec<Handle>,
}

/// A handle at a time.
#[derive(Serialize)]
pub(crate) struct Handle {
    /// Name of the dragon, of several.
    #[serde(skip_serializing_if = "Option::is_none")]
    dragon: Option<String>,
    pub(crate) index: usize,
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    z_m: f64,
    pub(crate) speed_mps: f64,
}

/// Travel of the only dragon's head at a time of the run, in metres, clamped to the run because rounding may exceed it.
pub(crate) fn travel_m(time_s: f64, config: &Config) -> f64 {
    let dragon = config.lead();
    config.timetable().travel_m(time_s).clamp(dragon.start_travel_m(), dragon.end_travel_m())
}

impl Poses {
    /// The poses at times of the run.
    pub(crate) fn of(times_s: &[f64], config: &Config) -> Self {
        if let Some(named) = config.named() {
            return Self::of_formation(times_s, named);
        }
        let mut chain = ChainSolver::new(config.lead());
        let pose = |&time_s: &f64| {
            let head_mps = config.timetable().speed_mps(time_s);
            let handles = chain.solve(config.lead(), travel_m(time_s, config)).expect("the travel is in the run");
            let handles = handles.iter().enumerate();
            let handle = |(index, handle): (usize, &_)| Handle::of(None, index, handle, head_mps);
            Pose { time_s, handles: handles.map(handle).collect() }
        };
        Self { poses: times_s.iter().map(pose).collect(), has_heights: config.lead().route().is_on_ground() }
    }

    /// The poses of several dragons at plan times, dragon after dragon.
    pub(crate) fn of_formation(times_s: &[f64], document: &FormationDocument) -> Self {
        let has_heights = document.dragons().iter().any(|dragon| dragon.config.lead().route().is_on_ground());
        let pose = |&time_s: &f64| {
            let dragons = document.dragons().iter().zip(document.formation().dragons());
            let handles = dragons.flat_map(|(named, planned)| handles_of(&named.name, planned, time_s));
            Pose { time_s, handles: handles.collect() }
        };
        Self { poses: times_s.iter().map(pose).collect(), has_heights }
    }

    /// A table for each time.
    pub(crate) fn tables(&self) -> Vec<Table> {
        self.poses.iter().map(|pose| pose.table(self.has_heights)).collect()
    }

    /// A table with a row for every handle at every time.
    pub(crate) fn by_time(&self) -> Table {
        let numbers = number_columns(["x_m", "y_m", "z_m", "speed_mps"], self.has_heights);
        let time = std::iter::once(Column::number("time_s", DECIMALS));
        let columns = time.chain(self.dragon_column()).chain([Column::whole("handle")]).chain(numbers);
        let mut table = Table::new("poses", columns.collect());
        for Pose { time_s, handles } in &self.poses {
            for handle in handles {
                let row = std::iter::once((*time_s).into()).chain(handle.dragon.clone().map(Cell::from));
                table.push(
                    row.chain([handle.index.into()]).chain(handle.numbers(self.has_heights).map(Cell::from)).collect(),
                );
            }
        }
        table
    }

    /// The column of the dragons' names, of several dragons.
    fn dragon_column(&self) -> Option<Column> {
        let handle = self.poses.first()?.handles.first()?;
        handle.dragon.as_ref().map(|_| Column::text("dragon"))
    }

    /// Sheets of positions and speeds with a column for every time, as in the paper's workbook.
    pub(crate) fn sheets(&self) -> [Table; 2] {
        let mut positions = Table::new("positions", self.columns());
        let mut speeds = Table::new("speeds", self.columns());
        for (place, name) in self.names().into_iter().enumerate() {
            positions.push(self.row(format!("{name} x (m)"), place, |handle| handle.x_m));
            positions.push(self.row(format!("{name} y (m)"), place, |handle| handle.y_m));
            if self.has_heights {
                positions.push(self.row(format!("{name} z (m)"), place, |handle| handle.z_m));
            }
            speeds.push(self.row(format!("{name} (m/s)"), place, |handle| handle.speed_mps));
        }
        [positions, speeds]
    }

    /// The names of all handles for people: the bench whose front hinge it is, or "tail rear", of several dragons with the dragon's.
    fn names(&self) -> Vec<String> {
        let handles = self.poses.first().map_or(&[][..], |pose| &pose.handles);
        let is_last = |place: usize| handles.get(place + 1).is_none_or(|next| next.index == 0);
        let name = |(place, Handle { dragon, index, .. }): (usize, &Handle)| {
            let dragon = dragon.as_ref().map_or_else(String::new, |dragon| format!("{dragon} "));
            match index {
                0 => format!("{dragon}head"),
                _ if is_last(place) => format!("{dragon}tail rear"),
                index => format!("{dragon}bench {index}"),
            }
        };
        handles.iter().enumerate().map(name).collect()
    }

    fn columns(&self) -> Vec<Column> {
        let times = self.poses.iter().map(|pose| Column::number(format!("{} s", pose.time_s), DECIMALS));
        std::iter::once(Column::text("handle")).chain(times).collect()
    }

    fn row(&self, label: String, place: usize, value: impl Fn(&Handle) -> f64) -> Vec<Cell> {
        let values = self.poses.iter().map(|pose| Cell::from(value(&pose.handles[place])));
        std::iter::once(Cell::from(label)).chain(values).collect()
    }
}

/// The handles of a dragon at a plan time.
fn handles_of(name: &str, planned: &Planned, time_s: f64) -> Vec<Handle> {
    let mut solver = ChainSolver::new(&planned.dragon);
    let head_mps = planned.speed_mps(time_s);
    let chain = solver.solve(&planned.dragon, planned.travel_m(time_s)).expect("the travel is in the run");
    let handle = |(index, handle): (usize, &_)| Handle::of(Some(name.to_owned()), index, handle, head_mps);
    chain.iter().enumerate().map(handle).collect()
}

impl Pose {
    fn table(&self, has_heights: bool) -> Table {
        let numbers = number_columns(["x m", "y m", "z m", "m/s"], has_heights);
        let dragon = self.handles.first().and_then(|handle| handle.dragon.as_ref()).map(|_| Column::text("dragon"));
        let columns = dragon.into_iter().chain([Column::whole("handle")]).chain(numbers);
        let mut table = Table::new(format!("at {} s", self.time_s), columns.collect());
        for handle in &self.handles {
            let row = handle.dragon.clone().map(Cell::from).into_iter().chain([handle.index.into()]);
            table.push(row.chain(handle.numbers(has_heights).map(Cell::from)).collect());
        }
        table
    }
}

impl Handle {
    fn of(dragon: Option<String>, index: usize, handle: &dragon::Handle, head_speed_mps: f64) -> Self {
        Self {
            dragon,
            index,
            x_m: handle.position.x,
            y_m: handle.position.y,
            z_m: handle.height_m,
            speed_mps: handle.speed_ratio * head_speed_mps,
        }
    }

    /// The numbers of a table's row, with or without the height.
    fn numbers(&self, has_heights: bool) -> impl Iterator<Item = f64> {
        let height = has_heights.then_some(self.z_m);
        [self.x_m, self.y_m].into_iter().chain(height).chain([self.speed_mps])
    }
}

/// The columns of these titles, with or without the height, which is the third.
fn number_columns(titles: [&str; 4], has_heights: bool) -> impl Iterator<Item = Column> {
    let shown = titles.into_iter().enumerate().filter(move |&(index, _)| has_heights || index != 2);
    shown.map(|(_, title)| Column::number(title, DECIMALS))
}

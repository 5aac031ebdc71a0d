//! `solve schedule`: where dragons pass each other, and when each may leave.

use std::collections::BTreeMap;

use bench_dragon_geometry::number::{Fixed, Place};
use bench_dragon_geometry::planner::{Blocked, Passing, Schedule, Undecided};
use clap::Args;
use serde::Serialize;

use super::schedule_figure::DrawnPlan;
use super::{AnswerArgs, CLEARANCE_M, interrupt, load_any_plan, require_no_cues, require_several, work_default};
use crate::cli::flags::{BadInput, ConfigArgs, Format, within};
use crate::cli::in_file;
use crate::cli::print::{print_bytes, print_json, print_line};
use crate::config::FormationDocument;
use crate::output::table::{self, Cell, Column, Table};

/// Find where dragons pass each other, who is first, and how much later or earlier each may leave.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("work", |arg| work_default(arg, "1000")))]
#[command(after_help = "Examples:
  bench-dragon solve schedule --config two-dragons.toml
  bench-dragon solve schedule --config square.toml --clearance 0.5 --save-config scheduled.toml
  bench-dragon solve schedule --config square.toml --clearance 0.5 --order --figure chart.svg
  bench-dragon solve schedule --config two-dragons.toml --figure diagram.svg --pair gold,silver

Without --clearance, the plan is surveyed as it is: two dragons cross where their boards could touch. With it, dragons are delayed: \
in the order of the list, each leaves as early as those before it allow, and not before its own start_s. Starts are rounded up to \
a millisecond. No two dragons come nearer than the clearance; this is proved. The benches of one dragon are not compared: `solve \
contact` finds where a dragon touches itself.

A crossing is a zone of the two routes in which boards come within the clearance if the dragons are there together. The slack is by \
how much the delay between both may change until they do. It is negative if they do as planned.")]
pub(crate) struct ScheduleArgs {
    /// Find the least delays with which any two dragons stay this far apart, in metres, 0 to 10.
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = within(CLEARANCE_M))]
    pub(crate) clearance: Option<f64>,
    /// Also choose the order in which dragons are delayed: that in which the last one ends first, of all orders of up to six
    /// dragons. Of more, the order of the list is improved by moving one dragon at a time, as long as that helps.
    #[arg(long, requires = "clearance")]
    pub(crate) order: bool,
    /// Draw the coordination diagram of these two dragons instead of the time-distance chart of all: two names, separated by a comma.
    #[arg(long, value_name = "NAMES", requires = "figure", value_delimiter = ',')]
    pub(crate) pair: Vec<String>,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) answer: AnswerArgs,
}

#[derive(Default, Serialize)]
struct ScheduleAnswer<'a> {
    /// Plan time at which each dragon leaves, by its name; null if there is no plan.
    starts_s: Option<BTreeMap<&'a str, f64>>,
    /// The requested clearance.
    clearance_m: Option<f64>,
    /// The order in which the dragons were delayed; null without a clearance.
    order: Option<Vec<&'a str>>,
    /// The least clearance between any two dragons.
    least_clearance_m: Option<f64>,
    least_at_s: Option<f64>,
    least_dragons: Option<[&'a str; 2]>,
    least_benches: Option<[usize; 2]>,
    dragons: Vec<DragonRow<'a>>,
    crossings: Vec<CrossingRow<'a>>,
    /// The reason for which there is no plan.
    impossible: Option<String>,
    /// The reason for which the answer is unknown: it took too much work.
    undecided: Option<String>,
}

#[derive(Serialize)]
struct DragonRow<'a> {
    dragon: &'a str,
    start_s: f64,
    /// By how much it leaves after its configured start.
    delay_s: f64,
    end_s: f64,
    /// By how much it may leave earlier, while the others leave as planned; null if it meets another one as planned.
    earlier_s: Option<f64>,
    /// By how much it may leave later; null if it meets another one as planned, or if it may leave at any later time.
    later_s: Option<f64>,
    /// Whether it meets another one as planned.
    meets: bool,
}

#[derive(Serialize)]
struct CrossingRow<'a> {
    dragons: [&'a str; 2],
    /// The dragon that passes first; null if they meet.
    first: Option<&'a str>,
    /// Plan time from which it is out of the way of the other one; null if they meet, or pass in turn.
    passes_s: Option<f64>,
    /// Plan time at which the other one gets there.
    arrives_s: Option<f64>,
    slack_s: f64,
    /// The least clearance while one of them is there.
    least_clearance_m: f64,
    least_at_s: f64,
    benches: [usize; 2],
    point_m: [f64; 2],
}

pub(super) fn run(args: &ScheduleArgs) -> anyhow::Result<()> {
    let plan = load_any_plan(&args.config, args.answer.work)?;
    let document = in_file(&args.config, require_several(&plan, "solve schedule"))?;
    in_file(&args.config, require_no_cues(document.cues(), "solve schedule"))?;
    for dragon in document.dragons() {
        args.answer.keep_files_apart(dragon.config.document())?;
    }
    let pair = pair(args, document)?;
    let formation = document.formation().metered(&args.answer.work.longest_meter());
    let names: Vec<&str> = document.dragons().iter().map(|dragon| &*dragon.name).collect();
    let clearance_m = args.clearance.unwrap_or(0.0);
    let schedule = match Schedule::new(&formation, clearance_m) {
        Ok(schedule) => schedule,
        Err(Undecided { dragons }) => return undecided(args, dragons.map(|dragon| names[dragon])),
    };
    let listed: Vec<usize> = (0..names.len()).collect();
    let scheduled = match args.clearance {
        None => Ok((None, schedule.earliest_s().to_vec())),
        Some(_) if args.order => schedule.best_order().map(|(order, starts_s)| (Some(order), starts_s)),
        Some(_) => schedule.in_order(&listed).map(|starts_s| (Some(listed), starts_s)),
    };
    let (order, starts_s) = match scheduled {
        Ok(found) => found,
        Err(blocked) => return impossible(args, &reason(&blocked, &names, clearance_m, args.order)),
    };
    let passings = schedule.passings(&starts_s);
    let answer = ScheduleAnswer {
        order: order.map(|order| order.into_iter().map(|dragon| names[dragon]).collect()),
        clearance_m: args.clearance,
        ..ScheduleAnswer::of(&schedule, &starts_s, &passings, &names)
    };
    match args.answer.format.format {
        Format::Json => print_json(&answer)?,
        Format::Text => answer.print()?,
    }
    let document = document.leaving_at(&starts_s);
    let figure = &args.answer.figure;
    if figure.is_asked() {
        let drawn = DrawnPlan { figure, document: &document, schedule: &schedule, passings: &passings, clearance_m };
        let drawing = pair.map_or_else(|| drawn.chart(), |pair| drawn.diagram(pair));
        figure.save_and_report(drawing, args.answer.format.format)?;
    }
    match &args.answer.save_config {
        Some(path) => interrupt::write(path, document.to_toml().as_bytes()),
        None => Ok(()),
    }
}

/// The dragons of `--pair`.
fn pair(args: &ScheduleArgs, document: &FormationDocument) -> Result<Option<[usize; 2]>, BadInput> {
    if args.pair.is_empty() {
        return Ok(None);
    }
    let names: Vec<&str> = document.dragons().iter().map(|dragon| &*dragon.name).collect();
    let found: Vec<usize> = args.pair.iter().filter_map(|name| names.iter().position(|known| known == name)).collect();
    match found[..] {
        [one, other] if args.pair.len() == 2 && one != other => Ok(Some([one, other])),
        _ => Err(BadInput(format!("--pair is {}, must be two of {}", args.pair.join(","), names.join(", ")))),
    }
}

fn undecided(args: &ScheduleArgs, [one, other]: [&str; 2]) -> anyhow::Result<()> {
    let text = format!("whether {one} and {other} meet is unknown: {}", interrupt::early_end());
    no_plan(args, &text, ScheduleAnswer { undecided: Some(text.clone()), ..ScheduleAnswer::default() })
}

fn impossible(args: &ScheduleArgs, text: &str) -> anyhow::Result<()> {
    no_plan(args, text, ScheduleAnswer { impossible: Some(text.to_owned()), ..ScheduleAnswer::default() })
}

/// Prints an answer without a plan.
fn no_plan(args: &ScheduleArgs, text: &str, answer: ScheduleAnswer<'_>) -> anyhow::Result<()> {
    match args.answer.format.format {
        Format::Json => print_json(&ScheduleAnswer { clearance_m: args.clearance, ..answer })?,
        Format::Text => print_line(text)?,
    }
    args.answer.figure.refuse(text)?;
    super::save_config(&args.answer, Err(text))
}

/// Why dragons cannot be scheduled, in one line.
fn reason(blocked: &Blocked, names: &[&str], clearance_m: f64, is_any_order: bool) -> String {
    let nearer = if clearance_m > 0.0 { format!("come within {clearance_m} m of") } else { "touch".to_owned() };
    match blocked {
        Blocked::Always([one, other]) => {
            format!("no schedule: {} and {} {nearer} each other, whenever they leave", names[*one], names[*other])
        }
        Blocked::Cycle(cycle) => {
            let before = cycle.iter().zip(cycle.iter().cycle().skip(1));
            let waits: Vec<String> =
                before.map(|(one, other)| format!("{} before {}", names[*one], names[*other])).collect();
            format!(
                "no schedule: dragons wait for each other in a circle, each has to leave before another: {}",
                waits.join(", ")
            )
        }
        Blocked::InOrder { dragon, by, latest_s } => {
            let (dragon, by) = (names[*dragon], names[*by]);
            let when = if *latest_s < 0.0 {
                format!("at least {:.3} s before {by}", -latest_s)
            } else {
                format!("at most {latest_s:.3} s after {by}")
            };
            let remedy = if is_any_order {
                "no order that was tried allows it"
            } else {
                "change the order of the list, or use --order"
            };
            format!("no schedule in this order: {dragon} has to leave {when}, or they {nearer} each other: {remedy}")
        }
    }
}

impl<'a> ScheduleAnswer<'a> {
    fn of(schedule: &Schedule, starts_s: &[f64], passings: &[Passing], names: &[&'a str]) -> Self {
        let least = schedule.nearest(starts_s);
        let dragon_row = |dragon: usize| {
            let slack_s = schedule.slack_s(dragon, starts_s);
            DragonRow {
                dragon: names[dragon],
                start_s: starts_s[dragon],
                delay_s: starts_s[dragon] - schedule.earliest_s()[dragon],
                end_s: schedule.dragon_end_s(dragon, starts_s),
                earlier_s: slack_s.map(|slack_s| slack_s[0]),
                later_s: slack_s.map(|slack_s| slack_s[1]).filter(|later_s| later_s.is_finite()),
                meets: slack_s.is_none(),
            }
        };
        Self {
            starts_s: Some(names.iter().copied().zip(starts_s.iter().copied()).collect()),
            least_clearance_m: least.map(|(_, nearest, _)| nearest.approach.clearance_m),
            least_at_s: least.map(|(.., at_s)| at_s),
            least_dragons: least.map(|(dragons, ..)| dragons.map(|dragon| names[dragon])),
            least_benches: least.map(|(_, nearest, _)| nearest.benches),
            dragons: (0..names.len()).map(dragon_row).collect(),
            crossings: passings.iter().map(|passing| CrossingRow::of(passing, names)).collect(),
            ..Self::default()
        }
    }

    fn print(&self) -> anyhow::Result<()> {
        let mut tables = vec![self.dragon_table()];
        if !self.crossings.is_empty() {
            tables.push(self.crossing_table());
        }
        print_bytes(table::text(&tables))?;
        if let (Some(least_m), Some(at_s), Some([one, other]), Some([first, second])) =
            (self.least_clearance_m, self.least_at_s, self.least_dragons, self.least_benches)
        {
            let (least, at) = (Fixed::<6>(least_m), Fixed::<3>(at_s));
            let proved = self.clearance_m.map_or_else(String::new, |clearance_m| match clearance_m {
                0.0 => "; no two dragons touch, which is proved".to_owned(),
                _ => format!("; any two dragons stay over {clearance_m} m apart, which is proved"),
            });
            print_line("")?;
            print_line(format_args!(
                "least clearance between dragons {least} m, at {at} s: {one} bench {first} and {other} bench {second}{proved}"
            ))?;
        }
        if self.crossings.is_empty() {
            print_line("no crossings: no two dragons can meet, whenever they leave")?;
        }
        Ok(())
    }

    fn dragon_table(&self) -> Table {
        let mut columns = vec![Column::text("dragon")];
        let titles = ["leaves (s)", "delay (s)", "ends (s)", "may leave earlier by (s)"];
        columns.extend(titles.map(|title| Column::number(title, DECIMALS)));
        columns.push(Column::text("or later by (s)"));
        let mut table = Table::new("dragons", columns);
        for DragonRow { dragon, start_s, delay_s, end_s, earlier_s, later_s, meets } in &self.dragons {
            let later = match later_s {
                _ if *meets => "meets another".to_owned(),
                Some(later_s) => format!("{later_s:.3}"),
                None => "any time".to_owned(),
            };
            let numbers = [Some(*start_s), Some(*delay_s), Some(*end_s), *earlier_s].map(Cell::from);
            table.push([vec![(*dragon).to_owned().into()], numbers.to_vec(), vec![later.into()]].concat());
        }
        table
    }

    fn crossing_table(&self) -> Table {
        let mut columns = vec![Column::text("crossing of"), Column::text("first")];
        let titles = ["has passed (s)", "other gets there (s)", "slack (s)", "clearance (m)", "nearest at (s)"];
        columns.extend(titles.map(|title| Column::number(title, DECIMALS)));
        columns.push(Column::text("place"));
        let mut table = Table::new("crossings", columns);
        for row in &self.crossings {
            let [one, other] = row.dragons;
            let mut cells: Vec<Cell> =
                vec![format!("{one}, {other}").into(), row.first.unwrap_or("they meet").to_owned().into()];
            let always = [Some(row.slack_s), Some(row.least_clearance_m), Some(row.least_at_s)];
            cells.extend([row.passes_s, row.arrives_s].into_iter().chain(always).map(Cell::from));
            cells.push(Place::<3>(row.point_m).to_string().into());
            table.push(cells);
        }
        table
    }
}

/// Decimals of seconds and metres in a table.
const DECIMALS: usize = 3;

impl<'a> CrossingRow<'a> {
    fn of(passing: &Passing, names: &[&'a str]) -> Self {
        Self {
            dragons: passing.dragons.map(|dragon| names[dragon]),
            first: passing.first.map(|dragon| names[dragon]),
            passes_s: passing.passes_s,
            arrives_s: passing.arrives_s,
            // A finite number: zones of dragons that always meet are inside.
            slack_s: passing.slack_s,
            least_clearance_m: passing.nearest.approach.clearance_m,
            least_at_s: passing.nearest_s,
            benches: passing.nearest.benches,
            point_m: passing.nearest.approach.point.to_array(),
        }
    }
}

//! Dragons that come to a plan, or go.

use bench_dragon_geometry::dragon::ChainSolver;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, Value};

use super::change::rounded_m;
use crate::config::Config;

/// Names of new dragons, in this order.
const NAMES: [&str; 8] = ["gold", "silver", "red", "blue", "green", "white", "black", "bronze"];
/// Distance of a new dragon from all others, in metres.
const APART_M: f64 = 3.0;
/// The tables of one dragon. With several, each has its own.
const OWN: [&str; 2] = ["route", "head"];

/// The text with one dragon more: a copy of the last one, below all others.
///
/// # Errors
/// The text is not TOML, or has its dragons in one line.
pub(super) fn added(text: &str, config: &Config) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|_| "the text is not TOML".to_owned())?;
    if document.get("dragons").is_none() {
        make_several(&mut document);
    }
    let down_m = way_down_m(config);
    let Some(Item::ArrayOfTables(dragons)) = document.get_mut("dragons") else {
        return Err("the text has its dragons in one line: write each as [[dragons]]".to_owned());
    };
    let taken: Vec<String> =
        dragons.iter().filter_map(|dragon| dragon.get("name")?.as_str().map(str::to_owned)).collect();
    let numbered = (1..).map(|number| format!("dragon-{number}"));
    let name = NAMES.iter().map(|&name| name.to_owned()).chain(numbered).find(|name| !taken.contains(name));
    let mut new = dragons.iter().last().cloned().ok_or("the text has no dragon")?;
    unplace(&mut new);
    new.decor_mut().set_prefix("\n");
    new.insert("name", name.expect("numbers do not end").into());
    new.remove("colour");
    if new.get("route").is_none() {
        new.insert("route", Item::Table(Table::new()));
    }
    let route = new.get_mut("route").and_then(Item::as_table_like_mut).ok_or("the route is not a table")?;
    let y_m = route.get("start_y_m").and_then(|y| y.as_float().or_else(|| y.as_integer().map(|whole| whole as f64)));
    route.insert("start_y_m", rounded_m(y_m.unwrap_or(0.0) - down_m).into());
    dragons.push(new);
    Ok(document.to_string())
}

/// The text without a dragon.
///
/// # Errors
/// It is the last one, or the text has its dragons in another form.
pub(super) fn removed(text: &str, dragon: usize) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|_| "the text is not TOML".to_owned())?;
    let few = || Err("the last dragon cannot be removed".to_owned());
    match document.get_mut("dragons") {
        Some(Item::ArrayOfTables(dragons)) if dragon < dragons.len() && dragons.len() > 1 => {
            drop(dragons.remove(dragon));
        }
        Some(Item::Value(Value::Array(dragons))) if dragon < dragons.len() && dragons.len() > 1 => {
            drop(dragons.remove(dragon));
        }
        _ => return few(),
    }
    Ok(document.to_string())
}

/// Makes the tables of one dragon those of the first of several.
fn make_several(document: &mut DocumentMut) {
    let mut first = match document.remove("dragon") {
        Some(Item::Table(dragon)) => dragon,
        Some(Item::Value(Value::InlineTable(dragon))) => dragon.into_table(),
        _ => Table::new(),
    };
    first.insert("name", NAMES[0].into());
    for key in OWN {
        if let Some(mut item) = document.remove(key) {
            unplace_item(&mut item);
            first.insert(key, item);
        }
    }
    unplace(&mut first);
    let mut dragons = ArrayOfTables::new();
    dragons.push(first);
    document.insert("dragons", Item::ArrayOfTables(dragons));
}

/// Tables are written in the order of their places. A table without one follows the table before it.
fn unplace(table: &mut Table) {
    table.set_position(None);
    table.iter_mut().for_each(|(_, item)| unplace_item(item));
}

fn unplace_item(item: &mut Item) {
    match item {
        Item::Table(table) => unplace(table),
        Item::ArrayOfTables(tables) => tables.iter_mut().for_each(unplace),
        _ => {}
    }
}

/// How far a copy of the last dragon has to go down so that it stands below all others.
fn way_down_m(config: &Config) -> f64 {
    let spans: Vec<[f64; 2]> = config
        .formation()
        .dragons()
        .iter()
        .map(|planned| {
            let mut solver = ChainSolver::new(&planned.dragon);
            let ends = [planned.dragon.start_travel_m(), planned.dragon.end_travel_m()];
            let mut span = [f64::INFINITY, f64::NEG_INFINITY];
            for travel_m in ends {
                let Ok(chain) = solver.solve(&planned.dragon, travel_m) else { continue };
                for handle in chain {
                    span = [span[0].min(handle.position.y), span[1].max(handle.position.y)];
                }
            }
            span
        })
        .collect();
    let lowest_m = spans.iter().map(|span| span[0]).fold(f64::INFINITY, f64::min);
    let top_m = spans.last().map_or(0.0, |span| span[1]);
    let down_m = top_m - lowest_m + APART_M;
    if down_m.is_finite() { down_m.ceil() } else { APART_M }
}

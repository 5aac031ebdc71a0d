//! The constants of the page's script.

use bench_dragon_ipc::{AlertKind, Severity, ShowState};
use test_support::foreign_form::require_file;

use crate::repository;

#[test]
fn the_page_has_the_states_and_the_kinds_of_alerts() {
    let states: Vec<String> = ShowState::ALL.iter().map(|state| format!("'{state}'")).collect();
    let kinds = AlertKind::by_severity().map(|kind| {
        let severity = match kind.severity() {
            Severity::Danger => "danger",
            Severity::Caution => "caution",
            Severity::Calm => "calm",
        };
        format!("  ['{kind}', '{severity}'],\n")
    });
    let script = format!(
        "// @ts-check
// Words of the bus. Generated from the Rust crate by its test `wire`; not changed by hand.

/** States of a frame, by their numbers. */
export const STATES = /** @type {{const}} */ ([{}]);

/** @typedef {{'danger' | 'caution' | 'calm'}} Severity urgency of an alert */
/** Kinds of alerts, the most urgent first. @type {{ReadonlyMap<string, Severity>}} */
export const SEVERITIES = new Map([
{}]);
",
        states.join(", "),
        kinds.collect::<String>()
    );
    require_file(&repository("src/display/view/page/words.js"), &script);
}

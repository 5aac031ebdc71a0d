//! Tables as text and as comma-separated values.

use bench_dragon::output::table::{Cell, Column, Table, csv, text};

#[test]
fn columns_are_as_wide_as_their_widest_cell() {
    let mut table = Table::new("at 0 s", vec![Column::text("handle"), Column::number("x m", 3)]);
    table.push(vec![Cell::from("head"), Cell::from(8.8)]);
    table.push(vec![Cell::from("tail rear"), Cell::from(-0.000_4)]);
    table.push(vec![Cell::from("nobody"), Cell::Blank]);
    assert_eq!(text(&[table]), "at 0 s\nhandle       x m\nhead       8.800\ntail rear  0.000\nnobody         –\n");
}

#[test]
fn cells_with_commas_or_quotes_are_quoted() {
    let mut table = Table::new("t", vec![Column::text("who, what"), Column::number("x", 1)]);
    table.push(vec![Cell::from("the \"tail\""), Cell::Blank]);
    table.push(vec![Cell::from("head"), Cell::from(0.1 + 0.2)]);
    assert_eq!(
        String::from_utf8(csv(&[table])).expect("the text is UTF-8"),
        "\"who, what\",x\n\"the \"\"tail\"\"\",\nhead,0.30000000000000004\n"
    );
}

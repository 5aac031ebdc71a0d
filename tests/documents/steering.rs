//! Open Sound Control and HTTP have the same commands.

use std::collections::BTreeSet;

use crate::words::tables;
use crate::{read, root};

#[test]
fn osc_and_http_have_the_same_commands() {
    let page = tables("docs/reference/steering.md");
    let commands = page.iter().find(|table| table[0][0] == "address").expect("the table of commands");
    let addresses = commands[1..].iter().flat_map(|row| row[0].split(", ")).map(|address| address.trim_matches('`'));
    let by_osc: BTreeSet<&str> = addresses
        .map(|address| address.strip_prefix("/dragon/").expect("our address"))
        .filter(|name| *name != "state")
        .collect();
    let description = read(&root().join("docs/reference/openapi.yaml"));
    let lists = description.split("command: { enum: [").skip(1).map(|rest| rest.split(']').next().expect("an end"));
    let by_http: BTreeSet<&str> = lists.flat_map(|list| list.split(", ")).collect();
    assert_eq!(by_osc, by_http);
    assert!(by_http.len() >= 8, "{by_http:?}");
}

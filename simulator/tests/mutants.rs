//! The table of mutants fits the code.

use std::fs;
use std::path::Path;

use toml::{Table, Value};

#[test]
fn each_mutant_replaces_one_piece_of_code() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let text = fs::read_to_string(root.join("simulator/mutants.toml")).expect("the table can be read");
    let table: Table = text.parse().expect("the table is TOML");
    let mutants = table["mutant"].as_array().expect("a list of mutants");
    assert!(mutants.len() >= 30, "{} mutants", mutants.len());
    for mutant in mutants {
        let word = |key: &str| mutant.get(key).and_then(Value::as_str).unwrap_or_default();
        let code = fs::read_to_string(root.join(word("file"))).expect("the file can be read");
        let piece = [word("before"), word("from"), word("after")].concat();
        assert_eq!(code.matches(&piece).count(), 1, "{}: {piece:?} in {}", word("what"), word("file"));
    }
}

//! `docs/reference/configuration.md` describes every key that a written configuration has.

use bench_dragon::config::Config;

use crate::words::tables;

const PAGE: &str = "docs/reference/configuration.md";

#[test]
fn every_written_key_has_a_row_in_the_table_of_its_table() {
    let described = tables(PAGE);
    for kind in ["spiral", "turnaround"] {
        let config = Config::from_toml(&format!("[route]\nkind = \"{kind}\"")).expect("every other key has a default");
        let written: toml::Table = config.to_toml().parse().expect("its own text is valid");
        assert!(written.len() >= 5, "{written}");
        for (table, keys) in written {
            // The keys of some kinds of route have tables of their own.
            let titles = [format!("`[{table}]`"), if table == "route" { "spiral, turnaround" } else { "" }.to_owned()];
            let rows = || described.iter().filter(|rows| titles.contains(&rows[0][0])).flatten();
            for key in keys.as_table().expect("a table of keys").keys() {
                assert!(
                    rows().any(|row| row[0].contains(&format!("`{key}`"))),
                    "{PAGE} has no row of {key} of [{table}]"
                );
            }
        }
    }
}

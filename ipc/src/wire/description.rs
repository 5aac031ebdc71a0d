//! What a client reads in the text of a description without a parser for TOML.

/// The names of the dragons of a description, in their order: those of `[[dragons]]`. None for the short form for one dragon.
///
/// `toml` is the text that a source publishes, with one key a line.
///
/// ```
/// let toml = "[serve]\nrate_hz = 50\n\n[[dragons]]\nbenches = 12\nname = \"gold\"\n\n[dragons.head]\nspeed_mps = 1.0\n";
/// assert_eq!(bench_dragon_ipc::dragon_names(toml), ["gold"]);
/// ```
pub fn dragon_names(toml: &str) -> Vec<&str> {
    let mut is_dragon = false;
    let names = toml.lines().filter_map(|line| {
        if line.starts_with('[') {
            is_dragon = line == "[[dragons]]";
        }
        let value = line.strip_prefix("name = \"")?;
        value.strip_suffix('"').filter(|_| is_dragon)
    });
    names.collect()
}

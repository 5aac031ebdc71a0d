//! The text of a configuration, from a file or from a description on the bus.

use bench_dragon::config::Config;

/// Fails unless a text is refused in one line or valid. The dragon of a valid text can walk, and the written text reads back
/// unchanged.
pub(crate) fn check(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    match Config::from_toml(&text) {
        Ok(config) => {
            let dragon = config.lead();
            assert!(dragon.start_travel_m().is_finite() && dragon.end_travel_m().is_finite());
            assert!(config.start_s() <= config.end_s());
            let written = config.to_toml();
            let again = Config::from_toml(&written).expect("the written text is valid");
            assert_eq!(again.to_toml(), written);
        }
        Err(error) => {
            let message = error.to_string();
            assert!(!message.is_empty() && !message.contains('\n'), "{message:?}");
        }
    }
}

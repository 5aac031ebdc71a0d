//! The text of a configuration, as a file or a description on the bus has it.

use bench_dragon::config::Config;

/// A text is refused in one line, or valid; then its dragon can walk, and what is written of it reads back the same.
pub(crate) fn check(input: &[u8]) {
    let text = String::from_utf8_lossy(input);
    match Config::from_toml(&text) {
        Ok(config) => {
            let dragon = config.dragon();
            assert!(dragon.start_travel_m().is_finite() && dragon.end_travel_m().is_finite());
            assert!(config.start_s() <= config.end_s());
            let written = config.to_toml();
            let again = Config::from_toml(&written).expect("its own text is valid");
            assert_eq!(again.to_toml(), written);
        }
        Err(error) => {
            let message = error.to_string();
            assert!(!message.is_empty() && !message.contains('\n'), "{message:?}");
        }
    }
}

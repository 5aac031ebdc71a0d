//! The description of a run as parameters: a name with dots for each value.

use std::collections::BTreeSet;

use serde_json::{Value, json};

/// Greatest number of parameters. A route of many segments has more values; the others are left out.
const MAX_PARAMETERS: usize = 1_000;
/// Greatest length of a list that is shown, such as the points of a border.
const MAX_ITEMS: usize = 64;

/// The parameters whose changes a viewer gets.
#[derive(Clone, Debug)]
pub(super) enum FollowedParameters {
    All,
    /// Those with these names, at most [`MAX_PARAMETERS`].
    Named(BTreeSet<String>),
}

impl Default for FollowedParameters {
    fn default() -> Self {
        Self::Named(BTreeSet::new())
    }
}

impl FollowedParameters {
    /// Adds names. No names are those of all parameters.
    pub(super) fn follow(&mut self, names: Vec<String>) {
        match self {
            Self::Named(known) if !names.is_empty() => {
                known.extend(names.into_iter().take(MAX_PARAMETERS.saturating_sub(known.len())));
            }
            all => *all = Self::All,
        }
    }

    /// Removes names. No names are those of all parameters, and so is each name of a viewer that follows all.
    pub(super) fn leave(&mut self, names: &[String]) {
        match self {
            Self::Named(known) if !names.is_empty() => known.retain(|name| !names.contains(name)),
            all => *all = Self::default(),
        }
    }

    pub(super) fn contains(&self, name: &str) -> bool {
        match self {
            Self::All => true,
            Self::Named(known) => known.contains(name),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        matches!(self, Self::Named(known) if known.is_empty())
    }
}

/// The parameters of a run with this description.
pub(super) fn parameters_of(run_id: u64, toml: &str) -> Vec<Value> {
    let mut parameters = vec![parameter("run_id", json!(run_id))];
    add(&mut parameters, "", &toml::Value::Table(toml.parse().unwrap_or_default()));
    parameters
}

/// The name of a parameter.
pub(super) fn name_of(parameter: &Value) -> &str {
    parameter["name"].as_str().unwrap_or_default()
}

/// Adds the values of a table or a list, under their names.
fn add(parameters: &mut Vec<Value>, name: &str, value: &toml::Value) {
    match value {
        toml::Value::Table(table) => {
            let prefix = if name.is_empty() { String::new() } else { format!("{name}.") };
            table.iter().for_each(|(key, value)| add(parameters, &format!("{prefix}{key}"), value));
        }
        toml::Value::Array(items) if items.iter().any(toml::Value::is_table) => {
            items.iter().enumerate().for_each(|(index, item)| add(parameters, &format!("{name}.{index}"), item));
        }
        toml::Value::Array(items) if items.len() > MAX_ITEMS => {}
        _ if parameters.len() >= MAX_PARAMETERS => {}
        value => parameters.push(parameter(name, json!(value))),
    }
}

fn parameter(name: &str, value: Value) -> Value {
    let mut parameter = json!({ "name": name });
    if value.is_f64() {
        // Without the type, a viewer shows 2.0 as an integer.
        parameter["type"] = "float64".into();
    }
    parameter["value"] = value;
    parameter
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_of_a_description_is_a_parameter_and_long_lists_are_left_out() {
        let points = "1.0, ".repeat(MAX_ITEMS + 1);
        let toml = format!(
            "[serve]\nrate_hz = 60\n[head]\nspeed_mps = 2.0\n[stage]\ncrowd = [{points}]\n[[dragons]]\nname = \"gold\"\n"
        );
        let parameters = parameters_of(7, &toml);
        assert_eq!(
            json!(parameters),
            json!([
                { "name": "run_id", "value": 7 },
                { "name": "dragons.0.name", "value": "gold" },
                { "name": "head.speed_mps", "value": 2.0, "type": "float64" },
                { "name": "serve.rate_hz", "value": 60 },
            ])
        );
    }

    #[test]
    fn names_are_followed_and_left_alone_or_all_at_once_and_their_number_is_bounded() {
        let names = |range: std::ops::Range<usize>| range.map(|number| number.to_string()).collect::<Vec<_>>();
        let mut followed = FollowedParameters::default();
        assert!(followed.is_empty());
        followed.follow(names(0..3));
        followed.leave(&names(1..3));
        assert_eq!(["0", "1"].map(|name| followed.contains(name)), [true, false]);
        followed.follow(names(0..3 * MAX_PARAMETERS));
        followed.follow(names(3 * MAX_PARAMETERS..4 * MAX_PARAMETERS));
        assert!(matches!(&followed, FollowedParameters::Named(known) if known.len() <= MAX_PARAMETERS));
        followed.follow(Vec::new());
        assert!(followed.contains("any"));
        followed.leave(&[]);
        assert!(followed.is_empty());
    }

    #[test]
    fn the_number_of_parameters_is_bounded() {
        let toml = (0..2 * MAX_PARAMETERS).fold(String::new(), |toml, number| format!("{toml}key{number} = 1\n"));
        assert_eq!(parameters_of(7, &toml).len(), MAX_PARAMETERS);
    }
}

//! The description of a run as parameters: a name with dots for each value.

use serde_json::{Value, json};

/// Greatest number of parameters. A route of many segments has more values; the others are left out.
pub(super) const MAX_PARAMETERS: usize = 1_000;
/// Greatest length of a list that is shown, such as the points of a border.
const MAX_ITEMS: usize = 64;

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
    fn the_number_of_parameters_is_bounded() {
        let toml = (0..2 * MAX_PARAMETERS).fold(String::new(), |toml, number| format!("{toml}key{number} = 1\n"));
        assert_eq!(parameters_of(7, &toml).len(), MAX_PARAMETERS);
    }
}

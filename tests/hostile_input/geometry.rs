//! A well-formed configuration with any numbers. A text of random bytes is hardly ever well-formed.

use std::collections::BTreeMap;

use crate::config;

/// Bytes of a key with its number: the key, the meaning of the number, the number.
const ENTRY_BYTES: usize = 10;
/// The keys that take a number.
const KEYS: [(&str, &str); 16] = [
    ("dragon", "benches"),
    ("dragon", "head_length_m"),
    ("dragon", "body_length_m"),
    ("dragon", "width_m"),
    ("dragon", "hole_offset_m"),
    ("route", "pitch_m"),
    ("route", "start_turns"),
    ("route", "turn_diameter_m"),
    ("route", "radius_ratio"),
    ("route", "start_s"),
    ("route", "end_s"),
    ("head", "speed_mps"),
    ("serve", "rate_hz"),
    ("serve", "time_scale"),
    ("monitor", "near_m"),
    ("route", "kind"),
];

/// Fails as for any configuration. A valid configuration follows its dragon to the end of its run.
pub(crate) fn check(input: &[u8]) {
    config::check(text(input).as_bytes());
}

fn text(input: &[u8]) -> String {
    let mut tables = BTreeMap::<&str, BTreeMap<&str, String>>::new();
    for entry in input.chunks_exact(ENTRY_BYTES) {
        let (table, key) = KEYS[entry[0] as usize % KEYS.len()];
        let bits = u64::from_le_bytes(entry[2..].try_into().expect("eight bytes"));
        tables.entry(table).or_default().insert(key, value(key, entry[1], bits));
    }
    let mut text = Vec::new();
    for (name, table) in &tables {
        text.push(format!("[{name}]\n"));
        text.extend(table.iter().map(|(key, value)| format!("{key} = {value}\n")));
    }
    text.concat()
}

fn value(key: &str, meaning: u8, bits: u64) -> String {
    match key {
        "kind" if bits.is_multiple_of(2) => "\"spiral\"".to_owned(),
        "kind" => "\"turnaround\"".to_owned(),
        "benches" | "rate_hz" => (bits % 120_000).to_string(),
        // One number in eight is arbitrary. The others are plausible: from a micrometre to a hundred kilometres, and times of
        // either sign.
        _ if meaning.is_multiple_of(8) => format!("{:?}", f64::from_bits(bits)).replace("NaN", "nan"),
        _ => {
            let sign = if key.ends_with("_s") && meaning.is_multiple_of(2) { -1.0 } else { 1.0 };
            format!("{:?}", sign * 10_f64.powf((bits >> 11) as f64 / (1_u64 << 53) as f64 * 11.0 - 6.0))
        }
    }
}

//! The channels that viewers may subscribe to: topic, encoding and schema. All but the status are as in our recordings.

use serde_json::{Value, json};

use crate::recording::Topic;

/// Name of the schema of the status.
const STATUS_SCHEMA: &str = "bench_dragon.Status";
const STATUS_TOPIC: &str = "/dragon/status";

/// A channel that a viewer may subscribe to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// The poses of a dragon, by its number.
    Poses(usize),
    Transforms,
    Boards,
    Status,
    Alerts,
    Commands,
}

impl Channel {
    /// The channels that every run has. A viewer knows them by their place in this list.
    pub(super) const FIXED: [Self; 5] = [Self::Transforms, Self::Boards, Self::Status, Self::Alerts, Self::Commands];

    /// Whether each frame has a message of the channel.
    pub(super) fn is_of_frames(self) -> bool {
        !matches!(self, Self::Alerts | Self::Commands)
    }

    /// The channel's declaration. `topic`: that of the poses of a dragon.
    pub(super) fn declare(self, id: u32, topic: &str) -> Value {
        let recorded = match self {
            Self::Poses(_) => Topic::Poses,
            Self::Transforms => Topic::Transforms,
            Self::Boards => Topic::Boards,
            Self::Alerts => Topic::Alerts,
            Self::Commands => Topic::Commands,
            Self::Status => {
                return json!({
                    "id": id,
                    "topic": STATUS_TOPIC,
                    "encoding": "json",
                    "schemaName": STATUS_SCHEMA,
                    "schemaEncoding": "jsonschema",
                    "schema": status_schema().to_string(),
                });
            }
        };
        let (name, definition) = recorded.schema();
        let topic = if matches!(self, Self::Poses(_)) { topic } else { recorded.name() };
        json!({
            "id": id,
            "topic": topic,
            "encoding": "cdr",
            "schemaName": name,
            "schemaEncoding": "ros2msg",
            "schema": definition,
        })
    }
}

/// The channels that a viewer knows, with the numbers that it knows them by. No number is used for two topics.
#[derive(Debug, Default)]
pub(super) struct KnownChannels {
    /// Number and topic of the poses of each dragon.
    poses: Vec<(u32, String)>,
    next: u32,
}

impl KnownChannels {
    /// The channel with a number.
    pub(super) fn get(&self, id: u32) -> Option<Channel> {
        let dragon = self.poses.iter().position(|(known, _)| *known == id).map(Channel::Poses);
        dragon.or_else(|| Channel::FIXED.get(id as usize).copied())
    }

    /// Takes the topics of a run. Returns the numbers of those that are gone, and the declarations of the new ones.
    pub(super) fn set_poses(&mut self, topics: &[String]) -> (Vec<u32>, Vec<Value>) {
        let mut before = std::mem::take(&mut self.poses);
        let mut declared = Vec::new();
        for (dragon, topic) in topics.iter().enumerate() {
            let known = before.iter().position(|(_, known)| known == topic).map(|index| before.swap_remove(index));
            let (id, topic) = known.unwrap_or_else(|| {
                let id = Channel::FIXED.len() as u32 + self.next;
                self.next += 1;
                declared.push(Channel::Poses(dragon).declare(id, topic));
                (id, topic.clone())
            });
            self.poses.push((id, topic));
        }
        (before.into_iter().map(|(id, _)| id).collect(), declared)
    }
}

/// The topics of the poses of dragons with these names; without names, that of the one dragon.
pub(super) fn pose_topics(names: &[String]) -> Vec<String> {
    if names.is_empty() {
        return vec![Topic::Poses.name().to_owned()];
    }
    names.iter().map(|name| Topic::poses_of(name)).collect()
}

/// The schema of the status: numbers to plot, and states.
fn status_schema() -> Value {
    let of_type = |kind: &str| json!({ "type": kind });
    let number = || of_type("number");
    let dragon = json!({
        "type": "object",
        "properties": { "name": of_type("string"), "travel_m": number(), "speed_mps": number() },
    });
    json!({
        "type": "object",
        "title": STATUS_SCHEMA,
        "properties": {
            "run_id": of_type("integer"),
            "tick": of_type("integer"),
            "link": of_type("string"),
            "state": of_type("string"),
            "show_time_s": number(),
            "travel_m": number(),
            "speed_mps": number(),
            "time_scale": number(),
            "clearance_m": number(),
            "clearance_benches": { "type": "array", "items": of_type("integer") },
            "least_clearance_m": number(),
            "rate_hz": number(),
            "overruns": of_type("integer"),
            "behind_s": number(),
            "lost": of_type("integer"),
            "dragons": { "type": "array", "items": dragon },
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_topic_keeps_its_number_and_no_number_is_used_for_two_topics() {
        let mut channels = KnownChannels::default();
        let mut set = |topics: &[&str]| {
            let topics: Vec<String> = topics.iter().map(|topic| (*topic).to_owned()).collect();
            let (gone, declared) = channels.set_poses(&topics);
            let declared: Vec<Value> =
                declared.into_iter().map(|channel| json!([channel["id"], channel["topic"]])).collect();
            (gone, json!(declared), channels.poses.iter().map(|(id, _)| channels.get(*id)).collect::<Vec<_>>())
        };
        let [first, second] = [0, 1].map(|dragon| Some(Channel::Poses(dragon)));
        assert_eq!(set(&["one", "two"]), (vec![], json!([[5, "one"], [6, "two"]]), vec![first, second]));
        assert_eq!(set(&["two", "one"]), (vec![], json!([]), vec![first, second]));
        assert_eq!(set(&["two"]), (vec![5], json!([]), vec![first]));
        assert_eq!(set(&["one"]), (vec![6], json!([[7, "one"]]), vec![first]));
        assert_eq!((channels.get(2), channels.get(5)), (Some(Channel::Status), None));
    }
}

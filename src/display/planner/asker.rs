//! The questions of `solve`, asked by a page. Each is a process of its own ([`child`]): the page's newest, older ones are cancelled.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::Deserialize;
use serde_json::{Value, json};

use super::change::{Put, difference};
use super::child::{self, Ended, Files, Progress};
use super::newest::Newest;
use super::plan_folder::PlanFolder;

/// Time between two reports of progress.
const REPORT_PERIOD: Duration = Duration::from_millis(250);

/// A question of `solve` that a page may ask.
struct Kind {
    name: &'static str,
    args: &'static [&'static str],
    /// Flags that the page may set.
    flags: &'static [&'static str],
    files: Files,
}

const KINDS: [Kind; 8] = [
    Kind { name: "pitch", args: &["pitch"], flags: &["turn-diameter", "clearance"], files: Files::PlanAndAnswer },
    Kind {
        name: "turn",
        args: &["turn"],
        flags: &["pitch", "turn-diameter", "radius-ratio", "turn-line", "clearance", "max-ratio"],
        files: Files::PlanAndAnswer,
    },
    Kind {
        name: "shortest",
        args: &["turn", "--shortest"],
        flags: &["pitch", "turn-diameter", "clearance", "max-ratio"],
        files: Files::PlanAndAnswer,
    },
    Kind {
        name: "profile",
        args: &["profile"],
        flags: &["limit", "accel", "speed", "within"],
        files: Files::PlanAndAnswer,
    },
    Kind { name: "speed-limit", args: &["speed-limit"], flags: &["limit"], files: Files::PlanAndAnswer },
    Kind { name: "schedule", args: &["schedule"], flags: &["clearance", "order"], files: Files::PlanAndAnswer },
    Kind {
        name: "sensitivity",
        args: &["sensitivity"],
        flags: &["range", "steps", "turn-diameter"],
        files: Files::Plan,
    },
    Kind { name: "sweep", args: &["sweep"], flags: &["tolerance"], files: Files::Plan },
];

/// A question with its options, about a text.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Asked {
    number: u64,
    text: String,
    ask: String,
    options: BTreeMap<String, Value>,
}

impl Asked {
    /// The arguments of `bench-dragon`.
    fn command(&self) -> Result<(Vec<String>, Files), String> {
        let kind = KINDS.iter().find(|kind| kind.name == self.ask).ok_or("there is no such question")?;
        let mut args = vec!["solve".to_owned()];
        args.extend(kind.args.iter().map(|&arg| arg.to_owned()));
        for (flag, value) in &self.options {
            if flag != "work" && !kind.flags.contains(&&**flag) {
                return Err(format!("{} has no option {flag:?}", self.ask));
            }
            match value {
                Value::Bool(true) => args.push(format!("--{flag}")),
                Value::Bool(false) | Value::Null => {}
                Value::Number(number) => args.push(format!("--{flag}={number}")),
                _ => return Err(format!("{flag} must be a number")),
            }
        }
        Ok((args, kind.files))
    }
}

/// Answers the newest questions until the place is closed. `None` in the place cancels. `send` returns whether the page is still there.
pub(super) fn answer_all(
    folder: &Arc<PlanFolder>,
    asked: &Newest<Option<Asked>>,
    mut send: impl FnMut(&Value) -> bool,
) {
    while let Some(next) = asked.take() {
        let Some(question) = next else { continue };
        let mut report = |mut answer: Value| {
            answer["type"] = "asked".into();
            answer["number"] = question.number.into();
            send(&answer)
        };
        let mut due = Instant::now();
        let look = |Progress { elapsed, share }: Progress| {
            if asked.is_outdated() {
                return false;
            }
            if Instant::now() < due {
                return true;
            }
            due = Instant::now() + REPORT_PERIOD;
            report(json!({ "state": "running", "elapsed_s": elapsed.as_secs_f64(), "share": share }))
        };
        let answer = answer(folder, &question, look);
        if !report(answer) {
            return;
        }
    }
}

fn answer(folder: &PlanFolder, question: &Asked, look: impl FnMut(Progress) -> bool) -> Value {
    let failed = |words: &str| json!({ "state": "failed", "words": words });
    let (args, files) = match question.command() {
        Ok(command) => command,
        Err(reason) => return failed(&reason),
    };
    let config = match folder.config(&question.text) {
        Ok(config) => config,
        Err(reason) => return failed(&reason),
    };
    // Several dragons have a limit each, which no configuration has.
    let files = if question.ask == "speed-limit" && config.named().is_some() { Files::Plan } else { files };
    let before = config.to_toml();
    match child::run(&args, &folder.with_whole_paths(&question.text), files, look) {
        Err(error) => failed(&error.to_string()),
        Ok(None) => json!({ "state": "cancelled" }),
        // An answer without a configuration has said why: the rest repeats it.
        Ok(Some(Ended { printed, messages, is_success, answer })) if is_success || !printed.is_empty() => {
            let puts = answer.and_then(|after| puts(&before, &after)).filter(|puts| !puts.is_empty());
            let is_news = is_success && !messages.is_empty();
            let words = if is_news { format!("{printed}{messages}\n") } else { printed };
            json!({ "state": "done", "words": words, "puts": puts })
        }
        Ok(Some(Ended { messages, .. })) => failed(&folder.in_short(&messages)),
    }
}

/// What the answer changes in the plan.
fn puts(before: &str, after: &str) -> Option<Vec<Put>> {
    Some(difference(&toml::from_str(before).ok()?, &toml::from_str(after).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(ask: &str, options: &Value) -> Asked {
        let asked = json!({ "number": 1, "text": "", "ask": ask, "options": options });
        serde_json::from_value(asked).expect("a question")
    }

    #[test]
    fn a_page_asks_only_questions_of_solve_with_their_own_flags() {
        let (args, _) = asked("pitch", &json!({ "clearance": 0.05 })).command().expect("a question");
        assert_eq!(args, ["solve", "pitch", "--clearance=0.05"]);
        let (args, _) = asked("schedule", &json!({ "clearance": 0.5, "order": true })).command().expect("a question");
        assert_eq!(args, ["solve", "schedule", "--clearance=0.5", "--order"]);
        for (ask, options) in [
            ("pitch", json!({ "figure": 1 })),
            ("pitch", json!({ "clearance": "1 --figure /tmp/x.svg" })),
            ("serve", json!({})),
        ] {
            asked(ask, &options).command().expect_err("it is refused");
        }
    }
}

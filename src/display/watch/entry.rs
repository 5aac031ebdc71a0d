//! A number that is being typed.

use bench_dragon_ipc::Request;

/// The longest one.
const LONGEST: usize = 16;

/// What the number is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Subject {
    Speed,
    Seek,
}

/// The number as far as it is typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    subject: Subject,
    text: String,
}

impl Entry {
    pub(super) fn new(subject: Subject) -> Self {
        Self { subject, text: String::new() }
    }

    /// Adds a character; one that no number has is left out.
    pub(super) fn push(&mut self, character: char) {
        // What is no number is seen as typed, and refused when it is entered.
        if self.text.len() < LONGEST && character.is_ascii_graphic() {
            self.text.push(character);
        }
    }

    /// Takes the last character back.
    pub(super) fn take_back(&mut self) {
        self.text.pop();
    }

    /// The line as it is shown; what is typed next comes at its end.
    pub(super) fn line(&self) -> String {
        let asked = match self.subject {
            Subject::Speed => "speed of the head in m/s",
            Subject::Seek => "show time to go to in s",
        };
        format!("{asked}: {}", self.text)
    }

    /// The command, or why it is none.
    pub(super) fn request(&self) -> Result<Request, String> {
        let value = self.text.parse().ok().filter(|value: &f64| value.is_finite());
        let value = value.ok_or_else(|| format!("{:?} is not a number: nothing was sent", self.text))?;
        Ok(match self.subject {
            Subject::Speed => Request::Speed { speed_mps: value },
            Subject::Seek => Request::Seek { sim_time_s: value },
        })
    }
}

//! The cues of a description, with their places on the course.

use bench_dragon_ipc::FrameHeader;

/// The cues of a description, in the order of plan time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlannedCues {
    cues: Vec<PlannedCue>,
}

/// A cue with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedCue {
    /// Its name.
    pub name: String,
    /// Plan time in seconds.
    pub at_s: f64,
    /// Place on the course in metres, as [`FrameHeader::course_m`].
    pub course_m: f64,
    /// Text for operators; empty without one.
    pub note: String,
}

impl PlannedCues {
    /// Reads the cues in the text of a description, which has their plan times. Places no dragon on its route, so it takes little
    /// time.
    ///
    /// ```
    /// use bench_dragon::config::PlannedCues;
    ///
    /// let toml = "[head]\nspeed_mps = 0.5\n[[cues]]\nname = \"turn\"\nat_s = 12.0\nnote = \"lights 4\"\n";
    /// let cues = PlannedCues::of_toml(toml);
    /// assert_eq!(cues.named("turn").map(|cue| (cue.at_s, cue.course_m)), Some((12.0, 6.0)));
    /// assert_eq!(PlannedCues::of_toml("").all(), []);
    /// ```
    pub fn of_toml(toml: &str) -> Self {
        let table = toml.parse::<toml::Table>().unwrap_or_default();
        let leading = table.get("dragons").and_then(|dragons| dragons.as_array()?.first()?.as_table());
        let head = leading.unwrap_or(&table).get("head");
        let speed_mps = head.and_then(|head| head.get("speed_mps")?.as_float()).unwrap_or(1.0);
        let cue = |cue: &toml::Value| {
            let at_s = cue.get("at_s")?.as_float()?;
            let text = |key: &str| Some(cue.get(key)?.as_str()?.to_owned());
            Some(PlannedCue {
                name: text("name")?,
                at_s,
                course_m: at_s * speed_mps,
                note: text("note").unwrap_or_default(),
            })
        };
        let cues = table.get("cues").and_then(|cues| cues.as_array()?.iter().map(cue).collect());
        Self { cues: cues.unwrap_or_default() }
    }

    /// All cues.
    pub fn all(&self) -> &[PlannedCue] {
        &self.cues
    }

    /// The cue of a name.
    pub fn named(&self, name: &str) -> Option<&PlannedCue> {
        self.cues.iter().find(|cue| cue.name == name)
    }

    /// The names in a message: `must be one of "a", "b"`.
    pub fn allowed_names(&self) -> String {
        let names: Vec<String> = self.cues.iter().map(|cue| format!("\"{}\"", cue.name)).collect();
        if names.is_empty() {
            "the show has no cues".to_owned()
        } else {
            format!("must be one of {}", names.join(", "))
        }
    }

    /// The cues that the show has reached from a frame to a later one: by walking, or by a seek or a restart to them. Without an
    /// earlier frame, those at which the show stands.
    pub fn reached(&self, earlier: Option<&FrameHeader>, later: &FrameHeader) -> &[PlannedCue] {
        /// Longest show time between two frames of a show that walks, in seconds of the clock.
        const LONGEST_S: f64 = 2.0;
        let to_m = later.course_m;
        let has_walked = |earlier: &&FrameHeader| {
            let walked_m = to_m - earlier.course_m;
            let fastest_mps = later.course_mps.max(earlier.course_mps) * later.time_scale.max(1.0);
            earlier.run_id == later.run_id && walked_m >= 0.0 && walked_m <= LONGEST_S * fastest_mps.max(1.0)
        };
        let first = match earlier.filter(has_walked) {
            Some(earlier) => self.cues.partition_point(|cue| cue.course_m <= earlier.course_m),
            None => self.cues.partition_point(|cue| cue.course_m < to_m),
        };
        let end = self.cues.partition_point(|cue| cue.course_m <= to_m);
        &self.cues[first.min(end)..end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(run_id: u64, course_m: f64) -> FrameHeader {
        FrameHeader { run_id, course_m, course_mps: 1.0, time_scale: 1.0, ..FrameHeader::default() }
    }

    #[test]
    fn a_cue_is_reached_once_by_walking_and_again_by_a_seek_or_a_restart_to_it() {
        let toml = "[[cues]]\nname = \"a\"\nat_s = 1.0\n[[cues]]\nname = \"b\"\nat_s = 1.0\n[[cues]]\nname = \"c\"\nat_s = 50.0\n";
        let cues = PlannedCues::of_toml(toml);
        for (earlier, later, expected) in vec![
            (None, frame(1, 0.0), ""),
            (None, frame(1, 1.0), "ab"),
            (Some(frame(1, 0.9)), frame(1, 1.0), "ab"),
            (Some(frame(1, 0.9)), frame(1, 1.1), "ab"),
            (Some(frame(1, 1.0)), frame(1, 1.1), ""),
            (Some(frame(1, 1.0)), frame(1, 1.0), ""),
            (Some(frame(1, 1.0)), frame(2, 1.0), "ab"),
            (Some(frame(1, 0.0)), frame(1, 50.0), "c"),
            (Some(frame(1, 0.0)), frame(1, 60.0), ""),
            (Some(frame(1, 60.0)), frame(1, 50.0), "c"),
        ] {
            let names: String = cues.reached(earlier.as_ref(), &later).iter().map(|cue| cue.name.as_str()).collect();
            assert_eq!(names, expected, "{:?} to {}", earlier.map(|earlier| earlier.course_m), later.course_m);
        }
    }
}

//! The tables of a report.

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::AlertKind;

use super::ReportSource;
use super::words::{clock, counts_words, duration, left_out, sender};
use crate::cli::show::course::{AlertReport, CourseReport};
use crate::cli::show::wall_time::WallTime;
use crate::output::Counted;
use crate::output::report::{Block, Table};

/// Most alerts and commands in the tables. Of more alerts, those of near pairs are left out first.
const MOST_ROWS: usize = 100;

impl ReportSource<'_> {
    /// The cues; nothing for a plan without them.
    pub(super) fn cues(&self) -> Vec<Block> {
        let rows = self.summary.course.cues.iter().map(|cue| {
            let clocks: Vec<String> = cue.reached.iter().map(|time| clock(&time.at.local())).collect();
            let times: Vec<String> = cue.reached.iter().map(|time| Fixed::<3>(time.time_s).to_string()).collect();
            let or_never = |text: String| if text.is_empty() { "not reached".to_owned() } else { text };
            vec![
                cue.name.clone(),
                Fixed::<3>(cue.at_s).to_string(),
                or_never(clocks.join(", ")),
                times.join(", "),
                if cue.waits { "waits for GO".to_owned() } else { String::new() },
                cue.note.clone().unwrap_or_default(),
            ]
        });
        let table = Table {
            columns: vec!["cue", "plan time (s)", "reached", "show time (s)", "effect", "note"],
            numbers: vec!["plan time (s)", "show time (s)"],
            rows: rows.collect(),
            empty: String::new(),
            left_out: None,
        };
        (!table.rows.is_empty()).then_some(Block::Table(table)).into_iter().collect()
    }

    pub(super) fn holds(&self) -> Table {
        let CourseReport { holds, holds_left_out, .. } = &self.summary.course;
        let rows = holds.iter().map(|hold| {
            let released = match (&hold.end, &hold.released_by) {
                (Some(end), Some(by)) => format!("{} by {}", clock(&end.local()), sender(by, hold.released_by_pid)),
                (Some(end), None) => clock(&end.local()),
                (None, _) => "not before the end".to_owned(),
            };
            let lasted = hold.end.unwrap_or(self.summary.course.end).seconds_since(hold.begin);
            vec![
                clock(&hold.begin.local()),
                Fixed::<3>(hold.time_s).to_string(),
                sender(&hold.by, hold.by_pid),
                released,
                duration(lasted),
            ]
        });
        Table {
            columns: vec!["from", "show time (s)", "held by", "until", "lasted"],
            numbers: vec!["show time (s)", "lasted"],
            rows: rows.collect(),
            empty: (if self.config.named().is_some() { "The show was not held." } else { "The dragon was not held." })
                .to_owned(),
            left_out: left_out(*holds_left_out, "earlier hold", ""),
        }
    }

    pub(super) fn restarts(&self) -> Table {
        let rows = self.summary.restart_log.iter().map(|end| {
            vec![
                WallTime::parse(&end.at).map_or_else(|| end.at.clone(), |at| clock(&at.local())),
                end.show_time_s.map_or("before the first frame".to_owned(), |time_s| format!("{}", Fixed::<3>(time_s))),
                end.role.clone(),
                end.reason.clone(),
                if end.restarted { "started again" } else { "not started again" }.to_owned(),
            ]
        });
        Table {
            columns: vec!["time", "show time (s)", "process", "ended by", "then"],
            numbers: vec!["show time (s)"],
            rows: rows.collect(),
            empty: "No process ended early.".to_owned(),
            left_out: None,
        }
    }

    pub(super) fn recordings(&self) -> Table {
        let rows = self.recordings.iter().map(|(path, bytes)| {
            let size = bytes.map_or("not there".to_owned(), |bytes| format!("{:.1} MB", bytes as f64 / 1e6));
            vec![path.display().to_string(), size]
        });
        let frames = self.summary.frames;
        Table {
            columns: vec!["file", "size"],
            numbers: vec!["size"],
            rows: rows.collect(),
            empty: "Nothing was recorded.".to_owned(),
            left_out: Some(format!("{} of {} are recorded.", frames.recorded, Counted(frames.published, "frame"))),
        }
    }

    pub(super) fn alerts(&self) -> Vec<Block> {
        let CourseReport { alerts, alerts_left_out, .. } = &self.summary.course;
        let shown = most_important(alerts);
        let missing = alerts_left_out + (alerts.len() - shown.len()) as u64;
        let rows = shown.into_iter().map(|AlertReport { at, alert }| {
            let place =
                alert.point_m.map_or_else(String::new, |[x, y]| format!("({}, {})", Fixed::<3>(x), Fixed::<3>(y)));
            vec![
                clock(&at.local()),
                Fixed::<3>(alert.time_s).to_string(),
                alert.kind.clone(),
                alert.who().unwrap_or_default(),
                alert.clearance_m.map_or_else(String::new, |clearance_m| Fixed::<1>(1000.0 * clearance_m).to_string()),
                place,
            ]
        });
        let table = Table {
            columns: vec!["time", "show time (s)", "alert", "of", "clearance (mm)", "at (m)"],
            numbers: vec!["show time (s)", "clearance (mm)"],
            rows: rows.collect(),
            empty: "There was no alert.".to_owned(),
            left_out: left_out(missing, "alert", ": the recording has them"),
        };
        let counts = counts_words(&self.summary.course);
        let words = (!counts.is_empty()).then(|| Block::Words(format!("In all: {counts}.")));
        words.into_iter().chain([Block::Table(table)]).collect()
    }

    pub(super) fn commands(&self) -> Table {
        let CourseReport { commands, commands_left_out, commands_lost, .. } = &self.summary.course;
        let first = commands.len().saturating_sub(MOST_ROWS);
        let rows = commands[first..].iter().map(|line| {
            let what = line.text.strip_prefix(&format!("{}: ", line.sender)).unwrap_or(&line.text);
            let time = WallTime::parse(&line.wall_time).map_or_else(|| line.wall_time.clone(), |at| clock(&at.local()));
            vec![time, Fixed::<3>(line.time_s).to_string(), sender(&line.sender, line.pid), what.to_owned()]
        });
        let missing = commands_left_out + commands_lost + first as u64;
        Table {
            columns: vec!["time", "show time (s)", "sender", "command"],
            numbers: vec!["show time (s)"],
            rows: rows.collect(),
            empty: "There was no command.".to_owned(),
            left_out: left_out(missing, "earlier or lost command", ": the recording has them"),
        }
    }
}

/// At most [`MOST_ROWS`] alerts, in their order: the last of near pairs, and the last of all others before those.
fn most_important(alerts: &[AlertReport]) -> Vec<&AlertReport> {
    let is_near = |alert: &&AlertReport| alert.alert.kind == AlertKind::Near.name();
    let others = alerts.iter().filter(|alert| !is_near(alert)).count().min(MOST_ROWS);
    let mut room = [others, MOST_ROWS - others];
    let mut shown: Vec<&AlertReport> = alerts
        .iter()
        .rev()
        .filter(|alert| {
            let room = &mut room[usize::from(is_near(alert))];
            let has_room = *room > 0;
            *room = room.saturating_sub(1);
            has_room
        })
        .collect();
    shown.reverse();
    shown
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::FrameHeader;

    use super::*;
    use crate::cli::monitor::lines::AlertLine;
    use crate::safety::monitor::run_alert;

    fn alert(kind: AlertKind) -> AlertReport {
        AlertReport { at: WallTime::default(), alert: AlertLine::of(&run_alert(&FrameHeader::default(), kind), None) }
    }

    #[test]
    fn alerts_of_near_pairs_are_left_out_first_and_the_order_stays() {
        let mut alerts = vec![alert(AlertKind::Contact)];
        alerts.extend((0..3 * MOST_ROWS).map(|_| alert(AlertKind::Near)));
        alerts.push(alert(AlertKind::Held));
        let shown = most_important(&alerts);
        let kinds: Vec<&str> = shown.iter().map(|shown| &*shown.alert.kind).collect();
        assert_eq!((kinds.len(), kinds[0], kinds[1], kinds[MOST_ROWS - 1]), (MOST_ROWS, "contact", "near", "held"));
        let contacts: Vec<AlertReport> = (0..2 * MOST_ROWS).map(|_| alert(AlertKind::Contact)).collect();
        assert_eq!(most_important(&contacts).len(), MOST_ROWS);
    }
}

//! The last two lines: the outcome of the last command or a prompt, and the keys.

use bench_dragon_ipc::{CommandEvent, CommandReply, Request};
use ratatui::Frame;
use ratatui::layout::{Position, Rect};
use ratatui::text::{Line, Span};

use super::drawing::LAMPED;
use super::keys::space_request;
use super::look::{Tone, strong};
use super::screen::Screen;
use crate::command_queue::CommandQueueError;
use crate::display::observe::{Controls, Snapshot};
use crate::output::command_words::request_words;

/// Keys that are always shown.
const HELP: (&str, &str) = ("?", "help");
const QUIT: (&str, &str) = ("q", "quit");
/// Columns between two keys.
const GAP: usize = 2;

/// Draws the number being typed with the cursor behind it, else the confirmation, else the outcome. On a screen without lamps,
/// an unacknowledged contact takes precedence over the outcome.
pub(super) fn draw_reply(frame: &mut Frame<'_>, area: Rect, screen: &Screen) {
    let look = screen.look;
    if let Some(entry) = &screen.entry {
        let line = Line::styled(entry.line(), strong());
        let column = (line.width() as u16).min(area.width.saturating_sub(1));
        frame.render_widget(line, area);
        frame.set_cursor_position(Position::new(area.x + column, area.y));
    } else if let Some(confirmation) = &screen.confirmation {
        frame.render_widget(Line::styled(confirmation.text(), look.theme.block(Tone::Danger)), area);
    } else if let (Some(contact), true) = (&screen.past_contact, frame.area().height < LAMPED) {
        frame.render_widget(
            Line::styled(format!("{contact}, press a to acknowledge"), look.theme.block(Tone::Danger)),
            area,
        );
    } else if let Some(reply) = &screen.reply {
        frame.render_widget(Line::styled(reply.text.clone(), look.theme.text(reply.tone)), area);
    }
}

/// Draws the keys, the most important ones first. A key without enough room is left out. Help and quit are always drawn.
pub(super) fn draw_keys(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let look = screen.look;
    let (space, controls) = (space_request(snapshot), Controls::of(snapshot));
    let confirmation = screen.confirmation.map_or(("", ""), |confirmation| confirmation.keys());
    let keys: &[(&str, &str)] = match (screen.entry.is_some(), screen.confirmation.is_some(), screen.is_read_only) {
        (true, _, _) => &[("h", "hold"), ("enter", "send"), ("esc", "cancel")],
        (_, true, _) => &[("h", "hold"), confirmation, ("esc", "cancel")],
        (_, _, true) => &[HELP, QUIT, ("f", "follow"), ("0", "all"), ("[ ]", "zoom")],
        _ => &[
            ("h", "hold"),
            ("space", if space == Request::Pause { "pause" } else { "resume" }),
            ("r", "release"),
            ("g", "go"),
            HELP,
            QUIT,
            ("+ - v", "speed"),
            ("s", "seek"),
            ("f", "follow"),
            ("0", "all"),
        ],
    };
    let has_cues = snapshot.config().is_some_and(|config| !config.cues().is_empty());
    let keys: Vec<(&str, &str)> = keys.iter().copied().filter(|(key, _)| *key != "g" || has_cues).collect();
    let spans = fitting(&keys, area.width.into()).into_iter().flat_map(|(key, does)| {
        let is_refused = request(key, space).is_some_and(|request| controls.refusal(request).is_some());
        let style = if is_refused { look.theme.faint() } else { strong() };
        [Span::styled(key, style), Span::styled(format!(" {does}  "), look.theme.faint())]
    });
    frame.render_widget(spans.collect::<Line<'_>>(), area);
}

/// A request of the kind that a key sends.
fn request(key: &str, space: Request) -> Option<Request> {
    Some(match key {
        "h" => Request::Hold,
        "space" => space,
        "r" => Request::Release,
        "g" => Request::Go,
        "+ - v" => Request::Speed { speed_mps: 0.0 },
        "s" => Request::Seek { show_time_s: 0.0 },
        _ => return None,
    })
}

/// The keys for which there is room, in their order. Help and quit are always included.
fn fitting<'a>(keys: &[(&'a str, &'a str)], columns: usize) -> Vec<(&'a str, &'a str)> {
    let is_kept = |entry: &(&str, &str)| [HELP, QUIT].contains(entry);
    let width = |(key, does): &(&str, &str)| key.len() + 1 + does.len() + GAP;
    // The last key has no gap behind it.
    let mut room = (columns + GAP).saturating_sub(keys.iter().filter(|entry| is_kept(entry)).map(width).sum());
    let mut has_room = true;
    let fits = |entry: &&(&'a str, &'a str)| {
        if is_kept(entry) {
            return true;
        }
        has_room &= width(entry) <= room;
        room = room.saturating_sub(width(entry));
        has_room
    };
    keys.iter().filter(fits).copied().collect()
}

/// One line about a command.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CommandOutcome {
    /// The line.
    pub text: String,
    pub(super) tone: Tone,
    /// For a speed: the tick from which it holds, or that it was not accepted. `None` for other commands.
    pub(super) speed: Option<Result<u64, ()>>,
    /// Run and tick of the server's reply. `None` without a reply.
    pub(super) replied_at: Option<(u64, u64)>,
}

impl CommandOutcome {
    /// The outcome of a command that has just been sent.
    pub fn sent(request: Request) -> Self {
        Self::new(format!("{}: sent", request_words(request)), Tone::Calm)
    }

    /// The outcome of a command: the server's reply, or the reason for which there is none.
    pub fn to(request: Request, answer: Result<CommandReply, CommandQueueError>) -> Self {
        let name = request_words(request);
        let replied_at = answer.as_ref().ok().map(|reply| (reply.run_id, reply.tick));
        let outcome = answer.map(|reply| reply.outcome());
        let from_tick = if let Ok(Ok(tick)) = outcome { Ok(tick) } else { Err(()) };
        let reply = match outcome {
            Ok(Ok(tick)) => Self::new(format!("{name}: accepted, from tick {tick} on"), Tone::Good),
            Ok(Err(refusal)) => Self::new(format!("{name}: refused: {}", refusal.explain(&request)), Tone::Danger),
            Err(CommandQueueError::Bus(error)) => Self::new(format!("{name}: {error}"), Tone::Danger),
            Err(error) => Self::new(format!("{name}: not sent: {error}"), Tone::Caution),
        };
        Self { speed: matches!(request, Request::Speed { .. }).then_some(from_tick), replied_at, ..reply }
    }

    pub(super) fn new(text: String, tone: Tone) -> Self {
        Self { text, tone, speed: None, replied_at: None }
    }

    /// Whether an event happened before the server replied: a reply arrives sooner than the events before it.
    pub(super) fn is_after(&self, event: &CommandEvent) -> bool {
        self.replied_at.is_some_and(|(run_id, tick)| event.run_id == run_id && event.tick < tick)
    }
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::ShowState;

    use super::*;
    use crate::display::watch::sample::{rows_after, snapshot};

    #[test]
    fn the_most_important_keys_and_help_and_quit_are_shown_whole() {
        let keys = [("h", "hold"), ("space", "pause"), HELP, QUIT, ("f", "follow"), ("0", "all")];
        let shown = |columns| fitting(&keys, columns).iter().map(|(key, _)| *key).collect::<Vec<_>>().join(" ");
        let all = "h hold  space pause  ? help  q quit  f follow  0 all".len();
        assert_eq!(shown(all), "h space ? q f 0");
        assert_eq!(shown(all - 1), "h space ? q f");
        assert_eq!(shown("h hold  space pause  ? help  q quit".len()), "h space ? q");
        assert_eq!(shown("h hold  space pause  ? help  q quit".len() - 1), "h ? q");
        assert_eq!(shown(14), "? q");
    }

    #[test]
    fn the_keys_of_a_screen_of_80_by_24_are_shown_whole() {
        let rows = rows_after("", &snapshot(ShowState::Running, 300.0));
        let keys = "h hold  space pause  r release  ? help  q quit  + - v speed  s seek  f follow";
        assert_eq!(rows[23].trim_end(), keys);
    }

    #[test]
    fn the_confirmation_of_a_release_is_in_the_line_of_replies() {
        let rows = rows_after("r", &snapshot(ShowState::Held, 300.0));
        assert_eq!(rows[22].trim_end(), "release the hold? press r again");
        assert_eq!(rows[23].trim_end(), "h hold  r release  esc cancel");
    }
}

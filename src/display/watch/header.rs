//! The first two lines: the state of the show, and the lamps.

use bench_dragon_ipc::{ShowState, SourceKind};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::look::{Glyphs, Look, Tone, strong};
use super::panel::short;
use super::screen::Screen;
use crate::display::observe::{GuardSituation, Lamp, LampLevel, Snapshot, SourcePresence, lamps};

pub(super) fn draw_status(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let look = screen.look;
    let condition = Condition::of(snapshot);
    let sign = condition.sign(look.glyphs);
    let mut spans = vec![Span::styled(format!(" {sign} {:<8} ", condition.word), look.theme.block(condition.tone))];
    let is_live = snapshot.presence == SourcePresence::Live;
    let style = if is_live { strong() } else { look.theme.faint() };
    if let Some(header) = snapshot.header() {
        spans.push(Span::styled(format!("  t {:.3} s", header.sim_time_s()), style));
        spans.push(Span::styled(format!("   {:.3} m/s", header.head_speed_mps), Style::new()));
        let head = snapshot.frame.as_ref().and_then(|frame| frame.handles.first());
        let height_m = head.map_or(0.0, |head| head.position_m[2]);
        if height_m != 0.0 {
            spans.push(Span::styled(format!("   height {height_m:.2} m"), Style::new()));
        }
        spans.push(Span::raw(format!("   {} {}", look.glyphs.signs().cross, short(header.time_scale))));
    }
    spans.push(Span::raw(format!("   {}", screen.instance)));
    let (name, tone) = match snapshot.status.as_ref().and_then(|status| status.source_kind()) {
        Some(SourceKind::Replay) if is_live => ("REPLAY", Tone::Caution),
        Some(SourceKind::Remote) if is_live => ("another host", condition.tone),
        _ => (snapshot.presence.name(), condition.tone),
    };
    spans.push(Span::styled(format!("   {name}"), look.theme.text(tone)));
    if screen.read_only {
        spans.push(Span::styled("   read-only", look.theme.faint()));
    }
    frame.render_widget(Line::from(spans), area);
}

/// The state of the show as a word, and its urgency.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Condition {
    pub(super) word: &'static str,
    pub(super) tone: Tone,
    sign: usize,
}

impl Condition {
    /// Returns the condition of a snapshot. If the source is not live, its presence takes precedence over its last state.
    pub(super) fn of(snapshot: &Snapshot) -> Self {
        use SourcePresence::{Ended, Failed, Gone, Live, Silent, Waiting};
        let new = |word, tone, sign| Self { word, tone, sign };
        match (&snapshot.presence, snapshot.state()) {
            (Waiting, _) => new("WAITING", Tone::Caution, 1),
            (Failed { .. }, _) => new("FAILED", Tone::Danger, 2),
            (Ended { .. }, _) | (Live, Some(ShowState::Ended)) => new("ENDED", Tone::Calm, 3),
            (Gone { .. }, _) => new("LOST", Tone::Danger, 2),
            (Silent { .. }, _) => new("SILENT", Tone::Danger, 2),
            (Live, Some(ShowState::Running)) => new("RUNNING", Tone::Good, 0),
            (Live, Some(ShowState::Stopping)) => new("STOPPING", Tone::Caution, 1),
            (Live, Some(ShowState::Paused)) => new("PAUSED", Tone::Caution, 1),
            (Live, Some(ShowState::Held)) => match by_guard(snapshot) {
                GuardSituation::Missing => new("NO GUARD", Tone::Danger, 2),
                GuardSituation::Waiting => new("WAITS FOR GUARD", Tone::Caution, 1),
                GuardSituation::AtEnd { .. } => new("GUARD STOP", Tone::Caution, 2),
                GuardSituation::None | GuardSituation::Working => new("HELD", Tone::Danger, 2),
            },
            (Live, Some(ShowState::Ready)) => new("READY", Tone::Calm, 1),
            (Live, Some(ShowState::Finished)) => new("FINISHED", Tone::Calm, 3),
            (Live, None) => new("UNKNOWN", Tone::Caution, 1),
        }
    }

    /// The sign with the meaning of the word.
    pub(super) fn sign(&self, glyphs: Glyphs) -> &'static str {
        glyphs.signs().states[self.sign]
    }
}

/// The situation of the guard; `None` if an operator holds the show.
fn by_guard(snapshot: &Snapshot) -> GuardSituation {
    let is_held = snapshot.status.as_ref().is_some_and(|status| status.stops().held);
    if is_held { GuardSituation::None } else { snapshot.guard }
}

/// Draws an unacknowledged contact, then the lamps, the most urgent ones first. A lamp without enough room is left out.
pub(super) fn draw_lamps(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let (look, mut spans, mut room) = (screen.look, Vec::new(), usize::from(area.width));
    if let Some(contact) = &screen.past_contact {
        let text = format!(" {contact}, press a to acknowledge ");
        room = room.saturating_sub(text.chars().count() + 1);
        spans.extend([Span::styled(text, look.theme.block(Tone::Danger)), Span::raw(" ")]);
    }
    let mut lamps: Vec<Lamp> = lamps(snapshot, snapshot.seen_ns).into_iter().filter(is_in_row).collect();
    lamps.sort_by_key(|lamp| std::cmp::Reverse(lamp.level.max(LampLevel::Good)));
    for lamp in &lamps {
        let lamp_spans = short_lamp(lamp, look);
        let width: usize = lamp_spans.iter().map(Span::width).sum();
        if width > room {
            break;
        }
        room -= width;
        spans.extend(lamp_spans);
    }
    frame.render_widget(Line::from(spans), area);
}

/// Whether a lamp belongs in the line: it is not off, and shows more than a good source or good readers.
fn is_in_row(lamp: &Lamp) -> bool {
    lamp.level > LampLevel::Good || lamp.level == LampLevel::Good && !["source", "readers"].contains(&lamp.name)
}

fn short_lamp(lamp: &Lamp, look: Look) -> Vec<Span<'static>> {
    let (sign, style) = lamp_sign(lamp.level, look);
    let has_text = lamp.level > LampLevel::Good || ["guard", "recorder", "timecode"].contains(&lamp.name);
    let text = if has_text { format!("{} {}  ", lamp.name, lamp.text) } else { format!("{}  ", lamp.name) };
    let text_style = if lamp.level > LampLevel::Good { style } else { strong() };
    vec![Span::styled(format!("{sign} "), style), Span::styled(text, text_style)]
}

/// The sign and the style of a level. The sign has the same meaning as the colour.
pub(super) fn lamp_sign(level: LampLevel, look: Look) -> (&'static str, Style) {
    let style = match level {
        LampLevel::Off => look.theme.faint(),
        LampLevel::Good => look.theme.text(Tone::Good),
        LampLevel::Warning => look.theme.text(Tone::Caution),
        LampLevel::Danger => look.theme.text(Tone::Danger),
    };
    (look.glyphs.signs().lamps[level as usize], style)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::watch::sample::{snapshot, text_after};

    #[test]
    fn a_show_that_has_ended_in_order_is_not_shown_as_lost() {
        let snapshot =
            Snapshot { presence: SourcePresence::Ended { age_ns: 1_000_000_000 }, ..snapshot(ShowState::Ended, 300.0) };
        let text = text_after("", &snapshot);
        assert!(text.contains("ENDED") && !text.contains("LOST"), "{text}");
    }

    #[test]
    fn each_situation_of_the_guard_has_its_words_and_under_timecode_no_stop_is_permanent() {
        let of = |guard| Snapshot { guard, ..snapshot(ShowState::Held, 300.0) };
        let text = |guard| text_after("", &of(guard));
        for (guard, words) in [
            (GuardSituation::None, ["HELD", "in "]),
            (GuardSituation::Waiting, ["WAITS FOR GUARD", "waits for a grant"]),
            (GuardSituation::Missing, ["NO GUARD", "guard missing"]),
            (GuardSituation::AtEnd { for_good: true }, ["GUARD STOP", "only a seek moves it"]),
            (GuardSituation::AtEnd { for_good: false }, ["GUARD STOP", "until timecode moves"]),
        ] {
            let text = text(guard);
            let words = if guard == GuardSituation::None { &words[..1] } else { &words[..] };
            assert!(words.iter().all(|word| text.contains(word)), "{words:?} in\n{text}");
            assert_eq!(text.contains("permanently"), guard == GuardSituation::AtEnd { for_good: true }, "{text}");
        }
    }
}

//! The first two lines: the state of the show, and the lamps.

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::SourceKind;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::look::{Glyphs, Look, Tone, strong};
use super::panel::short;
use super::screen::Screen;
use crate::display::observe::{Lamp, LampLevel, Level, Snapshot, SourcePresence, Standing, lamps};

pub(super) fn draw_status(frame: &mut Frame<'_>, area: Rect, snapshot: &Snapshot, screen: &Screen) {
    let look = screen.look;
    let standing = Standing::of(snapshot, snapshot.seen_ns);
    let (tone, sign) = (tone(standing.level), sign(&standing, look.glyphs));
    let mut spans = vec![Span::styled(format!(" {sign} {:<8} ", standing.word), look.theme.block(tone))];
    let is_live = snapshot.presence == SourcePresence::Live;
    let style = if is_live { strong() } else { look.theme.faint() };
    if let Some(header) = snapshot.header() {
        spans.push(Span::styled(format!("  t {} s", Fixed::<3>(header.show_time_s())), style));
        let lead = snapshot.config().and_then(|config| config.named()).map(|named| &named.dragons()[0].name);
        let lead = lead.map_or(String::new(), |name| format!("{name} "));
        spans.push(Span::styled(format!("   {lead}{:.3} m/s", header.head_speed_mps), Style::new()));
        let head = snapshot.frame.as_ref().and_then(|frame| frame.handles.first());
        let height_m = head.map_or(0.0, |head| head.position_m[2]);
        if height_m != 0.0 {
            spans.push(Span::styled(format!("   height {} m", Fixed::<2>(height_m)), Style::new()));
        }
        spans.push(Span::raw(format!("   {} {}", look.glyphs.signs().cross, short(header.time_scale))));
    }
    spans.push(Span::raw(format!("   {}", screen.instance)));
    let (name, tone) = match snapshot.status.as_ref().and_then(|status| status.source_kind()) {
        Some(SourceKind::Replay) if is_live => ("REPLAY", Tone::Caution),
        Some(SourceKind::Remote) if is_live => ("another host", tone),
        _ => (snapshot.presence.name(), tone),
    };
    spans.push(Span::styled(format!("   {name}"), look.theme.text(tone)));
    if screen.is_read_only {
        spans.push(Span::styled("   read-only", look.theme.faint()));
    }
    frame.render_widget(Line::from(spans), area);
}

/// The tone of a level.
pub(super) fn tone(level: Level) -> Tone {
    match level {
        Level::Calm => Tone::Calm,
        Level::Good => Tone::Good,
        Level::Caution => Tone::Caution,
        Level::Danger => Tone::Danger,
    }
}

/// The sign beside the word: it distinguishes the levels without colours.
fn sign(standing: &Standing, glyphs: Glyphs) -> &'static str {
    let [walks, stands, held, over] = glyphs.signs().states;
    match (standing.level, standing.word) {
        (Level::Danger, _) => held,
        (Level::Good, _) => walks,
        (_, "FINISHED" | "ENDED") => over,
        (Level::Calm | Level::Caution, _) => stands,
    }
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

/// Whether a lamp belongs in the line: it is not off, and shows more than a good source, clearance or readers.
fn is_in_row(lamp: &Lamp) -> bool {
    lamp.level > LampLevel::Good
        || lamp.level == LampLevel::Good && !["source", "clearance", "readers"].contains(&lamp.name)
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
    use std::sync::Arc;

    use bench_dragon_ipc::{GuardState, ShowState, Status, Stop, Stops};

    use super::*;
    use crate::display::observe::GuardSituation;
    use crate::display::watch::sample::{snapshot, text_after};

    #[test]
    fn a_show_that_has_ended_in_order_is_not_shown_as_lost() {
        let snapshot =
            Snapshot { presence: SourcePresence::Ended { age_ns: 1_000_000_000 }, ..snapshot(ShowState::Ended, 300.0) };
        let text = text_after("", &snapshot);
        assert!(text.contains("ENDED") && !text.contains("LOST"), "{text}");
    }

    #[test]
    fn each_cause_of_a_hold_has_its_sentence_and_under_timecode_no_stop_is_permanent() {
        let at_limit = Stops::from([Stop::GuardLimit]);
        let by_operator = Stops::from([Stop::Held]);
        let restarted = Stops::from([Stop::Held, Stop::Restarted]);
        let text = |stops: Stops, guard| {
            let state = GuardState::Running.to_wire();
            let status =
                Status { state: ShowState::Held.to_wire(), stops: stops.to_wire(), guard: state, ..Status::default() };
            text_after("", &Snapshot { guard, status: Some(Arc::new(status)), ..snapshot(ShowState::Held, 300.0) })
        };
        for (stops, guard, words) in [
            (by_operator, GuardSituation::Working, "A release lifts the hold."),
            (restarted, GuardSituation::Working, "The server was restarted"),
            (at_limit, GuardSituation::Waiting, "proving the travel ahead"),
            (at_limit, GuardSituation::Missing, "No guard runs"),
            (at_limit, GuardSituation::AtEnd { for_good: true }, "only a seek moves it"),
            (at_limit, GuardSituation::AtEnd { for_good: false }, "until timecode moves"),
        ] {
            let text = text(stops, guard);
            assert!(text.contains("HELD") && text.contains(words), "{words:?} in\n{text}");
        }
    }
}

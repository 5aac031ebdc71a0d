//! The first line: what the show is doing.

use bench_dragon_ipc::SourceKind;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::condition::Condition;
use super::screen::Screen;
use super::theme::{Tone, strong};
use super::wording::short;
use crate::display::observe::{Link, Scene};

/// Draws it.
pub(super) fn draw(frame: &mut Frame<'_>, area: Rect, scene: &Scene, screen: &Screen) {
    let look = screen.look();
    let condition = Condition::of(scene);
    let sign = condition.sign(look.glyphs);
    let mut spans = vec![Span::styled(format!(" {sign} {:<8} ", condition.word), look.theme.block(condition.tone))];
    let is_live = scene.link == Link::Live;
    let style = if is_live { strong() } else { look.theme.faint() };
    if let Some(still) = &scene.frame {
        let header = &still.header;
        spans.push(Span::styled(format!("  t {:.3} s", header.sim_time_s()), style));
        spans.push(Span::styled(format!("   {:.3} m/s", header.head_speed_mps), Style::new()));
        spans.push(Span::raw(format!("   {} {}", look.glyphs.cross(), short(header.time_scale))));
    }
    spans.push(Span::raw(format!("   {}", screen.instance())));
    let (name, tone) = match scene.status.as_ref().and_then(|status| status.source_kind()) {
        Some(SourceKind::Replay) if is_live => ("REPLAY", Tone::Caution),
        Some(SourceKind::Remote) if is_live => ("other host", condition.tone),
        _ => (scene.link.name(), condition.tone),
    };
    spans.push(Span::styled(format!("   {name}"), look.theme.text(tone)));
    if screen.is_read_only() {
        spans.push(Span::styled("   read-only", look.theme.faint()));
    }
    frame.render_widget(Line::from(spans), area);
}

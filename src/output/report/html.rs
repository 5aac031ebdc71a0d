//! The HTML of a report. `maud` escapes every value that stands in a template.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use percent_encoding::{AsciiSet, CONTROLS, utf8_percent_encode};

use super::{Block, Fact, Layout, Report, Section, Table, Verdict, Weight};
use crate::output::figure::{Drawing, FigureFormat};

const STYLE: &str = include_str!("report.css");
/// A browser loads nothing for this page, and runs no script in it, whatever its words are.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:";
/// Bytes of a picture that an address must not have as they are.
const ESCAPED: AsciiSet = CONTROLS.add(b' ').add(b'"').add(b'#').add(b'%').add(b'<').add(b'>').add(b'&').add(b'\'');

pub(super) fn page(report: &Report) -> Markup {
    let Report { kind, title, cover, .. } = report;
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta http-equiv="Content-Security-Policy" content=(POLICY);
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (kind) ": " (title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    @if let Some(cover) = cover { (whole(cover)) }
                    (whole(report))
                }
            }
        }
    }
}

/// A report without those before it.
fn whole(Report { kind, title, subtitle, verdict, sections, layout, .. }: &Report) -> Markup {
    let layout = match layout {
        Layout::Pages => "pages",
        Layout::Sheet => "sheet",
    };
    html! {
        article.(layout) {
            header {
                p.kind { (kind) }
                h1 { (title) }
                @if !subtitle.is_empty() { p.subtitle { (subtitle) } }
                (sentence(verdict))
            }
            @for part in sections { (section(part)) }
        }
    }
}

fn sentence(Verdict { weight, words }: &Verdict) -> Markup {
    html! {
        p.verdict.(class(*weight)) { span.sign aria-hidden="true" { (sign(*weight)) } span { (words) } }
    }
}

fn section(section: &Section) -> Markup {
    html! {
        section class=[section.begins_page.then_some("page")] {
            @if !section.heading.is_empty() { h2 { (section.heading) } }
            @for part in &section.blocks { (block(part)) }
        }
    }
}

fn block(block: &Block) -> Markup {
    html! {
        @match block {
            Block::Words(words) => { p { (words) } }
            Block::Tiles(facts) => { dl.tiles { @for fact in facts { (one_fact(fact)) } } }
            Block::Facts(facts) => { dl.facts { @for fact in facts { (one_fact(fact)) } } }
            Block::Figure(drawing, words) => { img.figure src=(address(drawing)) alt=(words); }
            Block::Table(rows) => { (table(rows)) }
            Block::Text(text) => { pre { (text) } }
            Block::Ticks(lines) => { ul.ticks { @for line in lines { li { (line) } } } }
            Block::ToSign(names) => { ul.to-sign { @for name in names { li { (name) } } } }
        }
    }
}

fn one_fact(Fact { name, value, more, weight }: &Fact) -> Markup {
    html! {
        div.(class(*weight)) {
            dt { (name) }
            dd {
                span.value { (value) }
                @if !more.is_empty() { " " span.more { (more) } }
            }
        }
    }
}

fn table(Table { columns, numbers, rows, empty, left_out }: &Table) -> Markup {
    let is_number = |column: usize| columns.get(column).is_some_and(|name| numbers.contains(name));
    let number = |column: usize| is_number(column).then_some("number");
    html! {
        @if rows.is_empty() {
            p.empty { (empty) }
        } @else {
            table {
                thead { tr { @for (column, name) in columns.iter().enumerate() {
                    th class=[number(column)] scope="col" { (name) }
                } } }
                tbody { @for row in rows { tr { @for (column, cell) in row.iter().enumerate() {
                    td class=[number(column)] { (cell) }
                } } } }
            }
        }
        @if let Some(words) = left_out { p.more { (words) } }
    }
}

/// A picture as an address, which holds all of it.
fn address(drawing: &Drawing) -> String {
    let svg = String::from_utf8(drawing.encode(FigureFormat::Svg)).expect("SVG is UTF-8");
    format!("data:image/svg+xml;charset=utf-8,{}", utf8_percent_encode(&svg, &ESCAPED))
}

fn class(weight: Weight) -> &'static str {
    match weight {
        Weight::Good => "good",
        Weight::Attention => "attention",
        Weight::Danger => "danger",
    }
}

/// A sign for each weight, so that nothing depends on colours.
fn sign(weight: Weight) -> &'static str {
    match weight {
        Weight::Good => "\u{2713}",
        Weight::Attention => "!",
        Weight::Danger => "\u{2715}",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::figure::{Caption, ShowTimeline};

    const FOUL: &str = "<script>alert('1')</script> & \"quoted\"";
    const SAFE: &str = "&lt;script&gt;alert('1')&lt;/script&gt; &amp; &quot;quoted&quot;";

    fn report(blocks: Vec<Block>) -> Report {
        let text = FOUL.to_owned();
        Report {
            kind: text.clone(),
            title: text.clone(),
            subtitle: text.clone(),
            verdict: Verdict { weight: Weight::Danger, words: text.clone() },
            sections: vec![Section { heading: text, begins_page: true, blocks }],
            layout: Layout::Pages,
            cover: None,
        }
    }

    fn drawing(title: &str) -> Drawing {
        let timeline = ShowTimeline {
            caption: Caption::new(title),
            clock_s: 0.0,
            end_s: 1.0,
            clearance: Vec::new(),
            limits: Vec::new(),
            states: Vec::new(),
            lanes: Vec::new(),
            least: None,
        };
        timeline.draw()
    }

    #[test]
    fn every_word_of_a_report_is_escaped() {
        let text = || FOUL.to_owned();
        let table = Table { rows: vec![vec![text()]], columns: vec!["a"], left_out: Some(text()), ..Table::default() };
        let blocks = vec![
            Block::Words(text()),
            Block::Tiles(vec![Fact::new(text(), text()).more(text())]),
            Block::Facts(vec![Fact::new(text(), text()).more(text())]),
            Block::Figure(drawing(FOUL), text()),
            Block::Table(table),
            Block::Table(Table { empty: text(), ..Table::default() }),
            Block::Text(text()),
            Block::Ticks(vec![text()]),
            Block::ToSign(vec![text()]),
        ];
        let html = report(blocks).html();
        assert!(!html.contains("<script"), "{html}");
        // The kind is also in the title of the window, and so is the title.
        assert_eq!(html.matches(SAFE).count(), 6 + 1 + 3 + 3 + 1 + 2 + 1 + 1 + 1 + 2, "{html}");
        assert!(html.contains("%26lt;script%26gt;alert"), "the title inside the picture: {html}");
    }

    #[test]
    fn a_cover_stands_before_the_report() {
        let cover = Report { title: "sheet".to_owned(), layout: Layout::Sheet, ..report(Vec::new()) };
        let report = Report { title: "night".to_owned(), cover: Some(Box::new(cover)), ..report(Vec::new()) };
        let html = report.html();
        let at = |words: &str| html.find(words).unwrap_or_else(|| panic!("{words}: {html}"));
        assert!(at("<article class=\"sheet\"") < at("<h1>sheet</h1>"));
        assert!(at("<h1>sheet</h1>") < at("<article class=\"pages\"") && at("class=\"pages\"") < at("<h1>night</h1>"));
        assert_eq!(html.matches("<title>").count(), 1);
    }

    #[test]
    fn a_report_loads_nothing_and_has_its_pictures_in_it() {
        let html = report(vec![Block::Figure(drawing("The night"), "The night".to_owned())]).html();
        assert!(html.contains("src=\"data:image/svg+xml;charset=utf-8,%3Csvg"), "{html}");
        assert!(html.contains("default-src 'none'"), "{html}");
        for outside in ["http://", "https://", "url(http", "@import", "<link"] {
            let inside = html.replace("http://www.w3.org/2000/svg", "");
            assert!(!inside.contains(outside), "{outside}");
        }
    }

    #[test]
    fn columns_of_numbers_are_marked_and_an_empty_table_has_words() {
        let table = Table {
            columns: vec!["what", "metres"],
            numbers: vec!["metres"],
            rows: vec![vec!["spiral".to_owned(), "1.7".to_owned()]],
            ..Table::default()
        };
        let html = report(vec![Block::Table(table)]).html();
        assert!(html.contains("<td>spiral</td><td class=\"number\">1.7</td>"), "{html}");
        let html = report(vec![Block::Table(Table { empty: "none".to_owned(), ..Table::default() })]).html();
        assert!(html.contains("<p class=\"empty\">none</p>") && !html.contains("<table"), "{html}");
    }
}

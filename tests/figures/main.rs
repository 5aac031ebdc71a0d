//! Every figure, of the paper's dragon on its routes. `python/test_figures.py` checks the content of the files.
//!
//! The figures stay in cargo's folder for tests, so that people can look at them.

mod paper;

use std::fs;
use std::path::Path;

use bench_dragon::output::figure::{FigureFormat, Paper};

#[test]
fn a_stock_reader_finds_everything_that_a_printer_needs() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("figures");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder");
    for (name, drawing) in paper::drawings() {
        for (suffix, format) in [("svg", FigureFormat::Svg), ("png", FigureFormat::Png)] {
            fs::write(folder.join(name).with_extension(suffix), drawing.encode(format)).expect("a file");
        }
    }
    test_support::pytest::run("test_figures.py", &[("FIGURES", folder.as_os_str())]);
}

#[test]
fn equal_data_give_equal_bytes() {
    for format in [FigureFormat::Svg, FigureFormat::Png] {
        let files = [paper::contact_view(), paper::contact_view()].map(|view| view.draw().encode(format));
        assert!(files[0] == files[1], "{format:?}");
    }
}

/// A sheet of A0 at 300 dots per inch would have 140 million dots.
#[test]
fn a_figure_on_large_paper_has_a_bounded_number_of_dots() {
    let of_a_sheets = 2.0_f64.sqrt();
    for (name, sides) in [("a0", of_a_sheets), ("a3", of_a_sheets), ("letter", 11.0 / 8.5)] {
        let paper: Paper = name.parse().expect("a size of paper");
        let image = paper::contact_view().draw().on_paper(paper).encode(FigureFormat::Png);
        let side = |at: usize| u32::from_be_bytes(image[at..at + 4].try_into().expect("four bytes"));
        let (width, height) = (u64::from(side(16)), u64::from(side(20)));
        assert!((8_000_000..36_100_000).contains(&(width * height)), "{paper:?}: {width} × {height}");
        let ratio = width.max(height) as f64 / width.min(height) as f64;
        assert!((ratio - sides).abs() < 0.005, "{paper:?}: {width} × {height}");
    }
}

#[test]
fn figures_of_very_few_points_can_be_drawn() {
    let mut clearance = paper::clearance_over_time();
    clearance.near_misses.clear();
    clearance.contact = None;
    clearance.samples.truncate(1);
    let mut speeds = paper::speeds_over_time();
    speeds.handles.truncate(1);
    speeds.all.clear();
    (speeds.largest, speeds.limit_mps, speeds.detail_s) = (None, None, None);
    let mut sensitivity = paper::sensitivity();
    for (_, value) in sensitivity.quantities.iter_mut().flat_map(|quantity| quantity.curves.iter_mut().flatten()) {
        *value = None;
    }
    for drawing in [clearance.draw(), speeds.draw(), sensitivity.draw()] {
        assert!(drawing.encode(FigureFormat::Svg).ends_with(b"</svg>\n"));
        assert!(drawing.encode(FigureFormat::Png).starts_with(b"\x89PNG\r\n\x1a\n"));
    }
}

//! Paths that follow drawings.

use bench_dragon_geometry::drawing::{Bezier, Drawing, Fit, FitSettings, Piece};
use glam::DVec2;
use std::time::Instant;

fn show(name: &str, drawing: &Drawing, settings: &FitSettings) {
    let t = Instant::now();
    match drawing.fit(settings) {
        Ok(fit) => println!(
            "{name}: {} segments, {:.6} m, {} corners, {:?}",
            fit.segments.len(),
            fit.error_m,
            fit.corners,
            t.elapsed()
        ),
        Err(e) => println!("{name}: {e} {:?}", t.elapsed()),
    }
}

#[test]
fn explore() {
    let s = FitSettings { tolerance_m: 0.005, corner_radius_m: None };
    let p = |x: f64, y: f64| DVec2::new(x, y);
    show(
        "S",
        &Drawing {
            pieces: vec![Piece::Bezier(Bezier::new(vec![p(0., 0.), p(20., 0.), p(0., 10.), p(20., 10.)]))],
            is_closed: false,
        },
        &s,
    );
    show(
        "quarter",
        &Drawing {
            pieces: vec![Piece::Bezier(Bezier::new(vec![p(5., 0.), p(5., 2.76142), p(2.76142, 5.), p(0., 5.)]))],
            is_closed: false,
        },
        &s,
    );
    for n in [100, 300, 1000, 10000, 100_000, 1_000_000] {
        let spiral: Vec<DVec2> = (0..=n)
            .map(|i| {
                let a = 4.0 * 6.2831853 * f64::from(i) / f64::from(n);
                (3.0 + 1.7 * a / 6.2831853) * DVec2::from_angle(a)
            })
            .collect();
        show(&format!("spiral {n}"), &Drawing::polyline(&spiral, false), &s);
        let rounded: Vec<DVec2> = spiral.iter().map(|p| (*p * 1000.0).round() / 1000.0).collect();
        show(&format!("spiral mm {n}"), &Drawing::polyline(&rounded, false), &s);
        let circle: Vec<DVec2> =
            (0..n).map(|i| 10.0 * DVec2::from_angle(6.283185307179586 * f64::from(i) / f64::from(n))).collect();
        show(&format!("circle {n}"), &Drawing::polyline(&circle, true), &s);
        let sine: Vec<DVec2> = (0..=n)
            .map(|i| {
                let x = 60.0 * f64::from(i) / f64::from(n);
                p(x, 5.0 * (x / 5.0).sin())
            })
            .collect();
        show(&format!("sine {n}"), &Drawing::polyline(&sine, false), &s);
    }
    let rect = Drawing::polyline(&[p(0., 0.), p(20., 0.), p(20., 10.), p(0., 10.)], true);
    show("rect", &rect, &s);
    for r in [1.0, 4.9999, 5.0, 6.0] {
        show("rect", &rect, &FitSettings { corner_radius_m: Some(r), ..s });
    }
}
#[test]
fn debug() {
    let p = |x: f64, y: f64| DVec2::new(x, -y);
    let d = Drawing {
        pieces: vec![
            Piece::Line { from: p(2.0189, 2.48), to: p(7.2509, 6.3338) },
            Piece::Bezier(Bezier::new(vec![
                p(7.2509, 6.3338),
                p(8.7362, 7.377),
                p(11.7949, 7.6247),
                p(13.8605, 9.8786),
            ])),
        ],
        is_closed: false,
    };
    println!("{:?}", d.fit(&FitSettings { tolerance_m: 0.005, corner_radius_m: Some(0.1) }));
    println!("{:?}", d.fit(&FitSettings { tolerance_m: 0.005, corner_radius_m: None }));
}

//! A height map of any bytes. The first byte selects the format, and whether the configuration places the map.

use bench_dragon::height_map::{HeightMapFormat, Placing, parse};

/// Reads a height map. Its grid is complete and in the documented ranges.
pub(crate) fn check(input: &[u8]) {
    let Some((&first, bytes)) = input.split_first() else { return };
    let format = HeightMapFormat::ALL[usize::from(first) % HeightMapFormat::ALL.len()];
    let is_png = format == HeightMapFormat::Png;
    let placing = Placing {
        metres_per_unit: (is_png || first >= 128).then_some(0.1),
        x_m: (first >= 128).then_some(-7.5),
        y_m: (first >= 128).then_some(3.0),
        metres_per_pixel: is_png.then_some(0.5),
    };
    match parse(bytes, format, &placing) {
        Ok(grid) => {
            assert!(grid.columns >= 2 && grid.rows >= 2);
            assert_eq!(grid.heights_m.len(), grid.columns * grid.rows);
            assert!(grid.heights_m.iter().all(|height_m| height_m.is_nan() || height_m.abs() <= 10_000.0));
            assert!([grid.spacing_x_m, grid.spacing_y_m].iter().all(|spacing_m| (0.01..=1000.0).contains(spacing_m)));
            assert!([grid.x_m, grid.y_m].iter().all(|position_m| position_m.is_finite()));
        }
        Err(error) => {
            let error = error.to_string();
            assert!(!error.is_empty() && error.lines().count() == 1, "{error:?}");
        }
    }
}

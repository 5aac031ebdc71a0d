//! Points of a CSV file: one a row, x and y, or longitude and latitude.

use bench_dragon_geometry::drawing::Drawing;
use glam::DVec2;

use super::geographic::{LonLat, local};
use super::{DrawingFileError, MAX_PIECES, MAX_POSITION_M, PathChoice, quoted, utf8};

/// Names of columns, in lower case.
const X: [&str; 4] = ["x_m", "x", "easting_m", "easting"];
const Y: [&str; 4] = ["y_m", "y", "northing_m", "northing"];
const LON: [&str; 5] = ["lon", "longitude", "lng", "long", "lon_deg"];
const LAT: [&str; 3] = ["lat", "latitude", "lat_deg"];

/// Where the two coordinates of a point are.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Columns {
    /// Metres, or units of the drawing.
    Plane([usize; 2]),
    /// Degrees: longitude and latitude.
    Globe([usize; 2]),
}

/// The separator of the cells of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    /// Each one divides two cells.
    Char(char),
    /// A run of spaces and tabs divides two cells.
    Space,
}

/// The polyline of the file's points. It is closed if its last point is its first.
///
/// The columns are those named `x_m` and `y_m`, or `lon` and `lat`; without names, the first two, and all rows
/// have as many columns. Numbers are divided by commas, semicolons, tabs or spaces. Lines that begin with `#` are comments.
pub(super) fn path(bytes: &[u8], choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    require_one_path(choice)?;
    let text = utf8(bytes)?.trim_start_matches('\u{feff}');
    // A line ends with a line feed, a carriage return or both, also in one file.
    let text = text.replace("\r\n", "\n");
    let lines = || (1..).zip(text.split(['\n', '\r']));
    lines().try_for_each(|(number, line)| require_one_line(number, line))?;
    let mut rows = lines().filter(|(_, line)| has_cells(line)).peekable();
    let first = rows.peek().map_or("", |(_, line)| *line);
    let separator = Separator::of(first);
    let first = separator.cells(first);
    let mut columns = Columns::Plane([0, 1]);
    // Empty cells at the end of a row are not counted.
    let most = first.len();
    let mut least = used(&first);
    if are_names(&first) {
        columns = named_columns(&first)?;
        least = 0;
        rows.next();
    }
    let (Columns::Plane(at) | Columns::Globe(at)) = columns;
    let has_point = |row: &str| {
        let cells = separator.cells(row);
        at.iter().filter_map(|&column| cells.get(column)).any(|cell| cell.contains('.'))
    };
    let has_decimal_commas = separator == Separator::Char(';') && !rows.clone().any(|(_, row)| has_point(row));
    let number = |cell: &str| {
        let number = cell.parse::<f64>();
        number.ok().or_else(|| cell.replace(',', ".").parse().ok().filter(|_| has_decimal_commas))
    };
    let mut points = vec![];
    for (line, row) in rows {
        let cells = separator.cells(row);
        // A row without the columns of a point has no two numbers, which is plainer.
        let is_short = cells.len() < least && at.iter().all(|&column| column < cells.len());
        if used(&cells) > most || is_short {
            let (found, row) = (cells.len(), quoted(row.trim()));
            return Err(DrawingFileError(format!(
                "line {line} is {row}, with {found} columns, must have {most} as the first row; decimals need a point"
            )));
        }
        let [x, y] = at.map(|column| cells.get(column).and_then(|cell| number(cell)));
        let (Some(x), Some(y)) = (x, y) else { return Err(separator.bad_row(line, row, columns)) };
        points.push(match columns {
            Columns::Plane(_) => scaled(x, y, choice, line)?,
            Columns::Globe(_) => DVec2::new(x, y),
        });
        if points.len() > MAX_PIECES {
            return Err(DrawingFileError(format!("has more than {MAX_PIECES} points, the most that is allowed")));
        }
    }
    if points.len() < 2 {
        let noun = if points.len() == 1 { "point" } else { "points" };
        return Err(DrawingFileError(format!("has {} {noun}, must have at least 2", points.len())));
    }
    if let Columns::Globe(_) = columns {
        let degrees: Vec<LonLat> = points.iter().map(|point| LonLat { lon: point.x, lat: point.y }).collect();
        points = local(&degrees, choice)?;
    }
    let is_closed = points.len() > 2 && points[0] == points[points.len() - 1];
    Ok(Drawing { is_closed, ..Drawing::polyline(&points, false) })
}

/// Fails for a choice among paths, of which a file has one, and for a scale of a page.
fn require_one_path(choice: &PathChoice<'_>) -> Result<(), DrawingFileError> {
    for (key, value) in [("id", choice.id), ("label", choice.label), ("layer", choice.layer)] {
        if let Some(value) = value {
            let value = quoted(value);
            return Err(DrawingFileError(format!("{key} is {value}, but a CSV file has one path without a name")));
        }
    }
    if let Some(number) = choice.number.filter(|&number| number != 1) {
        return Err(DrawingFileError(format!("number is {number}, but a CSV file has one path")));
    }
    if choice.scale.is_some() {
        return Err(DrawingFileError(
            "a scale is of a page, which a CSV file does not have: set metres_per_unit".to_owned(),
        ));
    }
    Ok(())
}

/// The number of a row's cells without the empty ones at its end.
fn used(cells: &[&str]) -> usize {
    cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1)
}

/// Fails for a character that may end a line elsewhere, and for other control characters.
fn require_one_line(number: usize, line: &str) -> Result<(), DrawingFileError> {
    let is_wrong = |char: &char| char.is_control() && *char != '\t' || matches!(char, '\u{2028}' | '\u{2029}');
    line.chars().find(is_wrong).map_or(Ok(()), |char| {
        let code = u32::from(char);
        let allowed = "must have printable characters and tabs, and end with LF, CR or both";
        Err(DrawingFileError(format!("line {number} has the character U+{code:04X}, {allowed}")))
    })
}

/// Whether a line is neither empty nor a comment.
fn has_cells(line: &str) -> bool {
    !line.trim_start().starts_with('#') && line.contains(|char: char| !char.is_whitespace() && !",;".contains(char))
}

impl Separator {
    /// The separator of a file, by its first row. Between names each tab divides two cells, so a cell may be empty.
    fn of(first: &str) -> Self {
        let chars = [';', ',', '\t'].map(Self::Char);
        let divides = |separator: &Self| match *separator {
            Self::Char('\t') => first.contains('\t') && are_names(&separator.cells(first)),
            Self::Char(char) => first.contains(char),
            Self::Space => true,
        };
        chars.into_iter().find(divides).unwrap_or(Self::Space)
    }

    /// The cells of a row, without quotes and spaces around them. A separator in quotes divides no cells.
    fn cells(self, row: &str) -> Vec<&str> {
        let mut is_quoted = false;
        let divides = |char: char| {
            is_quoted ^= char == '"';
            !is_quoted && if let Self::Char(separator) = self { char == separator } else { char.is_whitespace() }
        };
        let cells = row.split(divides).map(|cell| cell.trim().trim_matches('"').trim());
        cells.filter(|cell| self != Self::Space || !cell.is_empty()).collect()
    }

    /// The error of a row that has no two numbers.
    fn bad_row(self, line: usize, row: &str, columns: Columns) -> DrawingFileError {
        let divides_decimals = self != Self::Char(',') || self.cells(row).len() > 2;
        let names = if matches!(columns, Columns::Plane(_)) { "x_m and y_m" } else { "lon and lat" };
        let hint = if divides_decimals && row.contains(',') { "; decimals need a point" } else { "" };
        DrawingFileError(format!("line {line} is {}, must be two numbers, {names}{hint}", quoted(row.trim())))
    }
}

/// Whether cells name columns: each begins with a letter or `_`, or is empty, and none is a number.
fn are_names(cells: &[&str]) -> bool {
    let is_name = |cell: &&str| {
        let begins_a_name = |char: char| char.is_alphabetic() || char == '_';
        cell.is_empty() || cell.starts_with(begins_a_name) && cell.parse::<f64>().is_err()
    };
    cells.iter().all(is_name) && cells.iter().any(|cell| !cell.is_empty())
}

/// The columns of a point among named columns.
fn named_columns(names: &[&str]) -> Result<Columns, DrawingFileError> {
    let plain = |name: &str| {
        let name = name.to_lowercase();
        let metres = ["(m)", "[m]"].into_iter().find_map(|unit| name.strip_suffix(unit));
        metres.map_or(name.clone(), |name| name.trim_end().to_owned())
    };
    let names: Vec<String> = names.iter().map(|name| plain(name)).collect();
    let named = |known: &[&str]| names.iter().position(|name| known.contains(&&**name));
    let once = |at: [usize; 2], known: [&[&str]; 2]| {
        for known in known {
            let found: Vec<&str> = names.iter().map(|name| &**name).filter(|name| known.contains(name)).collect();
            match &found[..] {
                [first, .., last] if first == last => {
                    return Err(DrawingFileError(format!("has several columns {}, must have one", quoted(first))));
                }
                [_, _, ..] => {
                    let found = super::listed(found.into_iter());
                    return Err(DrawingFileError(format!("has the columns {found}, must have one of them")));
                }
                _ => {}
            }
        }
        Ok(at)
    };
    match (named(&X).zip(named(&Y)), named(&LON).zip(named(&LAT))) {
        (Some((x, y)), _) => Ok(Columns::Plane(once([x, y], [&X, &Y])?)),
        (None, Some((lon, lat))) => Ok(Columns::Globe(once([lon, lat], [&LON, &LAT])?)),
        (None, None) => {
            let found = super::listed(names.iter().map(|name| &**name));
            Err(DrawingFileError(format!("has the columns {found}, must have x_m and y_m, or lon and lat")))
        }
    }
}

/// A point in metres.
fn scaled(x: f64, y: f64, choice: &PathChoice<'_>, line: usize) -> Result<DVec2, DrawingFileError> {
    let point = DVec2::new(x, y) * choice.metres_per_unit.unwrap_or(1.0);
    if point.is_finite() && point.abs().max_element() <= MAX_POSITION_M {
        return Ok(point);
    }
    let [x, y] = point.to_array().map(bench_dragon_geometry::number::Number);
    let allowed = format!("numbers from -{MAX_POSITION_M} to {MAX_POSITION_M}");
    Err(DrawingFileError(format!("line {line} has the point ({x}, {y}) m, must be {allowed}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(text: &str) -> Vec<[f64; 2]> {
        let drawing = path(text.as_bytes(), &PathChoice::default()).expect(text);
        let ends = drawing.pieces.iter().map(|piece| piece.end().to_array());
        std::iter::once(drawing.pieces[0].begin().to_array()).chain(ends).collect()
    }

    #[test]
    fn every_separator_gives_the_same_points() {
        for text in [
            "0.5,0\n10,-2\n",
            "x_m,y_m\r\n0.5,0\r\n10,-2",
            ",y,name,x\n0,0,\"a, b\",0.5\n1,-2,c,10\n",
            "# a comment\n\n 0.5; 0\n;\n10;-2\n",
            "\"0.5\",\"0\"\n\"10\",\"-2\"\n",
            "0,5;0\n10;-2,0\n",
            "x_m;y_m;name\n0,5;0;a.b\n10;-2,0;c\n",
            "0,5;0;1.5\n10;-2,0;1.5\n",
            "0.5,0,\n10,-2\n",
            "0.5,0\n10,-2,,\n",
            "x_m;y_m\n0,5;0,0\n10,0;-2,0\n",
            "0.5  0\n10  -2\n",
            "  0.5\t \t0\n 10\t-2\n",
            "name\tx_m\ty_m\n\t0.5\t0\n\t10\t-2\n",
            "x_m   y_m\n0.5     0\n10     -2\n",
            "# CR\rx,y\r0.5,0\r10,-2\n",
            "x,y\r\n0.5,0\r10,-2\n",
        ] {
            assert_eq!(points(text), [[0.5, 0.0], [10.0, -2.0]], "{text:?}");
        }
    }

    #[test]
    fn only_a_row_of_names_is_left_out() {
        assert_eq!(points("Y [m],Länge,X (m)\n2,9,1\n4,9,3"), [[1.0, 2.0], [3.0, 4.0]]);
        assert_eq!(points("Easting;Northing\n1;2\n3;4"), [[1.0, 2.0], [3.0, 4.0]]);
        for (text, reason) in [
            ("0,O\n10,0\n20,0", "line 1 is \"0,O\", must be two numbers, x_m and y_m"),
            ("0,5 0\n10,5 0", "line 1 is \"0,5 0\", must be two numbers"),
            ("0,5 0,5\n10,5 0", "line 1 is \"0,5 0,5\", must be two numbers, x_m and y_m; decimals need a point"),
            ("0.0.0,5\n10,0\n20,0", "line 1 is \"0.0.0,5\", must be two numbers"),
            ("nan,0\n10,0\n20,0", "line 1 has the point (NaN, 0) m, must be numbers from -100000000 to 100000000"),
            ("1;2\n\n1.5;2,5\n", "line 3 is \"1.5;2,5\", must be two numbers, x_m and y_m; decimals need a point"),
            ("1,000,5;2\n2;3", "line 1 is \"1,000,5;2\", must be two numbers"),
            (
                "0,0\r\n5,0\u{b}10,0\n",
                "line 2 has the character U+000B, must have printable characters and tabs, and end with LF, CR or both",
            ),
            (
                "0 0\u{2028}5 0\n10 0",
                "line 1 has the character U+2028, must have printable characters and tabs, and end with LF, CR or both",
            ),
            ("0  0\n10  -\n", "line 2 is \"10  -\", must be two numbers, x_m and y_m"),
            ("0,0\n1e9,0\n", "line 2 has the point (1000000000, 0) m, must be numbers from -100000000 to 100000000"),
            ("Länge (m),y\n1,2\n3,4", "has the columns \"länge\", \"y\", must have x_m and y_m, or lon and lat"),
            ("id,lat,x\n1,2,3\n3,4,5", "has the columns \"id\", \"lat\", \"x\", must have x_m and y_m, or lon and lat"),
            ("lat,lon\n1,2\n3,x", "line 3 is \"3,x\", must be two numbers, lon and lat"),
            (
                "0,0\n100,0\n150,50,5\n",
                "line 3 is \"150,50,5\", with 3 columns, must have 2 as the first row; decimals need a point",
            ),
            (
                "0,5,0,5\n10,3\n",
                "line 2 is \"10,3\", with 2 columns, must have 4 as the first row; decimals need a point",
            ),
            (
                "0 0\n10 0 5\n",
                "line 2 is \"10 0 5\", with 3 columns, must have 2 as the first row; decimals need a point",
            ),
            ("x_m,y_m\n1,2\n", "has 1 point, must have at least 2"),
        ] {
            let error = path(text.as_bytes(), &PathChoice::default()).expect_err(text).to_string();
            let is_whole = reason.ends_with("numbers") || error == reason;
            assert!(error.starts_with(reason) && is_whole, "{text:?} gives {error:?}");
        }
    }
}

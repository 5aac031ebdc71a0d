//! The boards of the benches as cubes, for viewers: `foxglove_msgs/msg/SceneUpdate` and `visualization_msgs/msg/MarkerArray`.

use bench_dragon_ipc::{BenchState, FrameHeader, HandleState, IntoBytes as _};

use super::cdr::{ENCAPSULATION, STAGE, align, append_number, append_string, encode, pose, stamp};
use crate::output::{Rgb, colours_of};

/// Drawn thickness of a board, in metres. Configurations have none.
const THICKNESS_M: f64 = 0.03;
/// Name of a dragon without one.
const ONE_DRAGON: &str = "dragon";
const CUBE: u32 = 1;
const ADD: u32 = 0;
const DELETE_ALL: u32 = 3;

/// Sizes and colours of the boards that a description has.
#[derive(Clone, Debug, PartialEq)]
pub struct Boards(Vec<DragonBoards>);

/// The boards of one dragon.
#[derive(Clone, Debug, PartialEq)]
struct DragonBoards {
    name: String,
    colour: Rgb,
    head_length_m: f64,
    body_length_m: f64,
    width_m: f64,
}

impl Boards {
    /// Reads the boards in the text of a description. Places no dragon on its route, so it takes little time. `None` without sizes.
    ///
    /// ```
    /// use bench_dragon::recording::Boards;
    ///
    /// let dragon = "head_length_m = 3.41\nbody_length_m = 2.2\nwidth_m = 0.3\n";
    /// assert!(Boards::of_toml(&format!("[dragon]\n{dragon}")).is_some());
    /// assert!(Boards::of_toml(&format!("[[dragons]]\nname = \"gold\"\n{dragon}")).is_some());
    /// assert_eq!(Boards::of_toml("[dragon]\nbenches = 1\n"), None);
    /// ```
    pub fn of_toml(toml: &str) -> Option<Self> {
        let table = toml.parse::<toml::Table>().ok()?;
        let tables: Vec<&toml::Value> = match table.get("dragons") {
            Some(dragons) => dragons.as_array()?.iter().collect(),
            None => vec![table.get("dragon")?],
        };
        let configured: Vec<Option<Rgb>> = tables.iter().map(|table| colour_in(table)).collect();
        let dragons =
            tables.iter().zip(colours_of(&configured)).map(|(table, colour)| DragonBoards::new(table, colour));
        dragons.collect::<Option<_>>().map(Self)
    }

    /// The boards of all benches of a frame. None if the frame has other dragons than the description.
    fn of_frame<'a>(&'a self, header: &'a FrameHeader, handles: &'a [HandleState]) -> impl Iterator<Item = Board<'a>> {
        let are_described = self.0.len() == header.dragons().len() && header.has_handles(handles.len());
        let dragons = self.0.iter().zip(header.dragons()).filter(move |_| are_described);
        dragons.flat_map(move |(boards, motion)| {
            motion.benches(handles).enumerate().map(move |(index, bench)| boards.board(index, &bench))
        })
    }
}

impl DragonBoards {
    fn new(table: &toml::Value, colour: Rgb) -> Option<Self> {
        let length_m = |key: &str| {
            let value = table.get(key)?;
            value.as_float().or_else(|| value.as_integer().map(|value| value as f64)).filter(|value| value.is_finite())
        };
        Some(Self {
            name: table.get("name").and_then(toml::Value::as_str).unwrap_or(ONE_DRAGON).to_owned(),
            colour,
            head_length_m: length_m("head_length_m")?,
            body_length_m: length_m("body_length_m")?,
            width_m: length_m("width_m")?,
        })
    }

    /// The board of a bench. The head's is lighter.
    fn board(&self, index: usize, bench: &BenchState) -> Board<'_> {
        let is_head = index == 0;
        let length_m = if is_head { self.head_length_m } else { self.body_length_m };
        let white = if is_head { 0.5 } else { 0.0 };
        let [red, green, blue] = self.colour.map(|part| white + (1.0 - white) * f64::from(part) / 255.0);
        Board {
            dragon: &self.name,
            index: index as u32,
            pose: pose(bench),
            size_m: [length_m, self.width_m, THICKNESS_M],
            colour: [red, green, blue, 1.0],
        }
    }
}

/// A board in space.
struct Board<'a> {
    dragon: &'a str,
    index: u32,
    /// Centre, and orientation as a quaternion.
    pose: [f64; 7],
    size_m: [f64; 3],
    /// Red, green, blue and opacity, from 0 to 1.
    colour: [f64; 4],
}

/// The colour of a dragon's table, such as "#c8a04a".
fn colour_in(table: &toml::Value) -> Option<Rgb> {
    let digits = table.get("colour")?.as_str()?.strip_prefix('#').filter(|digits| digits.len() == 6)?;
    let number = u32::from_str_radix(digits, 16).ok()?;
    let [_, rgb @ ..] = number.to_be_bytes();
    Some(rgb)
}

/// Replaces the contents of `message` with the boards of a frame at a Unix time, as one entity. Each message replaces the one before, so no
/// board of an earlier run remains.
pub fn encode_scene(
    message: &mut Vec<u8>,
    unix_ns: u64,
    header: &FrameHeader,
    handles: &[HandleState],
    boards: &Boards,
) {
    encode(message, &[]);
    append_empty_lists(message, 1);
    append_number(message, 1);
    message.extend(stamp(unix_ns).as_bytes());
    append_string(message, format_args!("{STAGE}"));
    append_string(message, format_args!("boards"));
    append_unlimited(message);
    // Neither metadata nor arrows.
    append_empty_lists(message, 2);
    let count = message.len().next_multiple_of(size_of::<u32>());
    append_number(message, 0);
    let mut cubes = 0_u32;
    for Board { pose, size_m, colour, .. } in boards.of_frame(header, handles) {
        align(message, size_of::<f64>());
        message.extend(pose.as_bytes());
        message.extend(size_m.as_bytes());
        message.extend(colour.as_bytes());
        cubes += 1;
    }
    message[count..][..size_of::<u32>()].copy_from_slice(&cubes.to_le_bytes());
    // Neither spheres, cylinders, lines, triangles, texts nor models.
    append_empty_lists(message, 6);
}

/// Replaces the contents of `message` with the boards of a frame at a Unix time, as markers. The first marker deletes all before it, so no
/// board of an earlier run remains.
pub fn encode_markers(
    message: &mut Vec<u8>,
    unix_ns: u64,
    header: &FrameHeader,
    handles: &[HandleState],
    boards: &Boards,
) {
    let stamp = stamp(unix_ns);
    let nothing = Board { dragon: "", index: 0, pose: [0.0; 7], size_m: [0.0; 3], colour: [0.0; 4] };
    encode(message, &[]);
    append_number(message, 0);
    append_marker(message, stamp, DELETE_ALL, &nothing);
    let mut markers = 1_u32;
    for board in boards.of_frame(header, handles) {
        append_marker(message, stamp, ADD, &board);
        markers += 1;
    }
    message[ENCAPSULATION.len()..][..size_of::<u32>()].copy_from_slice(&markers.to_le_bytes());
}

fn append_marker(message: &mut Vec<u8>, stamp: [u32; 2], action: u32, board: &Board<'_>) {
    align(message, size_of::<u32>());
    message.extend(stamp.as_bytes());
    append_string(message, format_args!("{STAGE}"));
    append_string(message, format_args!("{}", board.dragon));
    for number in [board.index, CUBE, action] {
        append_number(message, number);
    }
    align(message, size_of::<f64>());
    message.extend(board.pose.as_bytes());
    message.extend(board.size_m.as_bytes());
    message.extend(board.colour.map(|part| part as f32).as_bytes());
    append_unlimited(message);
    // Neither points nor colours.
    append_empty_lists(message, 2);
    append_string(message, format_args!(""));
    // An empty texture: its stamp, frame of reference, format and data.
    append_empty_lists(message, 2);
    append_string(message, format_args!(""));
    append_string(message, format_args!(""));
    append_empty_lists(message, 1);
    // Neither coordinates of the texture, a text nor a mesh.
    append_empty_lists(message, 1);
    append_string(message, format_args!(""));
    append_string(message, format_args!(""));
    append_string(message, format_args!(""));
    append_empty_lists(message, 1);
    message.push(0);
}

/// Appends the lifetime of something that remains until it is replaced, and that it does not follow its frame of reference.
fn append_unlimited(message: &mut Vec<u8>) {
    append_empty_lists(message, 2);
    message.push(0);
}

/// Appends lists without elements, or numbers that are 0.
fn append_empty_lists(message: &mut Vec<u8>, count: usize) {
    for _ in 0..count {
        append_number(message, 0);
    }
}

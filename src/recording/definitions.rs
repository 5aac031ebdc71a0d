//! ROS 2 definitions of the recorded messages, for readers without our code.
//!
//! The definitions of our own messages are the files of the ROS 2 package `packaging/ros2/bench_dragon_msgs`, with the
//! constants of their coded fields. Constants take no bytes in a message. The definitions of ROS's own messages are here,
//! without comments.

use std::iter;

/// A message type and the message types that it contains, directly or not.
#[derive(Clone, Copy, Debug)]
pub(super) struct Definition {
    /// Name of the type, for example `bench_dragon_msgs/msg/Frame`.
    pub(super) name: &'static str,
    text: &'static str,
    parts: &'static [(&'static str, &'static str)],
}

impl Definition {
    /// The text of the message, followed by the texts of all messages that it contains. `rosbag2` writes this form, and MCAP
    /// calls it `ros2msg`.
    pub(super) fn full_text(&self) -> String {
        let parts = self.parts.iter().map(|(name, text)| format!("{SEPARATOR}\nMSG: {name}\n{text}"));
        iter::once(self.text.to_owned()).chain(parts).collect()
    }
}

const SEPARATOR: &str = "================================================================================";

/// A frame, as on the bus.
pub(super) const FRAME: Definition = Definition {
    name: "bench_dragon_msgs/msg/Frame",
    text: include_str!("../../packaging/ros2/bench_dragon_msgs/msg/Frame.msg"),
    parts: &[(
        "bench_dragon_msgs/HandleState",
        include_str!("../../packaging/ros2/bench_dragon_msgs/msg/HandleState.msg"),
    )],
};

/// A frame of a plan, as on the bus.
pub(super) const FORMATION_FRAME: Definition = Definition {
    name: "bench_dragon_msgs/msg/FormationFrame",
    text: include_str!("../../packaging/ros2/bench_dragon_msgs/msg/FormationFrame.msg"),
    parts: &[
        FRAME.parts[0],
        ("bench_dragon_msgs/DragonMotion", include_str!("../../packaging/ros2/bench_dragon_msgs/msg/DragonMotion.msg")),
    ],
};

/// An alert, as on the bus.
pub(super) const ALERT: Definition = Definition {
    name: "bench_dragon_msgs/msg/Alert",
    text: include_str!("../../packaging/ros2/bench_dragon_msgs/msg/Alert.msg"),
    parts: &[],
};

/// An event of the record of commands, as on the bus.
pub(super) const COMMAND_EVENT: Definition = Definition {
    name: "bench_dragon_msgs/msg/CommandEvent",
    text: include_str!("../../packaging/ros2/bench_dragon_msgs/msg/CommandEvent.msg"),
    parts: &[],
};

/// Poses in one frame of reference.
pub(super) const POSE_ARRAY: Definition = Definition {
    name: "geometry_msgs/msg/PoseArray",
    text: "std_msgs/Header header\ngeometry_msgs/Pose[] poses\n",
    parts: &[HEADER, TIME, POSE, POINT, QUATERNION],
};

/// Frames of reference, each in its parent.
pub(super) const TRANSFORMS: Definition = Definition {
    name: "tf2_msgs/msg/TFMessage",
    text: "geometry_msgs/TransformStamped[] transforms\n",
    parts: &[
        (
            "geometry_msgs/TransformStamped",
            "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
        ),
        HEADER,
        TIME,
        ("geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"),
        VECTOR,
        QUATERNION,
    ],
};

/// Boards as cubes, for Foxglove and Lichtblick.
pub(super) const SCENE_UPDATE: Definition = Definition {
    name: "foxglove_msgs/msg/SceneUpdate",
    text: "foxglove_msgs/SceneEntityDeletion[] deletions\nfoxglove_msgs/SceneEntity[] entities\n",
    parts: &[
        (
            "foxglove_msgs/SceneEntityDeletion",
            "builtin_interfaces/Time timestamp\nuint8 MATCHING_ID=0\nuint8 ALL=1\nuint8 type\nstring id\n",
        ),
        (
            "foxglove_msgs/SceneEntity",
            "builtin_interfaces/Time timestamp\nstring frame_id\nstring id\nbuiltin_interfaces/Duration lifetime\n\
             bool frame_locked\nfoxglove_msgs/KeyValuePair[] metadata\nfoxglove_msgs/ArrowPrimitive[] arrows\n\
             foxglove_msgs/CubePrimitive[] cubes\nfoxglove_msgs/SpherePrimitive[] spheres\n\
             foxglove_msgs/CylinderPrimitive[] cylinders\nfoxglove_msgs/LinePrimitive[] lines\n\
             foxglove_msgs/TriangleListPrimitive[] triangles\nfoxglove_msgs/TextPrimitive[] texts\n\
             foxglove_msgs/ModelPrimitive[] models\n",
        ),
        ("foxglove_msgs/KeyValuePair", "string key\nstring value\n"),
        (
            "foxglove_msgs/ArrowPrimitive",
            "geometry_msgs/Pose pose\nfloat64 shaft_length\nfloat64 shaft_diameter\nfloat64 head_length\n\
             float64 head_diameter\nfoxglove_msgs/Color color\n",
        ),
        ("foxglove_msgs/CubePrimitive", SOLID),
        ("foxglove_msgs/SpherePrimitive", SOLID),
        (
            "foxglove_msgs/CylinderPrimitive",
            "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfloat64 bottom_scale\nfloat64 top_scale\n\
             foxglove_msgs/Color color\n",
        ),
        (
            "foxglove_msgs/LinePrimitive",
            "uint8 LINE_STRIP=0\nuint8 LINE_LOOP=1\nuint8 LINE_LIST=2\nuint8 type\ngeometry_msgs/Pose pose\n\
             float64 thickness\nbool scale_invariant\ngeometry_msgs/Point[] points\nfoxglove_msgs/Color color\n\
             foxglove_msgs/Color[] colors\nuint32[] indices\n",
        ),
        (
            "foxglove_msgs/TriangleListPrimitive",
            "geometry_msgs/Pose pose\ngeometry_msgs/Point[] points\nfoxglove_msgs/Color color\n\
             foxglove_msgs/Color[] colors\nuint32[] indices\n",
        ),
        (
            "foxglove_msgs/TextPrimitive",
            "geometry_msgs/Pose pose\nbool billboard\nfloat64 font_size\nbool scale_invariant\n\
             foxglove_msgs/Color color\nstring text\n",
        ),
        (
            "foxglove_msgs/ModelPrimitive",
            "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nfoxglove_msgs/Color color\nbool override_color\n\
             string url\nstring media_type\nuint8[] data\n",
        ),
        ("foxglove_msgs/Color", "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n"),
        TIME,
        DURATION,
        POSE,
        POINT,
        VECTOR,
        QUATERNION,
    ],
};

/// Boards as cubes, for `rviz` and every other viewer of ROS.
pub(super) const MARKER_ARRAY: Definition = Definition {
    name: "visualization_msgs/msg/MarkerArray",
    text: "visualization_msgs/Marker[] markers\n",
    parts: &[
        (
            "visualization_msgs/Marker",
            "int32 CUBE=1\nint32 ADD=0\nint32 DELETEALL=3\nstd_msgs/Header header\nstring ns\nint32 id\nint32 type\n\
             int32 action\ngeometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n\
             builtin_interfaces/Duration lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\n\
             std_msgs/ColorRGBA[] colors\nstring texture_resource\nsensor_msgs/CompressedImage texture\n\
             visualization_msgs/UVCoordinate[] uv_coordinates\nstring text\nstring mesh_resource\n\
             visualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials\n",
        ),
        ("std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"),
        ("sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"),
        ("visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"),
        ("visualization_msgs/MeshFile", "string filename\nuint8[] data\n"),
        HEADER,
        TIME,
        DURATION,
        POSE,
        POINT,
        VECTOR,
        QUATERNION,
    ],
};

const SOLID: &str = "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfoxglove_msgs/Color color\n";
const HEADER: (&str, &str) = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n");
const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const DURATION: (&str, &str) = ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n");
const POSE: (&str, &str) =
    ("geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n");
const POINT: (&str, &str) = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const VECTOR: (&str, &str) = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: (&str, &str) = ("geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_text_has_the_text_of_every_message_in_it() {
        assert_eq!(
            POSE_ARRAY.full_text().split(SEPARATOR).nth(2),
            Some("\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n")
        );
        for definition in
            [FRAME, FORMATION_FRAME, ALERT, COMMAND_EVENT, POSE_ARRAY, TRANSFORMS, SCENE_UPDATE, MARKER_ARRAY]
        {
            let full = definition.full_text();
            let fields = full.lines().filter(|line| !line.starts_with(['#', '=']) && !line.starts_with("MSG: "));
            let types = fields.filter_map(|line| line.split([' ', '[']).next());
            for kind in
                types.filter(|kind| kind.starts_with(|first: char| first.is_ascii_uppercase()) || kind.contains('/'))
            {
                assert!(full.lines().any(|line| line.starts_with("MSG: ") && line.ends_with(kind)), "{kind} in {full}");
            }
        }
    }

    #[test]
    fn the_ros_package_lists_every_message_and_has_our_version() {
        let package = concat!(env!("CARGO_MANIFEST_DIR"), "/packaging/ros2/bench_dragon_msgs");
        let read = |name: &str| std::fs::read_to_string(format!("{package}/{name}")).expect("a file of the package");
        let version = concat!("<version>", env!("CARGO_PKG_VERSION"), "</version>");
        assert!(read("package.xml").contains(version), "package.xml has {version}");
        let built = read("CMakeLists.txt");
        for entry in std::fs::read_dir(format!("{package}/msg")).expect("the folder of messages").flatten() {
            let message = format!("\"msg/{}\"", entry.file_name().display());
            assert!(built.contains(&message), "CMakeLists.txt lists {message}");
        }
    }
}

//! The layouts of the bus's types.

use std::any::type_name;
use std::mem::offset_of;

use bench_dragon_ipc::{
    Alert, Command, CommandEvent, CommandReply, DragonMotion, FrameHeader, HandleState, ReaderReport, ReplayStatus,
    Status, TimeHistogram,
};
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};

/// The layout of a type of the bus.
pub(crate) struct Layout {
    /// Name in Rust.
    pub(crate) name: &'static str,
    /// Name and version on the bus.
    pub(crate) type_name: String,
    pub(crate) size: usize,
    pub(crate) fields: Vec<Field>,
}

pub(crate) struct Field {
    pub(crate) offset: usize,
    pub(crate) name: &'static str,
    /// Type in Rust, without its path.
    pub(crate) kind: String,
}

/// Returns the name of a field's type, without its path.
fn type_of<T, F>(_: fn(&T) -> &F) -> String {
    let name = type_name::<F>();
    let short = name.rsplit("::").next().expect("a type has a name");
    // The path of an array's element stands behind the bracket.
    if name.starts_with('[') && name != short { format!("[{short}") } else { short.to_owned() }
}

/// Returns the layouts of types. A missing field is an error of the compiler.
macro_rules! layouts {
    ($($type:ident { $($field:ident)* })*) => {
        vec![$({
            let _ = |value: $type| { let $type { $($field: _),* } = value; };
            let detail = TypeDetail::new::<$type>(TypeVariant::FixedSize);
            Layout {
                name: stringify!($type),
                type_name: detail.type_name().to_string(),
                size: detail.size(),
                fields: vec![$(Field {
                    offset: offset_of!($type, $field),
                    name: stringify!($field),
                    kind: type_of(|value: &$type| &value.$field),
                }),*],
            }
        }),*]
    };
}

/// The layouts of all types.
pub(crate) fn all() -> Vec<Layout> {
    layouts! {
        FrameHeader {
            run_id tick show_time_ns scheduled_ns published_ns head_travel_m head_speed_mps time_scale bench_count state
            course_m course_mps dragon_count is_plan dragons
        }
        DragonMotion { travel_m speed_mps first_handle bench_count state reserved }
        HandleState { position_m velocity_mps }
        TimeHistogram { max_ns counts }
        Status {
            run_id tick show_time_ns overruns behind_ns most_behind_ns lateness_p50_ns lateness_p99_ns lateness_p999_ns
            lateness_max_ns tick_p50_ns tick_p99_ns tick_p999_ns tick_max_ns granted_to_m asked_m guard_end_m rate_hz state
            pid source guard timecode timecode_kind stops lateness tick_time
        }
        Alert { run_id tick show_time_ns forecast_ns clearance_m point_m kind bench_a bench_b reserved }
        Command { kind sender run_id values pid flags }
        CommandReply { run_id tick lowest highest refusal reserved }
        ReaderReport { run_id frames lost bytes_written room_s sent_ns reader pid ended name }
        ReplayStatus { run_id recorded_run_id position_ns length_ns wall_ns pace paused at_end }
        CommandEvent {
            run_id number tick show_time_ns wall_ns overruns values lowest highest kind sender pid refusal flags reserved
        }
    }
}

/// The layout of a type by its name in Rust.
pub(crate) fn of(name: &str) -> Layout {
    all().into_iter().find(|layout| layout.name == name).unwrap_or_else(|| panic!("there is no layout of {name}"))
}

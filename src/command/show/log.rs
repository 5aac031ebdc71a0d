//! The log of a show on stderr. Each line begins with the wall time in the time zone of this machine.

use jiff::Zoned;

use crate::command::print::complain;

pub(super) fn log(line: &str) {
    complain(&format!("{}  {line}", Zoned::now().strftime("%H:%M:%S")));
}

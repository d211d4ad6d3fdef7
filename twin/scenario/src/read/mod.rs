//! Reading scenario files.

mod actuator;
mod bus;
mod changes;
mod checks;
mod controller;
mod coupling;
mod elsewhere;
mod ensemble;
mod expect;
mod fall;
mod fault;
mod file;
mod footsteps;
mod io;
mod limits;
mod loads;
mod names;
mod options;
mod plant;
mod push;
mod root;
mod sensor;
mod time;
mod vector;

pub(crate) use checks::code;
pub use checks::print_duration;
pub(crate) use controller::NO_CONTROLLER;
pub(crate) use limits::limits_table;
pub(crate) use plant::robot_keys;
pub use root::language;
pub(crate) use root::root_table;
pub(crate) use time::TIME;

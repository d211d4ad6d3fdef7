//! Standard kinds of parts and their builders from scenario options.

pub(crate) mod abduction;
pub(crate) mod accuracy;
pub(crate) mod analog_sources;
mod bench;
pub mod bus_kind;
pub mod constraints;
pub(crate) mod context;
pub mod controller_kind;
pub mod coupling;
pub mod decoder;
mod drives;
pub mod engines;
pub mod fmu_plant;
pub mod gaits;
pub(crate) mod idle;
pub mod lcp;
pub mod massless;
pub mod method;
pub mod mjcf;
pub mod option;
mod optoforce;
pub(crate) mod output_filter;
mod phidget;
pub mod plant_kind;
mod rb110;
mod sbcp;
mod script;
mod servo;
pub(crate) mod servo_bus;
pub mod setup;
pub(crate) mod start;
mod swing;
pub mod tactile;
mod turn;
mod usb;

use bus_kind::BusKind;
use controller_kind::ControllerKind;
use plant_kind::PlantKind;

/// Returns the kinds of plants without methods to choose from.
pub(crate) fn plants() -> Vec<PlantKind> {
    vec![drives::kind(), bench::kind(), servo::kind()]
}

/// Returns the kinds of buses.
pub(crate) fn buses() -> Vec<BusKind> {
    vec![
        sbcp::kind(),
        rb110::kind(),
        optoforce::kind(),
        phidget::kind(),
        tactile::kind(),
        servo_bus::dynamixel(),
        servo_bus::feetech(),
    ]
}

/// Returns the kinds of controllers.
pub(crate) fn controllers() -> Vec<ControllerKind> {
    vec![
        gaits::cpg(),
        gaits::tegotae(),
        gaits::planner(),
        gaits::stand(),
        script::kind(),
        turn::kind(),
        swing::kind(),
    ]
}

//! Standard kinds of parts and their builders from scenario options.

pub(crate) mod abduction;
pub(crate) mod analog_sources;
pub(crate) mod bench;
pub mod bus_kind;
pub mod constraints;
pub(crate) mod context;
pub mod controller_kind;
pub mod coupling;
pub(crate) mod drives;
pub(crate) mod engines;
pub mod fmu_plant;
pub mod gaits;
pub(crate) mod idle;
pub mod lcp;
pub mod massless;
pub mod method;
pub(crate) mod mjcf;
#[cfg(feature = "mujoco")]
pub(crate) mod model_file;
#[cfg(feature = "mujoco")]
pub(crate) mod mujoco;
#[cfg(feature = "mujoco")]
mod mujoco_methods;
pub(crate) mod option;
pub(crate) mod optoforce;
pub(crate) mod output_filter;
pub(crate) mod phidget;
pub mod plant_kind;
#[cfg(feature = "rapier")]
pub(crate) mod rapier;
pub(crate) mod rb110;
pub(crate) mod sbcp;
pub(crate) mod script;
pub mod setup;
pub(crate) mod start;
pub mod tactile;
pub(crate) mod turn;
mod usb;

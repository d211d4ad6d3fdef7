//! Plants on third-party engines, which programs may have above this crate: their descriptions, for
//! builds with and without them.

use twinrig_scenario::{Kind, Standalone};

use super::mjcf;

/// Description of the plant `mujoco`.
pub const MUJOCO: &str = "robot in MuJoCo, in maximal or minimal coordinates";
/// Description of the plant `mjcf`.
pub const MJCF: &str =
    "any MJCF model in MuJoCo, with its joints, actuators and sensors as signals";
/// Description of the plant `rapier`.
pub const RAPIER: &str = "robot in Rapier, in maximal coordinates";

/// Returns the kinds for builds that cannot simulate them, with the cargo feature of each.
pub(crate) fn offers() -> [(Kind, &'static str); 3] {
    let model = Kind {
        options: mjcf::options(),
        standalone: Some(Standalone::default()),
        ..Kind::new(mjcf::NAME, MJCF)
    };
    [
        (Kind::new("mujoco", MUJOCO), "mujoco"),
        (model, "mujoco"),
        (Kind::new("rapier", RAPIER), "rapier"),
    ]
}

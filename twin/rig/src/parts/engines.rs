//! Descriptions of the plants on third-party engines, for builds with and without them.

pub(crate) const MUJOCO: &str = "robot in MuJoCo, in maximal or minimal coordinates";
pub(crate) const MJCF: &str =
    "any MJCF model in MuJoCo, with its joints, actuators and sensors as signals";
pub(crate) const RAPIER: &str = "robot in Rapier, in maximal coordinates";

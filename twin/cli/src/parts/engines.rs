//! Descriptions of the plants on third-party engines, for builds with and without them.

pub(crate) const MUJOCO: &str = "the robot in MuJoCo, in maximal or in minimal coordinates";
pub(crate) const MJCF: &str =
    "any MJCF model in MuJoCo, its joints, actuators and sensors as signals";
pub(crate) const RAPIER: &str = "the robot in Rapier, in maximal coordinates";

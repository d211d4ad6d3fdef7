//! The robot in MuJoCo.

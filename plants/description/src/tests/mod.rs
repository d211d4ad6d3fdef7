//! Robots as URDF against Pinocchio, robots read back, and descriptions that are refused.

mod mjcf;
mod peer;
mod refused;
mod round_trip;

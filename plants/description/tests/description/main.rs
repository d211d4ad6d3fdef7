//! Robots as URDF against Pinocchio, robots read back, and descriptions that are refused.

mod peer;
mod refused;
mod round_trip;

//! Robots as URDF against Pinocchio, and robots read back.

mod peer;

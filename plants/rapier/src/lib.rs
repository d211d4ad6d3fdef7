//! The robot in Rapier.

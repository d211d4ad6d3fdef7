//! Tests of the signals and set-points of legged plants.

mod fixture;
mod plant;
mod pushes;
mod set_points;
mod signals;
mod start;

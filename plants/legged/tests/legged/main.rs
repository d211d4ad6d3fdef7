//! Tests of the signals and set-points of legged plants.

mod contacts;
mod fixture;
mod plant;
mod pushes;
mod set_points;
mod signals;
mod start;

//! Tests of sensors: cells, their design, and plants with sensors.

mod cells;
mod design;
mod saturating_fit;
mod sensed_plant;

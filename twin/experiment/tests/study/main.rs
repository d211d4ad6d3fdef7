//! Studies of plants with closed-form solutions.

mod coupling;
mod differences;
mod engines;
mod ensembles;
mod error_bars;
mod estimate;
mod identification;
mod kept;
mod memory;
mod modulation;
mod oscillator;
mod pages;
mod precision;
mod servo_logs;
mod stability;
mod sufficient;
mod transition;
mod walker;

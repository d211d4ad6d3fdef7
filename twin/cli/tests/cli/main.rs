//! Tests of the program through its commands.

mod baseline;
mod bench;
mod builds;
mod buses;
mod cell;
mod commands;
mod common;
mod constraints;
mod error_bars;
mod estimate_study;
mod examples;
mod falls;
mod fit;
mod fmu;
mod gait_studies;
mod ground;
#[cfg(unix)]
mod hardware;
mod import;
#[cfg(unix)]
mod interrupt;
mod junit;
mod live;
mod malformed;
mod mjcf;
mod observations;
mod optimize;
mod output_errors;
mod panics;
mod plant_comparison;
mod radius;
mod radius_axes;
mod recordings;
mod reproduction;
mod robustness;
mod run;
mod run_observer;
mod schema;
#[cfg(unix)]
mod shortened;
mod studies;
mod study_rows;
mod sufficient;
mod sweep;
mod thesis;
mod tools;
mod uncertain;
mod warnings;
mod widths;

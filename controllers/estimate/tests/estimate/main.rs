//! Tests of estimators.

mod adaptive;
mod consistency;
mod identification;
mod kalman;
mod peers;
mod responses;
mod saturation;
mod settings;
mod support;
mod time;

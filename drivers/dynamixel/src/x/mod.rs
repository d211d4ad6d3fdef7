//! Servos of the X series: control tables and firmware.

mod firmware;
pub mod register;
mod xl330_m288;

pub use firmware::{XFirmware, hardware_error};
pub use xl330_m288::XL330_M288;

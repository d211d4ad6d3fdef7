//! Servos of the X series: control tables and firmware.

mod firmware;
pub mod register;
mod series;
mod xl330_m288;
mod xm430_w350;

pub use firmware::{Scales, XFirmware, hardware_error};
pub use xl330_m288::XL330_M288;
pub use xm430_w350::XM430_W350;

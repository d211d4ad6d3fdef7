//! Servos of the AX series: control table and firmware.

mod ax12a;
mod firmware;
pub mod register;

pub use ax12a::AX12A;
pub use firmware::AxFirmware;

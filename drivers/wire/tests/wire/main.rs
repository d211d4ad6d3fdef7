//! Tests of wires, devices and framed protocols in virtual time.

mod adapters;
mod bus;
mod chosen_frames;
mod device;
mod faults;
mod framed;
mod support;
mod usb;
mod wires;

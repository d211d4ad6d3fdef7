//! Packets and servos against the examples of the vendor's manual, its library, and arbitrary
//! bytes.

mod ax;
mod firmware;
mod manual;
mod packets;
mod sdk;
mod servo;
mod support;
mod tables;

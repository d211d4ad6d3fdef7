//! Tests of SBCP: packets, boards, the host's cycle.

mod controller;
mod cycle;
mod noise;
mod packets;
mod page;
mod protocol_stack;
mod slave;
mod support;
mod usb;

//! Tests of SBCP: packets, boards, the host's cycle.

mod controller;
mod cycle;
mod noise;
mod packets;
mod slave;
mod support;
mod usb;

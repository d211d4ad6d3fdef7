//! Tests of whole rigs: determinism, omission, physical laws, buses, snapshots.

mod abduction;
mod battery;
mod bus;
mod carried;
mod contacts;
mod determinism;
mod energy;
mod fused;
mod knees;
mod latency;
mod loads;
mod motors;
mod obstacle;
mod omission;
mod parsers;
mod pushes;
mod restore;
mod resume_from;
mod scenarios;
mod sensors;
mod serial_servos;
mod servo_buses;
mod set_points;
mod steering;

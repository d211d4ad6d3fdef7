//! Properties of a complete SBCP bus for arbitrary hosts, clocks, faults and set-points: driver,
//! USB converter, optional bus controller, RS-485 and four boards, with a plant that records all
//! applied set-points and encodes leg and time in all measurements.
//!
//! Failures are shrunk and printed as a scenario. `PROPTEST_CASES` scales the number of cases.

mod bus_scenario;
mod closed_form;
mod harness;
mod probe_plant;
mod property;
mod recovery;
mod shipped;
mod strategies;
mod values;

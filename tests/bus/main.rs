//! What must hold of a whole SBCP bus, whatever the host, the clocks, the faults and the set-points are: driver, USB converter,
//! perhaps a bus controller, RS-485 and four boards, before a plant that sees every set-point and makes every measurement
//! tell when it was made.
//!
//! What fails is shrunk, and printed as a scenario. `PROPTEST_CASES` scales how often each property is asked.

mod any;
mod bench;
mod law;
mod recovery;
mod run;
mod scope;
mod setting;
mod values;

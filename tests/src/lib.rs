//! Fixtures of the tests across crates: short trots of the real robot, fingerprints and recordings
//! of them, and a plant with an injected fault. Not part of the product.
//!
//! ```
//! use twinrig::Registry;
//! use twinrig_tests::{TrotFixture, run};
//!
//! let registry = Registry::standard();
//! let fixture = TrotFixture { duration_ms: 20, ..TrotFixture::default() };
//! let assembly = fixture.assembly(&registry);
//! assert_eq!(run(&assembly).to_string(), run(&assembly).to_string());
//! ```

mod abduction;
mod faulty_plant;
mod files;
mod fixture;
mod steering;

pub use abduction::assert_legs_follow_the_servo_board;
pub use faulty_plant::{FaultyPlant, with_faulty_plant};
pub use files::{scenarios, scenarios_in, settings, shipped};
pub use fixture::{TrotFixture, record, run, run_from};
pub use steering::assert_steers;

//! What the tests across crates share: short scenes on the real robot, runs of them in memory, and a part that is broken on
//! purpose. Nothing here is part of the product.
//!
//! ```
//! use twinrig::Registry;
//! use twinrig_tests::{Scene, run};
//!
//! let registry = Registry::standard();
//! let scene = Scene { duration_ms: 20, ..Scene::default() };
//! let assembly = scene.assembly(&registry);
//! assert_eq!(run(&assembly).to_string(), run(&assembly).to_string());
//! ```

mod broken;
mod files;
mod scene;

pub use broken::{Broken, with_broken_plant};
pub use files::{scenarios, scenarios_in};
pub use scene::{Scene, record, run, run_from};

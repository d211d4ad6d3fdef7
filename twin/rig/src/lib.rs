//! The rig as a library: from a scenario to a judged run. A [`Registry`] has the kinds of plants,
//! drivers and controllers, an [`Assembly`] builds those of a scenario, [`execute_observed`] runs
//! them in virtual time or on hardware and returns a [`Report`].
//!
//! ```
//! use twinrig_rig::{Assembly, Execution, Registry, Status, execute_observed};
//!
//! let registry = Registry::standard();
//! let text = "robot = 'cheetah-cub'\nduration = '0.1 s'\nplant = { model = 'massless' }";
//! let assembly = Assembly::builder(&registry).text("hangs.toml", text, "".as_ref())?;
//! let report = execute_observed(&assembly, &Execution::default(), &mut ())?;
//! assert_eq!(report.verdict, Status::Pass);
//! # Ok::<(), twinrig_rig::Error>(())
//! ```
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | `parts` | kinds of plants, controllers and buses, built from scenario options |
//! | `registry` | the kinds of a build |
//! | `assembly` | from a file to a rig |
//! | `run` | execution, observers, judging, continuation on another plant, hardware |
//! | `report` | the result as data |
//! | `playback` | recorded commands, played on a plant at their own times |
//! | `scenario_text` | a scenario with other settings and further changes, for another folder |
//! | `fmu` | FMUs of scenarios and their instances |
//!
//! # Limits
//!
//! - No commands, no terminal, no pages: these are in the crate `twinrig`, which users of the
//!   program depend on. A caller sees the progress by its [`RunObserver`].
//! - Single runs only: ensembles, sweeps and studies are above this crate.
//! - No physics, no controller and no protocol; it depends on the crates that implement them. The
//!   system clock affects reports only.

pub mod assembly;
pub mod build_key;
pub mod error;
pub mod fmu;
mod offer;
pub mod parts;
mod plant_id;
pub mod playback;
pub mod registry;
pub mod report;
pub mod run;
pub mod scenario_text;
pub mod start;

pub use assembly::{Assembly, AssemblyBuilder};
pub use build_key::BuildKey;
pub use error::{BuildError, Error};
pub use offer::{MethodOffer, MethodSetting, PlantOffer, Scales, SettingKind, Variant};
pub use parts::accuracy::Accuracy;
pub use parts::bus_kind::{BusContext, BusKind};
pub use parts::context::{ModelContext, PlantContext, StandaloneModel};
pub use parts::controller_kind::{ControllerContext, ControllerKind, LegContext};
pub use parts::fmu_plant;
pub use parts::lcp::lcp;
pub use parts::massless::massless;
pub use parts::method::Method;
pub use parts::plant_kind::PlantKind;
pub use parts::servo_bus::servo_models;
pub use plant_id::PlantId;
pub use registry::Registry;
pub use report::{
    Against, BusReport, Energy, ErrorBar, ErrorSource, Line, LineEnsemble, RealTime, Report,
    Status, WarningEntry,
};
pub use run::execute::execute_observed;
pub use run::execution::Execution;
pub use run::observers::{RunLayouts, RunObserver, RunProgress};
pub use start::StartPerturbation;

//! Scenario files: the definition of a run and its expectations.
//!
//! A file is read into a [`Scenario`] and checked against the [`Catalogue`] of the build; every
//! error is reported at its position. With the [`Facts`] of robot, plant and controller it becomes
//! a [`Scene`], which contains only the required signals and lists the omitted parts with the
//! reasons. A [`Judge`] observes the run sample by sample and returns one [`Outcome`] for each
//! expectation: verdict, measured value, bound and margin. An expectation that could not be
//! observed never passes.
//!
//! ```
//! use std::path::Path;
//! use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime, Unit};
//! use twinrig_runtime::{Group, Observer};
//! use twinrig_scenario::{Catalogue, Facts, Judge, Kind, Layouts, RunEnd, Scenario, Verdict};
//!
//! let text = r#"
//!     robot = "cheetah-cub"
//!     duration = "1 s"
//!     plant = { model = "weightless" }
//!     [[expect]]
//!     signal = { name = "body/position", component = "z", always = { min = "10 cm" } }
//! "#;
//! let catalogue = Catalogue {
//!     plants: vec![Kind::new("weightless", "hangs in the air")],
//!     ..Catalogue::default()
//! };
//! let scenario = Scenario::parse("hang.toml", text, Path::new("."), &[], &catalogue).unwrap();
//!
//! let ports = vec![
//!     Port::output("body/position", Unit::Meter, 3),
//!     Port::output("body/velocity", Unit::MeterPerSecond, 3),
//! ];
//! let facts = Facts {
//!     weight: 10.8,
//!     plant_outputs: ports.clone(),
//!     ..Facts::default()
//! };
//! let scene = scenario.scene(&facts).unwrap();
//! assert_eq!(scene.wanted.len(), 2, "without a [record] table everything is recorded");
//!
//! let (plant, none) = (Layout::of(&ports, Direction::Output), Layout::default());
//! let layouts = Layouts {
//!     plant: &plant,
//!     process_inputs: &none,
//!     process_outputs: &none,
//!     diagnostics: &none,
//!     tasks: &[],
//! };
//! let mut judge = Judge::new(&scene, layouts);
//! // Fewer than ten samples are unobserved.
//! for millis in 0..10 {
//!     let now = SimTime::ZERO + SimDuration::from_millis(millis);
//!     judge.samples(now, Group::Plant, &[0.0, 0.0, 0.12, 0.0, 0.0, 0.0]);
//! }
//! let end = RunEnd {
//!     at: scenario.end(),
//!     energy: None,
//!     work: None,
//!     real_time_factor: None,
//!     buses: &[],
//! };
//! let outcomes = judge.finish(&end);
//! assert_eq!(outcomes[0].verdict, Verdict::Pass);
//! assert!((outcomes[0].margin.unwrap() - 0.02).abs() < 1e-12);
//! ```
//!
//! # Modules
//!
//! | module | contents |
//! |---|---|
//! | `language` | declarations of tables and keys |
//! | `read` | from a file to a scenario; a file for each table |
//! | `expect`, `body`, `gait` | claims |
//! | `judge` | `resolve` makes a monitor of a claim, which measures |
//! | `schema` | the JSON schema, from the declarations |
//!
//! A new measure of the trunk is four places: a variant of `BodyMeasure` in `body.rs`, with its
//! unit and whether it needs an upright robot, a key in `read/expect/body.rs`, its monitor in
//! `judge/resolve.rs`, and the signals that details name in `judge/labels.rs`. The compiler names
//! all of them but the key. Then the reference and the schemas are written anew.
//!
//! Not in this crate: execution of runs, particular plants, controllers and buses, the search for
//! robot files, and clocks.

mod actuator;
mod body;
mod catalogue;
mod check_sensors;
mod check_signals;
mod claim_limits;
mod claim_unit;
mod compare;
mod domain;
mod expect;
mod facts;
mod gait;
mod glob;
mod ground_below;
mod judge;
mod language;
mod left_out;
mod limits;
mod loads;
mod options;
mod pattern;
mod read;
mod recovery;
mod scenario;
mod scene;
mod schema;
mod sequence;
mod until;

pub use actuator::{ActuatorKind, ActuatorSpec, FirmwarePlace, ServoOverride, SetPointKind};
pub use body::{Along, BodyClaim, BodyMeasure, GetsUp};
pub use catalogue::{Catalogue, Kind, Standalone, VariableSpec};
pub use compare::{CompareClaim, CompareMeasure, Operand};
pub use expect::{
    Axis, Claim, CostMeasure, CycleMark, Expectation, FootstepClaim, FootstepMeasure, LegChoice,
    SignalClaim, SignalMode, TimingClaim, TimingMeasure, ValueKind,
};
pub use facts::{Facts, LegFact};
pub use gait::{Fitness, FitnessScales, FitnessTerms, GaitClaim, GaitMeasure};
pub use glob::matches;
pub use ground_below::GroundBelow;
pub use judge::{
    CommandedGait, DriveLimits, Footstep, Judge, LIFT_SHARE_MIN, Layouts, LegCycle, LoadCycle,
    Outcome, Reference, RunEnd, SATURATED_SHARE_MAX, Similarity, TrackedDrive, TrackedLeg,
    TrackedLift, Tracking, TrackingReport, Verdict, Witness,
};
pub use left_out::LeftOut;
pub use limits::{Comparison, Limits};
pub use loads::{PayloadSpec, SurfaceSpec};
pub use options::{Accepts, OptionSpec, OptionValue, Options};
pub use pattern::Pattern;
pub use read::{language, print_duration};
pub use recovery::{Recovery, TrunkQuantity};
pub use scenario::{
    Abduction, Base, BusSpec, ChangeSpec, Contacts, ControllerSpec, EnsembleSpec, FallSpec,
    FaultSpec, FootstepSpec, Ground, Heights, IoSpec, LoadThreshold, ObserveSpec, PlantSpec,
    Profile, PulseShape, PushLoad, PushSite, PushSpec, RecordSpec, Scenario, SensorSpec, Setting,
    StartPose, Varied,
};
pub use scene::{Scene, SensedSignal};
pub use schema::schema;
pub use sequence::{Condition, Relation, SequenceClaim};
pub use twinrig_document::declaration::{KeyReference, TableReference};

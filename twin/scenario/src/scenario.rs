//! A scenario: the content of a scenario file.

use std::path::PathBuf;

use twinrig_document::{Overrides, Place, Placed, Warning};
use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_runtime::{Change, Coupling, FaultKind, FaultSelection, SensorModel, Timing};

use crate::actuator::ActuatorSpec;
use crate::body::BodyClaim;
use crate::expect::{Claim, Expectation};
use crate::language::Words;
use crate::left_out::LeftOut;
use crate::loads::{PayloadSpec, SurfaceSpec};
use crate::options::Options;

/// A value that overrides one of the scenario file, as `--set KEY=VALUE` and `--plant MODEL` do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Name that messages show in place of a file: `--set`.
    pub origin: String,
    /// Dotted key: `plant.step`.
    pub key: String,
    /// TOML value; taken as a text if it is not valid TOML.
    pub value: String,
}

impl Setting {
    /// `--plant NAME`
    pub fn plant(name: &str) -> Self {
        Self {
            origin: "--plant".to_owned(),
            key: "plant.model".to_owned(),
            value: twinrig_document::quoted(name),
        }
    }
}

/// A scenario, read and checked against the catalogue of a build. Names of legs and signals, which
/// depend on the robot, are checked by [`Scenario::scene`].
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// Name of the file, as passed by the caller.
    pub file: String,
    /// The text of the file, without settings.
    pub text: String,
    /// The settings on top of it.
    pub settings: Vec<Setting>,
    /// Folder that paths and robots are relative to.
    pub folder: PathBuf,
    /// Title, one line.
    pub name: String,
    /// Name or path of the robot file; none for a standalone plant.
    pub robot: Option<Placed<String>>,
    /// Replaced values of the robot file.
    pub overrides: Overrides,
    /// Duration of the run: that of the file, or `until` if it is shorter.
    pub duration: SimDuration,
    /// Seed of all random streams.
    pub seed: u64,
    /// Runs from perturbed starts or with other seeds; none for one run.
    pub ensemble: Option<EnsembleSpec>,
    /// Time up to which the trajectory is predictable; none: it is not known.
    pub horizon: Option<SimDuration>,
    /// The physics.
    pub plant: PlantSpec,
    /// Actuators between commands and joints.
    pub actuator: ActuatorSpec,
    /// Controller; none if the file has none.
    pub controller: Option<ControllerSpec>,
    /// I/O between controller and plant.
    pub io: IoSpec,
    /// Buses between controller and plant, in the order of the file; none if signals are connected
    /// directly.
    pub buses: Vec<BusSpec>,
    /// Faults of the buses, in the order of the file.
    pub faults: Vec<FaultSpec>,
    /// Sensors of the controller's inputs, in the order of the file.
    pub sensors: Vec<SensorSpec>,
    /// Pushes on trunk and feet, in the order of the file.
    pub pushes: Vec<PushSpec>,
    /// Observation period and footstep thresholds.
    pub observe: ObserveSpec,
    /// The thresholds of a fall.
    pub fall: FallSpec,
    /// Recording options.
    pub record: RecordSpec,
    /// Changes of process variables, by time, then in the order of the file.
    pub changes: Vec<ChangeSpec>,
    /// Expectations of this plant, in the order of the file.
    pub expectations: Vec<Expectation>,
    /// Expectations of other plants than this one.
    pub of_other_plants: Vec<Expectation>,
    /// Parts left out because `until` ends the run before them.
    pub beyond_end: Vec<LeftOut>,
    /// Accepted values that are probably mistakes.
    pub warnings: Vec<Warning>,
}

/// `ensemble`
#[derive(Clone, Debug, PartialEq)]
pub struct EnsembleSpec {
    /// Number of runs, the unperturbed one included.
    pub runs: usize,
    /// Least share of the runs in which an expectation holds.
    pub share: f64,
    /// Difference between the runs.
    pub vary: Varied,
    /// Overlay of a fit, relative to the scenario, whose parameters are varied.
    pub fit: Option<Placed<String>>,
}

/// Difference between the runs of an ensemble.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Varied {
    /// The start of the plant: all runs have the same random numbers.
    Start,
    /// The seed of the random numbers.
    Seed,
    /// Fitted values of the file of the robot or bench, by their distribution.
    Fit,
}

impl Words for Varied {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("start", Varied::Start),
        ("seed", Varied::Seed),
        ("fit", Varied::Fit),
    ];
}

/// `[plant]`
#[derive(Clone, Debug, PartialEq)]
pub struct PlantSpec {
    /// Position of the table.
    pub place: Place,
    /// One of [`crate::Catalogue::plants`].
    pub model: String,
    /// Whether it is a standalone model; the fields from here to `step` then have no effect.
    pub is_standalone: bool,
    /// Degrees of freedom of the trunk.
    pub base: Base,
    /// Joints of hip abduction.
    pub abduction: Abduction,
    /// Parts that have contact with the ground.
    pub contacts: Contacts,
    /// Simulated legs; none for all legs of the robot.
    pub legs: Option<Vec<Placed<String>>>,
    /// Ground; none if the robot hangs in the air.
    pub ground: Option<Ground>,
    /// Payloads of the trunk, in the order of the file.
    pub payloads: Vec<PayloadSpec>,
    /// Initial pose of the legs; none for the first command of the controller.
    pub start: Option<StartPose>,
    /// Time step; none for the default of the plant.
    pub step: Option<SimDuration>,
    /// Coupling to the tasks that sample and actuate.
    pub coupling: Coupling,
    /// Options that the model declares.
    pub options: Options,
}

/// Degrees of freedom of the trunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// All six degrees of freedom.
    Free,
    /// Forward, vertical and pitch.
    Planar,
    /// No motion.
    Fixed,
}

impl Words for Base {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("free", Base::Free),
        ("planar", Base::Planar),
        ("fixed", Base::Fixed),
    ];
}

/// Joints of hip abduction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Abduction {
    /// Locked at zero.
    Locked,
    /// Joints with the servos of the robot file.
    Free,
}

impl Words for Abduction {
    const WORDS: &'static [(&'static str, Self)] =
        &[("locked", Abduction::Locked), ("free", Abduction::Free)];
}

/// Parts that have contact with the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contacts {
    /// Feet.
    Feet,
    /// Feet, and corners of the trunk's box.
    Trunk,
    /// Feet, corners of the trunk's box, knees and ankles.
    All,
}

impl Words for Contacts {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("feet", Contacts::Feet),
        ("trunk", Contacts::Trunk),
        ("all", Contacts::All),
    ];
}

/// `[plant] start`: angles and rates of hip, knee and ankle of all legs, each relative to the
/// segment before it.
#[derive(Clone, Debug, PartialEq)]
pub struct StartPose {
    /// Angles `q1`, `q2`, `q3`, zero in the leg's reference pose \[rad\].
    pub q: [f64; 3],
    /// Their rates `q1_rate`, `q2_rate`, `q3_rate` \[rad/s\].
    pub rates: [f64; 3],
    /// Places of the angles in the scenario, that of the table for an absent one.
    pub places: [Place; 3],
}

/// `[plant] ground`
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Coulomb friction coefficient; none for that of the robot file.
    pub friction: Option<f64>,
    /// Coefficient of restitution of a foot's impact.
    pub restitution: f64,
    /// Its shape.
    pub profile: Profile,
    /// Parts with another friction, in the order of the file: the last that applies has effect.
    pub surfaces: Vec<SurfaceSpec>,
    /// Its place in the scenario, for messages.
    pub place: Place,
}

/// Shape of the ground. x is forward from the start of the robot, y to its left, height is 0 at the
/// start.
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// Height 0 everywhere.
    Flat,
    /// Height 0 up to `at`, `-height` from there on \[m\].
    StepDown {
        /// Distance from the start \[m\].
        at: f64,
        /// Depth of the step \[m\].
        height: f64,
    },
    /// Height 0 but for `-height` over `length` from `at` on, for all y \[m\].
    Hole {
        /// Distance of its near edge from the start \[m\].
        at: f64,
        /// Extent along x \[m\].
        length: f64,
        /// Depth \[m\].
        height: f64,
    },
    /// The same with `height` above the ground.
    Bar {
        /// Distance of its near edge from the start \[m\].
        at: f64,
        /// Extent along x \[m\].
        length: f64,
        /// Height \[m\].
        height: f64,
    },
    /// Heights on a square grid.
    Heights {
        /// Side of a square \[m\].
        spacing: f64,
        /// Source of the heights.
        heights: Heights,
    },
}

/// Heights of a grid.
#[derive(Clone, Debug, PartialEq)]
pub enum Heights {
    /// One row for each line in y, along x \[m\]; all rows have the same length.
    Given(Vec<Vec<f64>>),
    /// Uniformly distributed between `-amplitude` and `amplitude` \[m\].
    Random {
        /// Greatest height \[m\].
        amplitude: f64,
        /// Seed of the heights; none for that of the scenario.
        seed: Option<u64>,
    },
}

/// `[controller]`
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerSpec {
    /// One of [`crate::Catalogue::controllers`].
    pub kind: String,
    /// Control period.
    pub period: SimDuration,
    /// Computing time of a step.
    pub compute_time: Timing,
    /// Options that the kind declares.
    pub options: Options,
    /// Initial values of process variables that the scenario sets, by full names.
    pub variables: Vec<(String, f64)>,
}

/// `[io]`
#[derive(Clone, Debug, PartialEq)]
pub struct IoSpec {
    /// The step Δt of the scheduling rule; the controller's period is a multiple of it.
    pub step: SimDuration,
    /// Transfer time.
    pub transfer_time: Timing,
}

/// `[bus]`, or one of several `[[bus]]`
#[derive(Clone, Debug, PartialEq)]
pub struct BusSpec {
    /// Name, as in `wire/sbcp` and `--port sbcp=DEVICE`; by default its kind.
    pub name: Placed<String>,
    /// One of [`crate::Catalogue::buses`].
    pub kind: String,
    /// Options that the kind declares.
    pub options: Options,
}

/// `[[fault]]`
#[derive(Clone, Debug, PartialEq)]
pub struct FaultSpec {
    /// Start.
    pub at: SimTime,
    /// Duration; none to the end of the run.
    pub lasts: Option<SimDuration>,
    /// Site: `wire/sbcp`, `wire/sbcp/link`, `wire/sbcp/LF`.
    pub on: Placed<String>,
    /// Fault.
    pub kind: FaultKind,
    /// Part of the traffic that it harms.
    pub select: FaultSelection,
    /// Place of the kind of message in `select`, if there is one.
    pub after: Option<Placed<String>>,
}

/// `[[sensor]]`
#[derive(Clone, Debug, PartialEq)]
pub struct SensorSpec {
    /// Name; none for that of each signal.
    pub name: Option<String>,
    /// Signal, or pattern of signals, that the controller reads.
    pub of: Placed<String>,
    /// Parameters, in SI units.
    pub model: SensorModel,
    /// Unit in which they are given, with the position of the first of them; none if there is none.
    pub unit: Option<Placed<Unit>>,
}

/// `[[push]]`
#[derive(Clone, Debug, PartialEq)]
pub struct PushSpec {
    /// Name.
    pub name: String,
    /// Pushed part.
    pub on: PushSite,
    /// Begin.
    pub at: SimTime,
    /// Duration.
    pub lasts: SimDuration,
    /// Force or torque.
    pub load: PushLoad,
    /// Course over the duration.
    pub shape: PulseShape,
    /// Greatest force \[N\] or torque \[N·m\], world axes.
    pub peak: [f64; 3],
    /// Its place in the scenario, for messages.
    pub place: Place,
}

/// Part that is pushed.
#[derive(Clone, Debug, PartialEq)]
pub enum PushSite {
    /// The trunk.
    Trunk,
    /// The foot of a leg.
    Foot(Placed<String>),
}

/// Load of a push.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PushLoad {
    /// A force, on the trunk at a place in its axes, from its centre of mass \[m\].
    Force([f64; 3]),
    /// A torque.
    Torque,
}

/// Course of a push over its duration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PulseShape {
    /// Constant.
    Rectangle,
    /// Half a period of a sine.
    HalfSine,
    /// Linear rise and fall of equal length.
    Triangle,
}

/// `[observe]`
#[derive(Clone, Debug, PartialEq)]
pub struct ObserveSpec {
    /// Period of the observations of the plant.
    pub period: SimDuration,
    /// Thresholds of a footstep.
    pub footsteps: FootstepSpec,
}

/// Thresholds of a footstep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootstepSpec {
    /// Load that begins a contact.
    pub touch_down: LoadThreshold,
    /// Load below which a contact ends.
    pub lift_off: LoadThreshold,
    /// Least time off the ground: contacts with a shorter gap belong to one footstep.
    pub shortest_swing: SimDuration,
    /// Least impulse of a footstep, as a multiple of the body weight \[s\].
    pub least_impulse: f64,
}

/// `fall`: thresholds of a fall. After a fall no claim about footsteps, speed or heading passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FallSpec {
    /// Least height of the trunk above the ground below it, as a share of its initial height.
    pub height: f64,
    /// Greatest roll or pitch, in magnitude \[rad\].
    pub tilt: f64,
    /// Whether a fall ends the run.
    pub end: bool,
}

/// Threshold of the load of a foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadThreshold {
    /// Share of the body weight.
    OfWeight(f64),
    /// \[N\]
    Newton(f64),
}

impl LoadThreshold {
    /// Returns the load for a robot of weight `weight` \[N\].
    pub fn newton(self, weight: f64) -> f64 {
        match self {
            LoadThreshold::OfWeight(share) => share * weight,
            LoadThreshold::Newton(load) => load,
        }
    }
}

/// `[record]`
#[derive(Clone, Debug, PartialEq)]
pub struct RecordSpec {
    /// Patterns of the recorded signals; none for all signals.
    pub signals: Option<Vec<Placed<String>>>,
    /// Rate at which the poses of all bodies are recorded \[Hz\]; none for no recording.
    pub frames: Option<f64>,
    /// Whether the bytes on the wires are recorded.
    pub bytes: bool,
}

/// `[[change]]`
#[derive(Clone, Debug, PartialEq)]
pub struct ChangeSpec {
    /// Time.
    pub at: SimTime,
    /// Full name of the process variable.
    pub variable: String,
    /// Its new value.
    pub change: Change,
}

impl Scenario {
    /// Returns the control period: that of the controller, or without one the step of the I/O.
    pub fn period(&self) -> SimDuration {
        let controller = self.controller.as_ref();
        controller.map_or(self.io.step, |spec| spec.period)
    }

    /// Returns the end of the run.
    pub fn end(&self) -> SimTime {
        SimTime::ZERO + self.duration
    }

    /// Returns whether an expectation compares with a run without changes.
    pub fn needs_reference(&self) -> bool {
        self.expectations.iter().any(Expectation::needs_reference)
    }

    /// Returns whether a fall ends the run.
    pub fn ends_with_a_fall(&self) -> bool {
        let ends =
            |claim: &Claim| matches!(claim, Claim::Body(BodyClaim::Upright { end: true, .. }));
        self.fall.end || self.expectations.iter().any(|one| ends(&one.claim))
    }

    /// Returns the bus of that name.
    pub fn bus(&self, name: &str) -> Option<&BusSpec> {
        self.buses.iter().find(|bus| bus.name.value == name)
    }

    /// Returns the scenario without expectations.
    #[must_use]
    pub fn without_expectations(&self) -> Self {
        Scenario {
            expectations: Vec::new(),
            ..self.clone()
        }
    }

    /// Returns the scenario of the reference run: without changes and expectations.
    #[must_use]
    pub fn without_changes(&self) -> Self {
        Scenario {
            changes: Vec::new(),
            expectations: Vec::new(),
            ..self.clone()
        }
    }
}

//! A scenario: the meaning of a scenario file.

use std::path::{Path, PathBuf};

use twinrig_document::{Document, DocumentError, Overrides, Place, Problem, Warning};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Change, Coupling, FaultKind, Timing};

use crate::catalogue::Catalogue;
use crate::expect::{BodyClaim, Claim, Expectation};
use crate::options::Options;
use crate::read;

/// A value and where the file says it.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed<T> {
    /// The value.
    pub value: T,
    /// Where it stands, for messages that can only be written later (there is no such robot).
    pub place: Place,
}

impl<T> Placed<T> {
    /// The error that the value is wrong.
    pub fn error(&self, message: impl Into<String>, help: impl Into<String>) -> DocumentError {
        Problem::at(&self.place, message, help).into()
    }
}

/// A value that is set on top of a scenario file, as `--set KEY=VALUE` and `--plant MODEL` do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// What messages show for a file: `--set`.
    pub origin: String,
    /// Dotted key: `plant.step`.
    pub key: String,
    /// TOML, or else taken as a text.
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

/// A scenario, read and checked against what a build offers. What needs the robot to be checked (names of legs, names of
/// signals) is checked by [`Scenario::scene`].
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    /// The file, as it was named.
    pub file: String,
    /// The text of the file, without settings.
    pub text: String,
    /// The settings on top of it.
    pub settings: Vec<Setting>,
    /// The folder that paths and robots are seen from.
    pub folder: PathBuf,
    /// A line for a person.
    pub name: String,
    /// Name or path of the robot file; none: the plant stands alone.
    pub robot: Option<Placed<String>>,
    /// What replaces values of the robot file.
    pub overrides: Overrides,
    /// How long to run.
    pub duration: SimDuration,
    /// What all random streams spring from.
    pub seed: u64,
    /// The physics.
    pub plant: PlantSpec,
    /// What stands between a command and a joint.
    pub actuator: ActuatorSpec,
    /// The controller; none if the file has none.
    pub controller: Option<ControllerSpec>,
    /// The exchange between controller and plant.
    pub io: IoSpec,
    /// The buses between controller and plant, in the order of the file; none: signals go straight.
    pub buses: Vec<BusSpec>,
    /// What goes wrong on them, in the order of the file.
    pub faults: Vec<FaultSpec>,
    /// What is looked at, and how often.
    pub observe: ObserveSpec,
    /// The thresholds of a fall.
    pub fall: FallSpec,
    /// What is written down.
    pub record: RecordSpec,
    /// Changes of process variables, by time, then in the order of the file.
    pub changes: Vec<ChangeSpec>,
    /// What is expected, in the order of the file.
    pub expectations: Vec<Expectation>,
    /// What would be expected of other plants than this one.
    pub of_other_plants: Vec<Expectation>,
    /// What is accepted and most likely a mistake.
    pub warnings: Vec<Warning>,
}

/// `[plant]`
#[derive(Clone, Debug, PartialEq)]
pub struct PlantSpec {
    /// Where the table stands.
    pub place: Place,
    /// One of [`Catalogue::plants`].
    pub model: String,
    /// Whether it brings a model of its own; nothing between here and `step` is said then.
    pub is_standalone: bool,
    /// How the trunk may move.
    pub base: Base,
    /// The legs to simulate; none: all that the robot has.
    pub legs: Option<Vec<Placed<String>>>,
    /// The ground; none: the robot hangs in the air.
    pub ground: Option<Ground>,
    /// How the legs start; none: where the controller first wants them.
    pub start: Option<StartPose>,
    /// The time step; none: the plant's own.
    pub step: Option<SimDuration>,
    /// How it meets those who sample and actuate.
    pub coupling: Coupling,
    /// What the model declares.
    pub options: Options,
}

/// How the trunk may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// In all six degrees of freedom.
    Free,
    /// Forward, up and in pitch.
    Planar,
    /// Not at all.
    Fixed,
}

/// `[plant] start`: angles and rates of hip, knee and ankle, each against the segment before it, of all legs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StartPose {
    /// Angles `q1`, `q2`, `q3`, zero in the leg's reference pose \[rad\].
    pub q: [f64; 3],
    /// Their rates `q1_rate`, `q2_rate`, `q3_rate` \[rad/s\].
    pub rates: [f64; 3],
}

/// `[plant] ground`
#[derive(Clone, Debug, PartialEq)]
pub struct Ground {
    /// Coulomb coefficient; none: the robot file's.
    pub friction: Option<f64>,
    /// Share of its speed that a foot rebounds with.
    pub restitution: f64,
    /// Its shape.
    pub profile: Profile,
}

/// The shape of the ground. x is forward from where the robot starts, y to its left, height is 0 at the start.
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
    /// Heights on a square grid.
    Heights {
        /// Side of a square \[m\].
        spacing: f64,
        /// Where the heights come from.
        heights: Heights,
    },
}

/// Heights of a grid.
#[derive(Clone, Debug, PartialEq)]
pub enum Heights {
    /// One row per line in y, each along x \[m\]; all rows have the same length.
    Given(Vec<Vec<f64>>),
    /// Drawn evenly between `-amplitude` and `amplitude` \[m\].
    Random {
        /// Greatest height \[m\].
        amplitude: f64,
        /// Seed of the heights; none: the scenario's.
        seed: Option<u64>,
    },
}

/// `[actuator]`
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ActuatorSpec {
    /// What kind it is.
    pub kind: ActuatorKind,
    /// Replaces figures of the robot's hip servos.
    pub hip: ServoOverride,
    /// Replaces figures of the robot's knee servos.
    pub knee: ServoOverride,
}

/// What stands between a command and a joint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ActuatorKind {
    /// Nothing: no motors and no cables.
    None,
    /// The joint is where it is commanded to be.
    Ideal,
    /// A position servo with lag, limits and dead band.
    #[default]
    Servo,
    /// A direct-current motor under the voltage that a board puts out.
    Motor,
}

/// Figures of a servo that replace the robot file's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoOverride {
    /// \[s\]
    pub lag: Option<f64>,
    /// \[rad/s\]
    pub speed: Option<f64>,
    /// \[N·m\]
    pub torque: Option<f64>,
    /// \[rad\]
    pub dead_band: Option<f64>,
}

/// `[controller]`
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerSpec {
    /// One of [`Catalogue::controllers`].
    pub kind: String,
    /// Time between two steps of it.
    pub period: SimDuration,
    /// How long a step takes it.
    pub compute_time: Timing,
    /// What the kind declares.
    pub options: Options,
    /// Process variables that the scenario sets from the start, by their full names.
    pub variables: Vec<(String, f64)>,
}

/// `[io]`
#[derive(Clone, Debug, PartialEq)]
pub struct IoSpec {
    /// The step Δt of the scheduling rule; the controller's period is a multiple of it.
    pub step: SimDuration,
    /// How long a transfer takes.
    pub transfer_time: Timing,
}

/// `[bus]`, or one of several `[[bus]]`
#[derive(Clone, Debug, PartialEq)]
pub struct BusSpec {
    /// What it is called: `sbcp` in `wire/sbcp` and `--port sbcp=DEVICE`. Its kind, if the file does not say.
    pub name: Placed<String>,
    /// One of [`Catalogue::buses`].
    pub kind: String,
    /// What the kind declares.
    pub options: Options,
}

/// `[[fault]]`
#[derive(Clone, Debug, PartialEq)]
pub struct FaultSpec {
    /// When it begins.
    pub at: SimTime,
    /// How long it lasts; none: to the end.
    pub lasts: Option<SimDuration>,
    /// Where: `wire/sbcp`, `wire/sbcp/link`, `wire/sbcp/LF`.
    pub on: Placed<String>,
    /// What.
    pub kind: FaultKind,
}

/// `[observe]`
#[derive(Clone, Debug, PartialEq)]
pub struct ObserveSpec {
    /// Time between two observations of the plant.
    pub period: SimDuration,
    /// What counts as a footstep.
    pub footsteps: FootstepSpec,
}

/// What counts as a footstep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootstepSpec {
    /// A foot touches down when its load reaches this.
    pub touch_down: LoadThreshold,
    /// A foot lifts off when its load falls below this.
    pub lift_off: LoadThreshold,
    /// A foot that touches down again within this has not lifted off.
    pub shortest_swing: SimDuration,
    /// A contact of less impulse is no footstep \[s of body weight\].
    pub least_impulse: f64,
}

/// `fall`: when the robot has fallen. From then on no claim about its footsteps, its speed or its
/// heading passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FallSpec {
    /// The trunk is lower than this share of its first height above the ground below it.
    pub height: f64,
    /// It rolls or pitches beyond this \[rad\].
    pub tilt: f64,
    /// Whether that ends the run.
    pub end: bool,
}

/// A load of a foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadThreshold {
    /// A share of the body's weight.
    OfWeight(f64),
    /// \[N\]
    Newton(f64),
}

impl LoadThreshold {
    /// The load for a robot that weighs `weight` \[N\].
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
    /// Patterns of the signals to write down; none: all.
    pub signals: Option<Vec<Placed<String>>>,
    /// How often the pose of every body is written down \[Hz\]; none: never.
    pub frames: Option<f64>,
    /// Whether the bytes on the wires are written down.
    pub bytes: bool,
}

/// `[[change]]`
#[derive(Clone, Debug, PartialEq)]
pub struct ChangeSpec {
    /// When.
    pub at: SimTime,
    /// Full name of the process variable.
    pub variable: String,
    /// Its new value.
    pub change: Change,
}

impl Scenario {
    /// Reads the scenario in the file at `path`, with `settings` on top.
    ///
    /// # Errors
    /// The file cannot be read, or what it says is wrong: everything that is, each at its place.
    pub fn load(
        path: &Path,
        settings: &[Setting],
        catalogue: &Catalogue,
    ) -> Result<Self, DocumentError> {
        let document = Document::read(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        read::scenario(document, folder, settings, catalogue)
    }

    /// Reads the scenario `text`, which messages call `file`; robots are looked for from `folder`.
    ///
    /// # Errors
    /// Everything that is wrong, each at its place.
    pub fn parse(
        file: &str,
        text: &str,
        folder: &Path,
        settings: &[Setting],
        catalogue: &Catalogue,
    ) -> Result<Self, DocumentError> {
        read::scenario(Document::parse(file, text)?, folder, settings, catalogue)
    }

    /// The control period: that of the controller, or else the step of the I/O.
    pub fn period(&self) -> SimDuration {
        let controller = self.controller.as_ref();
        controller.map_or(self.io.step, |spec| spec.period)
    }

    /// The end of the run.
    pub fn end(&self) -> SimTime {
        SimTime::ZERO + self.duration
    }

    /// Whether an expectation compares with a run without the changes.
    pub fn needs_reference(&self) -> bool {
        self.expectations.iter().any(Expectation::needs_reference)
    }

    /// Whether a fall ends the run.
    pub fn ends_with_a_fall(&self) -> bool {
        let ends =
            |claim: &Claim| matches!(claim, Claim::Body(BodyClaim::Upright { end: true, .. }));
        self.fall.end || self.expectations.iter().any(|one| ends(&one.claim))
    }

    /// The bus of that name.
    pub fn bus(&self, name: &str) -> Option<&BusSpec> {
        self.buses.iter().find(|bus| bus.name.value == name)
    }

    /// The same scenario without expectations.
    #[must_use]
    pub fn without_expectations(&self) -> Self {
        Scenario {
            expectations: Vec::new(),
            ..self.clone()
        }
    }

    /// The reference run: the same scenario without its changes and expectations.
    #[must_use]
    pub fn without_changes(&self) -> Self {
        Scenario {
            changes: Vec::new(),
            expectations: Vec::new(),
            ..self.clone()
        }
    }
}

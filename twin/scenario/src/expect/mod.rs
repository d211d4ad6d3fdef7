//! What a scenario expects of its run.

mod beyond_end;
mod read;
mod read_footstep;

use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_runtime::WorkCounts;

use crate::limits::{Domain, Limits};
use crate::scenario::Placed;

pub(crate) use read::{
    BODY_MEASURES, Context, SIGNAL_MODES, SUBJECTS, TIMING_MEASURES, expectation, placed_text,
    thresholds,
};
pub(crate) use read_footstep::FOOTSTEP_MEASURES;

/// One `[[expect]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    /// What it is called in the verdict.
    pub name: String,
    /// Nothing earlier counts.
    pub after: SimTime,
    /// Nothing later counts; none: to the end.
    pub before: Option<SimTime>,
    /// Whether it holds if the run cannot observe it.
    pub optional: bool,
    /// The plants that it is about; none: whichever it is.
    pub plants: Vec<String>,
    /// What is claimed.
    pub claim: Claim,
}

/// What is claimed.
#[derive(Clone, Debug, PartialEq)]
pub enum Claim {
    /// Of footsteps.
    Footstep(FootstepClaim),
    /// Of the trunk.
    Body(BodyClaim),
    /// Of the cycle of the controller or of a bus.
    Timing(TimingClaim),
    /// Of a signal.
    Signal(SignalClaim),
    /// That the energy books close: |residual| over the energy exchanged, at the end of the run.
    EnergyResidual(Limits),
    /// Of the work that the run took.
    Cost(CostMeasure, Limits),
}

impl Claim {
    /// Whether it is about how a robot goes, and says nothing about one that lies: where it fell,
    /// its footsteps, its speed and its heading are those of a fall.
    pub(crate) fn is_of_an_upright_robot(&self) -> bool {
        matches!(
            self,
            Claim::Footstep(_) | Claim::Body(BodyClaim::Speed(..) | BodyClaim::YawDrift(_))
        )
    }
}

/// A claim about footsteps.
#[derive(Clone, Debug, PartialEq)]
pub struct FootstepClaim {
    /// Whose footsteps.
    pub legs: LegChoice,
    /// What about them.
    pub measure: FootstepMeasure,
}

/// Whose footsteps.
#[derive(Clone, Debug, PartialEq)]
pub enum LegChoice {
    /// Those of every leg of the scene.
    All,
    /// Those of the legs before the centre of mass.
    Fore,
    /// Those of the legs behind it.
    Hind,
    /// Those of these legs.
    Named(Vec<Placed<String>>),
}

/// What about footsteps.
#[derive(Clone, Debug, PartialEq)]
pub enum FootstepMeasure {
    /// Greatest horizontal distance moved while in contact, of every footstep \[m\].
    Slip(Limits),
    /// Mean share of a leg's cycle, touch-down to touch-down, that it stands; of every leg \[1\].
    DutyFactor(Limits),
    /// Touch-down to lift-off, of every footstep \[s\].
    StanceTime(Limits),
    /// Lift-off to the next touch-down, of every footstep but a leg's last \[s\].
    SwingTime(Limits),
    /// Mean number of touch-downs a second, of every leg \[Hz\].
    Frequency(Limits),
    /// Horizontal distance between successive touch-downs of a leg, of every footstep but a leg's last \[m\].
    StrideLength(Limits),
    /// Impulse of the ground, of every footstep \[N·s\].
    Impulse(Limits),
    /// Greatest load, of every footstep \[N\].
    PeakLoad(Limits),
    /// Coordinate of the touch-down, of every footstep \[m\].
    Position(Axis, Limits),
    /// Number of touch-downs, of every leg \[1\].
    Count(Limits),
    /// Each leg's mean phase (circular) in the cycle of the first leg is the pattern's.
    Phase {
        /// The pattern.
        pattern: Pattern,
        /// Greatest distance of any leg, as a share of the cycle.
        tolerance: f64,
    },
    /// Circular standard deviation of each leg's phase in the cycle of the first leg \[1, share of the cycle\].
    PhaseSpread(Limits),
    /// Legs touch down in this order, again and again; legs of one group in any order among themselves. What is measured
    /// is the number of touch-downs out of order.
    Order(Vec<Vec<Placed<String>>>),
    /// How far a footstep stands from the same footstep of the run without changes, by cycle \[m\].
    Displacement {
        /// Along which axis.
        axis: Axis,
        /// Which footstep: 1 is the first that touches down after `after` (by default after the first change).
        cycle: u32,
        /// Its limits.
        limits: Limits,
    },
}

/// An axis of the world, or the horizontal distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Forward from the start.
    X,
    /// To the left of the start.
    Y,
    /// Up.
    Z,
    /// The distance in the plane.
    Horizontal,
}

/// The phase of each leg's touch-down in the cycle of the first leg.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// Diagonal legs together.
    Trot,
    /// Legs of one side together.
    Pace,
    /// A hind leg, the fore leg of its side, the other hind leg, the other fore leg; a quarter apart.
    Walk,
    /// Fore legs together, hind legs together.
    Bound,
    /// Given leg by leg, as shares of a cycle; only differences count.
    Given(Vec<(Placed<String>, f64)>),
}

/// A claim about the trunk.
#[derive(Clone, Debug, PartialEq)]
pub enum BodyClaim {
    /// Mean speed over the window \[m/s\].
    Speed(Along, Limits),
    /// Height of its centre of mass \[m\].
    Height(Limits),
    /// Greatest angle about the x axis, either way \[rad\].
    Roll(Limits),
    /// Greatest angle about the y axis, either way \[rad\].
    Pitch(Limits),
    /// Greatest less least roll \[rad\].
    RollRange(Limits),
    /// Greatest less least pitch \[rad\].
    PitchRange(Limits),
    /// Greatest less least height \[m\].
    HeightRange(Limits),
    /// Greatest turn away from the heading at the window's start, either way, whole turns counted \[rad\].
    YawDrift(Limits),
    /// It does not fall.
    Upright {
        /// It has fallen when it is lower than this share of its height in the first observation of the run.
        height: f64,
        /// It has fallen when it rolls or pitches beyond this \[rad\].
        tilt: f64,
        /// Whether that ends the run.
        end: bool,
    },
    /// From `by` on to the window's end, each coordinate stays within `within` of where it ends.
    Settles {
        /// \[m\]
        within: f64,
        /// Since the start of the run.
        by: SimTime,
    },
}

/// How a distance is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// From the first to the last place of the window, along the heading at its start; backward counts negative.
    Heading,
    /// Along the path.
    Path,
}

/// A claim about a cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingClaim {
    /// Whose cycle: that of a bus, or, without one, the controller's.
    pub of: Option<Placed<String>>,
    /// What about it.
    pub measure: TimingMeasure,
    /// Its limits.
    pub limits: Limits,
}

/// What about a cycle: an iteration of the controller, or a transfer of a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimingMeasure {
    /// Number of cycles that began too late or not at all \[1\].
    DeadlineMisses,
    /// Mean rate \[Hz\].
    CycleRate,
    /// Greatest distance of the time between two cycles from the period \[s\].
    Jitter,
    /// Greatest time from a cycle's begin to its end \[s\].
    Latency,
    /// Greatest time from a cycle's begin to the next one's \[s\]: its inverse is the rate that is guaranteed.
    LongestCycle,
    /// Half of what the longest time between two begins exceeds the shortest by \[s\].
    HalfRange,
}

/// A claim about one signal, or about every signal that matches a pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalClaim {
    /// Name or pattern.
    pub name: Placed<String>,
    /// Which element; none: every one.
    pub component: Option<usize>,
    /// The unit that limits were given in.
    pub unit: Unit,
    /// What of it.
    pub mode: SignalMode,
}

/// What of a signal.
#[derive(Clone, Debug, PartialEq)]
pub enum SignalMode {
    /// It is within limits in every observation.
    Always(Limits),
    /// It is within limits in one observation at least; within a time from the window's start, if one is given.
    Eventually(Limits, Option<SimDuration>),
    /// It is within limits until another signal first is within its own; which must happen.
    Until(Limits, Until),
    /// From `by` on to the window's end it stays within `within` of where it ends.
    Settles {
        /// In the signal's unit.
        within: f64,
        /// Since the start of the run.
        by: SimTime,
    },
}

/// What ends the time in which a signal must be within limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Until {
    /// Name of the other signal.
    pub name: Placed<String>,
    /// Its element.
    pub component: usize,
    /// The unit that its limits were given in.
    pub unit: Unit,
    /// Within these it ends the time.
    pub limits: Limits,
}

/// What work a run took.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CostMeasure {
    /// A count of the plant's, by its name: `steps`, `evaluations`, ….
    Count(&'static str),
    /// Simulated over wall time; depends on the machine.
    RealTimeFactor,
}

impl Expectation {
    /// Whether it compares with the run without changes.
    pub fn needs_reference(&self) -> bool {
        matches!(
            &self.claim,
            Claim::Footstep(FootstepClaim {
                measure: FootstepMeasure::Displacement { .. },
                ..
            })
        )
    }
}

impl CostMeasure {
    /// Names of the work counts of a plant.
    pub fn counts() -> [&'static str; 6] {
        WorkCounts::default().named().map(|(name, _)| name)
    }

    /// The measure that depends on the machine, too.
    pub(crate) const FACTOR: &'static str = "real_time_factor";
}

impl FootstepMeasure {
    /// The unit of what is measured.
    pub fn unit(&self) -> Unit {
        match self {
            FootstepMeasure::Slip(_)
            | FootstepMeasure::StrideLength(_)
            | FootstepMeasure::Position(..)
            | FootstepMeasure::Displacement { .. } => Unit::Meter,
            FootstepMeasure::StanceTime(_) | FootstepMeasure::SwingTime(_) => Unit::Second,
            FootstepMeasure::Frequency(_) => Unit::Hertz,
            FootstepMeasure::Impulse(_) => Unit::NewtonSecond,
            FootstepMeasure::PeakLoad(_) => Unit::Newton,
            FootstepMeasure::DutyFactor(_)
            | FootstepMeasure::Count(_)
            | FootstepMeasure::Phase { .. }
            | FootstepMeasure::PhaseSpread(_)
            | FootstepMeasure::Order(_) => Unit::One,
        }
    }
}

impl TimingMeasure {
    /// The values that it can take.
    pub(crate) fn domain(self) -> Domain {
        match self {
            TimingMeasure::DeadlineMisses => Domain::COUNT,
            TimingMeasure::LongestCycle => Domain::POSITIVE,
            TimingMeasure::CycleRate
            | TimingMeasure::Jitter
            | TimingMeasure::Latency
            | TimingMeasure::HalfRange => Domain::NOT_NEGATIVE,
        }
    }

    /// The unit of what is measured.
    pub fn unit(self) -> Unit {
        match self {
            TimingMeasure::DeadlineMisses => Unit::One,
            TimingMeasure::CycleRate => Unit::Hertz,
            TimingMeasure::Jitter
            | TimingMeasure::Latency
            | TimingMeasure::LongestCycle
            | TimingMeasure::HalfRange => Unit::Second,
        }
    }
}

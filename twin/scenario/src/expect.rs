//! Expectations of a scenario.

use twinrig_document::{Place, Placed};
use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_runtime::WorkCounts;

use crate::body::BodyClaim;
use crate::compare::CompareClaim;
use crate::domain::Domain;
use crate::gait::GaitClaim;
use crate::language::Words;
use crate::limits::Limits;
use crate::pattern::Pattern;
use crate::recovery::Recovery;
use crate::sequence::{Condition, Relation, SequenceClaim};

/// One `[[expect]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Expectation {
    /// Name in the verdict.
    pub name: String,
    /// Position of the name, or of the whole expectation if it has none.
    pub place: Place,
    /// Start of the window.
    pub after: SimTime,
    /// End of the window; none for the end of the run.
    pub before: Option<SimTime>,
    /// Whether it counts as satisfied if it is unobserved.
    pub optional: bool,
    /// Whether it is judged although a bus that it reads is dead for a time.
    pub through_silence: bool,
    /// Plants that it applies to; empty for all plants.
    pub plants: Vec<String>,
    /// Claim.
    pub claim: Claim,
}

/// Claim.
#[derive(Clone, Debug, PartialEq)]
pub enum Claim {
    /// About footsteps.
    Footstep(FootstepClaim),
    /// About the gait as a whole.
    Gait(GaitClaim),
    /// About the trunk.
    Body(BodyClaim),
    /// About the cycle of the controller or of a bus.
    Timing(TimingClaim),
    /// About a signal.
    Signal(SignalClaim),
    /// About a signal compared with another.
    Compare(CompareClaim),
    /// About the sequence of two conditions.
    Sequence(SequenceClaim),
    /// Residual of the energy balance: |residual| over the exchanged energy, at the end of the
    /// run.
    EnergyResidual(Limits),
    /// About the computational work of the run.
    Cost(CostMeasure, Limits),
}

impl Claim {
    /// Returns the key of the claim in a scenario.
    pub fn subject(&self) -> &'static str {
        match self {
            Claim::Footstep(_) => "footstep",
            Claim::Gait(_) => "gait",
            Claim::Body(_) => "body",
            Claim::Timing(_) => "timing",
            Claim::Signal(_) => "signal",
            Claim::Compare(_) => "compare",
            Claim::Sequence(claim) => match claim.relation {
                Relation::Then(_) => "response",
                Relation::Before(_) => "precedence",
            },
            Claim::EnergyResidual(_) => "energy",
            Claim::Cost(..) => "cost",
        }
    }

    /// Returns whether the claim applies to an upright robot only: after a fall, footsteps, speed,
    /// heading and ranges are those of the fall, and there is no recovery from it.
    pub(crate) fn requires_upright_robot(&self) -> bool {
        match self {
            Claim::Footstep(_) | Claim::Gait(_) | Claim::Body(BodyClaim::Recovers(..)) => true,
            Claim::Body(BodyClaim::Limited(measure, _)) => measure.requires_upright_robot(),
            Claim::Body(
                BodyClaim::Upright { .. } | BodyClaim::Settles { .. } | BodyClaim::GetsUp(_),
            )
            | Claim::Timing(_)
            | Claim::Signal(_)
            | Claim::Compare(_)
            | Claim::Sequence(_)
            | Claim::EnergyResidual(_)
            | Claim::Cost(..) => false,
        }
    }
}

/// A claim about footsteps.
#[derive(Clone, Debug, PartialEq)]
pub struct FootstepClaim {
    /// Legs of the footsteps.
    pub legs: LegChoice,
    /// Measure.
    pub measure: FootstepMeasure,
}

/// Legs of the footsteps.
#[derive(Clone, Debug, PartialEq)]
pub enum LegChoice {
    /// All legs of the scene.
    All,
    /// Legs in front of the centre of mass.
    Fore,
    /// Legs behind the centre of mass.
    Hind,
    /// Named legs.
    Named(Vec<Placed<String>>),
}

/// Measure of footsteps.
#[derive(Clone, Debug, PartialEq)]
pub enum FootstepMeasure {
    /// Greatest horizontal distance moved while in contact, of every footstep \[m\].
    Slip(Limits),
    /// Slip over the travel in stance, of every leg: stride length by stance share; both are sums
    /// over the footsteps but the last \[1\].
    SlipShare(Limits),
    /// Mean share of the cycle with the foot on the ground, of every leg; with touch-downs as marks
    /// from a touch-down to the lift-off before the next \[1\].
    DutyFactor(CycleMark, Limits),
    /// Touch-down to lift-off, of every footstep \[s\].
    StanceTime(Limits),
    /// Lift-off to the next touch-down, of every footstep but a leg's last \[s\].
    SwingTime(Limits),
    /// Mean rate of touch-downs, of every leg \[Hz\].
    Frequency(Limits),
    /// Horizontal distance between successive touch-downs of a leg, of every footstep but a leg's
    /// last \[m\].
    StrideLength(Limits),
    /// Impulse of the ground reaction, of every footstep \[N·s\].
    Impulse(Limits),
    /// Greatest load, of every footstep \[N\].
    PeakLoad(Limits),
    /// Coordinate of the touch-down, of every footstep \[m\].
    Position(Axis, Limits),
    /// Number of touch-downs, of every leg \[1\].
    Count(Limits),
    /// Mean number of contacts in a cycle, bounces included, of every leg \[1\].
    Contacts(Limits),
    /// Circular mean of each leg's phase in the cycle of the first leg, compared with a pattern.
    Phase {
        /// Mark of the cycles.
        by: CycleMark,
        /// Pattern.
        pattern: Pattern,
        /// Greatest deviation of any leg, as a share of the cycle.
        tolerance: f64,
    },
    /// Circular standard deviation of each leg's phase in the cycle of the first leg \[1, share of
    /// the cycle\].
    PhaseSpread(CycleMark, Limits),
    /// Cyclic order of touch-downs; legs of one group in any order. The measured value is the
    /// number of touch-downs out of order.
    Order(Vec<Vec<Placed<String>>>),
    /// Displacement of a footstep from the same footstep of the run without changes, by cycle
    /// \[m\].
    Displacement {
        /// Axis of the displacement.
        axis: Axis,
        /// Index of the footstep: 1 is the first that touches down after `after` (by default after
        /// the first change).
        cycle: u32,
        /// Its limits.
        limits: Limits,
    },
}

/// Mark by which the cycle of a leg is dated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CycleMark {
    /// Circular mean of the load; see [`crate::LoadCycle`].
    Load,
    /// First touch-down of a footstep.
    TouchDown,
}

impl Words for CycleMark {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("load", CycleMark::Load),
        ("touch-down", CycleMark::TouchDown),
    ];
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
    /// Distance in the horizontal plane.
    Horizontal,
}

impl Words for Axis {
    const WORDS: &'static [(&'static str, Self)] = &[
        ("x", Axis::X),
        ("y", Axis::Y),
        ("z", Axis::Z),
        ("horizontal", Axis::Horizontal),
    ];
}

/// A claim about a cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingClaim {
    /// Name of the bus; none for the cycle of the controller.
    pub of: Option<Placed<String>>,
    /// Measure.
    pub measure: TimingMeasure,
    /// Its limits.
    pub limits: Limits,
}

/// Measure of a cycle: an iteration of the controller, or a transfer of a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimingMeasure {
    /// Number of cycles that began late or were skipped \[1\].
    DeadlineMisses,
    /// Mean rate \[Hz\].
    CycleRate,
    /// Greatest deviation of the interval between two cycle starts from the period \[s\].
    Jitter,
    /// Greatest time from the start of a cycle to its end \[s\].
    Latency,
    /// Greatest interval between two cycle starts \[s\]; its inverse is the guaranteed rate.
    LongestCycle,
    /// Half of the difference of the longest and the shortest interval between two cycle starts
    /// \[s\].
    HalfRange,
}

/// A claim about one signal, or about all signals that match a pattern.
#[derive(Clone, Debug, PartialEq)]
pub struct SignalClaim {
    /// Name or pattern.
    pub name: Placed<String>,
    /// Element; none for all elements.
    pub component: Option<usize>,
    /// Unit of the limits.
    pub unit: Unit,
    /// Condition.
    pub mode: SignalMode,
}

/// Condition on a signal.
#[derive(Clone, Debug, PartialEq)]
pub enum SignalMode {
    /// Within limits in every observation.
    Always(Limits),
    /// Within limits in at least one observation, optionally within a time from the start of the
    /// window.
    Eventually(Limits, Option<SimDuration>),
    /// Within limits until a condition on another signal first holds, which must occur.
    Until(Limits, Condition),
    /// Settling: from `by` to the end of the window it stays within `within` of its last value.
    Settles {
        /// Tolerance, in the unit of the signal.
        within: f64,
        /// Time since the start of the run.
        by: SimTime,
    },
    /// Recovery from a disturbance, with a tolerance in the unit of the signal.
    Recovers(Recovery, f64),
}

/// Kind of a measured value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ValueKind {
    /// One number of the run.
    Single,
    /// Value of the leg, the footstep or the instant with the least margin.
    Extreme,
    /// A count, which has no numerical error.
    Count,
    /// Work or residual of the energy: a property of this very run, which another step changes.
    OfMethod,
}

impl ValueKind {
    /// Returns whether the value may have a numerical error.
    pub fn has_error(self) -> bool {
        matches!(self, Self::Single | Self::Extreme)
    }
}

/// Measure of the computational work of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CostMeasure {
    /// Work counter of the plant, by name: `steps`, `evaluations`, ….
    Count(&'static str),
    /// Simulated over wall-clock time; depends on the machine.
    RealTimeFactor,
}

impl Expectation {
    /// Returns the unit of the measured value. A fall may be measured as an angle instead.
    pub fn unit(&self) -> Unit {
        self.claim.unit()
    }

    /// Returns the time up to which a fall may change the measured value; none if any fall may. A
    /// footstep of the window may end after it, and energy and cost are of the whole run.
    pub fn changed_by_falls_before(&self) -> Option<SimTime> {
        match self.claim {
            Claim::Footstep(_) | Claim::Gait(_) | Claim::EnergyResidual(_) | Claim::Cost(..) => {
                None
            }
            Claim::Body(_)
            | Claim::Timing(_)
            | Claim::Signal(_)
            | Claim::Compare(_)
            | Claim::Sequence(_) => self.before,
        }
    }

    /// Returns whether the measured value is defined for runs in which the robot falls, by the time
    /// before the fall, so that such runs are compared by it.
    pub fn rates_falls(&self) -> bool {
        match &self.claim {
            Claim::Gait(claim) => claim.measure.includes_falls(),
            Claim::Footstep(_)
            | Claim::Body(_)
            | Claim::Timing(_)
            | Claim::Signal(_)
            | Claim::Compare(_)
            | Claim::Sequence(_)
            | Claim::EnergyResidual(_)
            | Claim::Cost(..) => false,
        }
    }

    /// Returns the kind of the measured value, on which its numerical error depends.
    pub fn value_kind(&self) -> ValueKind {
        match &self.claim {
            Claim::EnergyResidual(_) | Claim::Cost(..) => ValueKind::OfMethod,
            Claim::Timing(claim) if claim.measure == TimingMeasure::DeadlineMisses => {
                ValueKind::Count
            }
            Claim::Footstep(claim) => match claim.measure {
                FootstepMeasure::Count(_) | FootstepMeasure::Order(_) => ValueKind::Count,
                _ => ValueKind::Extreme,
            },
            Claim::Gait(_)
            | Claim::Compare(_)
            | Claim::Timing(_)
            | Claim::Body(BodyClaim::Limited(..)) => ValueKind::Single,
            Claim::Body(_) | Claim::Signal(_) | Claim::Sequence(_) => ValueKind::Extreme,
        }
    }

    /// Returns whether it compares with the run without changes.
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
    /// Returns the names of the work counters of a plant.
    pub fn counts() -> [&'static str; 6] {
        WorkCounts::default().named().map(|(name, _)| name)
    }
}

impl FootstepMeasure {
    /// Returns the unit of the measured value.
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
            FootstepMeasure::SlipShare(_)
            | FootstepMeasure::DutyFactor(..)
            | FootstepMeasure::Contacts(_)
            | FootstepMeasure::Count(_)
            | FootstepMeasure::Phase { .. }
            | FootstepMeasure::PhaseSpread(..)
            | FootstepMeasure::Order(_) => Unit::One,
        }
    }
}

impl TimingMeasure {
    /// Returns the possible values.
    pub(crate) const fn domain(self) -> Domain {
        match self {
            TimingMeasure::DeadlineMisses => Domain::COUNT,
            TimingMeasure::LongestCycle => Domain::POSITIVE,
            TimingMeasure::CycleRate
            | TimingMeasure::Jitter
            | TimingMeasure::Latency
            | TimingMeasure::HalfRange => Domain::NOT_NEGATIVE,
        }
    }

    /// Returns the unit of the measured value.
    pub const fn unit(self) -> Unit {
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

//! The controller `tegotae`: phases with feedback of the load, foot locus and inverse kinematics.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Stream, Unit, stream};
use twinrig_robot::Robot;
use twinrig_runtime::{LimitViolation, Process, ProcessVariable, VariableError};

use crate::leg_commands::{LegCommands, Saved};
use crate::limb::Limb;
use crate::load_signal::LoadSignal;
use crate::phases::Phases;
use crate::tegotae_rule::{MID_STANCE, advance, low_pass, wrap};
use crate::variables::{Variables, index};
use crate::{Abduction, FixedPoint, Gait, GaitError, StanceCurve};

/// Greatest load \[N\]: beyond any robot, and its square does not overflow.
const LOAD_MAX: f64 = 1e6;
/// Limits of the excitation \[rad/s\] and of the feedback \[rad/(N·s)\].
const RATE_MAX: f64 = 1000.0;

/// Gait controller with feedback of the load (thesis, section 3.3): each leg has an oscillator of
/// its own, which the load of this leg holds back; the body alone couples them.
///
/// ```text
/// θ̇ = ω − σF·cos(θ + x_c)        x_c = arcsin(ω/(σF)), at most ±π/2        eq. 3.7, 3.9
/// ```
///
/// θ is the phase of the locus ([`crate::FootLocus`]): swing is `[0, π)`, stance `[π, 2π)`, the
/// thesis' `[−π, 0)`. There is no duty map: the stance share results from load and excitation. A
/// leg with |σF| > |ω| stops at mid-stance. For σ < 0 mid-stance is unstable, and such a leg stops
/// at π/2 − 2·`x_c`; with |σF| ≤ |ω| the sign of σ has no effect. [`FixedPoint::Plain`] has
/// `x_c` = 0.
///
/// Inputs: the load \[N\] of each selected leg, by default `leg/X/foot/load`
/// ([`Tegotae::with_load`]). A negative or infinite load, and NaN, are no load. Then those of
/// [`Abduction::Capture`], as of [`crate::Cpg`], of which the outputs are, too.
///
/// # Process variables
///
/// | name | unit | range | thesis |
/// |---|---|---|---|
/// | `excitation` | rad/s | −1000 to 1000 | ω |
/// | `feedback` | rad/(N·s) | −1000 to 1000 | σ |
/// | `load_lag` | s | ≥ 0 | –, time constant of a low-pass filter of the load; 0 for none |
/// | `phase_noise` | rad | 0 to 100 | –, standard deviation that a second adds to the phase |
///
/// and `step_length`, `step_length_offset/X`, `ramp`, `crouch`, `splay`, `turn`, `sidestep`,
/// `lateral_offset/X`, `dead_band`, `lead`, `capture` and the variables of the foot locus as of
/// [`crate::Cpg`]. A change takes effect at the next step.
///
/// The load at an iteration counts for the whole time since the one before, over which θ is exact.
/// The phase noise is a Wiener process, with a random stream for each leg.
///
/// ```
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// use twinrig_gait::{Gait, Tegotae, TegotaeStart};
/// use twinrig_kernel::SimDuration;
/// use twinrig_runtime::Process;
///
/// # let robot = twinrig_robot::Robot::example();
/// let legs = ["LF", "RF", "LH", "RH"];
/// let mut tegotae = Tegotae::new(&robot, &legs, Gait::Trot, 1)?;
/// let mut commands = [0.0; 8];
/// tegotae.step(SimDuration::ZERO, &[0.0; 4], &mut commands);
/// tegotae.step(SimDuration::from_millis(2), &[0.0, 3.0, 3.0, 0.0], &mut commands);
/// assert_eq!(commands[0..2], commands[6..8]); // LF and RH have the same phase and load
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Tegotae {
    legs: LegCommands,
    of_phases: PhaseVariables,
    rule: FixedPoint,
    load: LoadSignal,
    seed: u64,
    state: State,
}

/// Initial phases of [`Tegotae`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TegotaeStart {
    /// Those of the gait.
    #[default]
    InStep,
    /// Random, with a random stream for each leg.
    Random,
    /// All legs at mid-stance: a robot that stands.
    MidStance,
}

impl TegotaeStart {
    /// All starts.
    pub const ALL: [Self; 3] = [Self::InStep, Self::Random, Self::MidStance];

    /// Name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::InStep => "in-step",
            Self::Random => "random",
            Self::MidStance => "mid-stance",
        }
    }
}

/// Indices of the variables of the phases.
#[derive(Debug, Clone, Copy)]
struct PhaseVariables {
    excitation: usize,
    feedback: usize,
    load_lag: usize,
    phase_noise: usize,
}

impl PhaseVariables {
    fn declare() -> Variables {
        let mut variables = Variables::default();
        let mut add = |name, unit, range, default| {
            variables.add(ProcessVariable::new(name, unit, range, default));
        };
        let any = -RATE_MAX..=RATE_MAX;
        add("excitation", Unit::RadianPerSecond, any.clone(), 6.0 * PI);
        add("feedback", Unit::RadianPerNewtonSecond, any, 0.3);
        add("load_lag", Unit::Second, 0.0..=1000.0, 0.0);
        add("phase_noise", Unit::Radian, 0.0..=100.0, 0.0);
        variables
    }

    /// Finds the variables in a list that has them.
    fn of(variables: &[ProcessVariable]) -> Self {
        let index = |name| index(variables, name);
        Self {
            excitation: index("excitation"),
            feedback: index("feedback"),
            load_lag: index("load_lag"),
            phase_noise: index("phase_noise"),
        }
    }
}

/// State of the controller besides that of the commands, for every leg of the robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct State {
    /// θ in `[0, 2π)` \[rad\].
    phases: Vec<f64>,
    /// Filtered loads \[N\].
    loads: Vec<f64>,
    noise: Vec<Stream>,
}

impl State {
    /// Whether a snapshot is of `count` legs, with values that this controller can have.
    fn is_valid(&self, count: usize) -> bool {
        let lengths = [self.phases.len(), self.loads.len(), self.noise.len()];
        lengths == [count; 3]
            && self.phases.iter().all(|phase| (0.0..TAU).contains(phase))
            && self
                .loads
                .iter()
                .all(|load| (0.0..=LOAD_MAX).contains(load))
    }
}

/// The phases of a step.
struct TegotaePhases<'a> {
    phases: &'a [f64],
    excitation: f64,
}

impl Phases for TegotaePhases<'_> {
    #[inline]
    fn phase(&self, leg: usize, _end: usize) -> f64 {
        self.phases[leg]
    }

    fn phase_after(&self, leg: usize, _end: usize, seconds: f64) -> f64 {
        let phase = self.phases[leg] + self.excitation * seconds;
        phase - TAU * libm::floor(phase / TAU)
    }

    fn turn(&self, leg: usize) -> f64 {
        self.phases[leg] / TAU
    }

    fn frequency(&self) -> f64 {
        self.excitation / TAU
    }

    /// Without load; under load stance takes longer.
    fn stance_share(&self, _end: usize) -> f64 {
        0.5
    }
}

impl Tegotae {
    /// Name in scenarios.
    pub const NAME: &'static str = "tegotae";

    /// Creates a controller for `legs` of `robot` that starts with the phases of `gait`; `seed` is
    /// that of the run. The defaults of the variables are a moderate gait, scaled to the length of
    /// the legs.
    ///
    /// # Errors
    /// An unknown leg, or a leg with an impossible geometry.
    pub fn new(robot: &Robot, legs: &[&str], gait: Gait, seed: u64) -> Result<Self, GaitError> {
        let limbs = Limb::of_robot(robot, legs)?;
        let stream = |limb: &Limb| stream(seed, &format!("controller/tegotae/noise/{}", limb.name));
        let phase = |limb: &Limb| wrap(gait.phase_difference(limb.corner));
        let state = State {
            phases: limbs.iter().map(phase).collect(),
            loads: vec![0.0; limbs.len()],
            noise: limbs.iter().map(stream).collect(),
        };
        let legs = LegCommands::new(limbs, PhaseVariables::declare())?;
        Ok(Self {
            of_phases: PhaseVariables::of(legs.variables()),
            legs,
            rule: FixedPoint::default(),
            load: LoadSignal::default(),
            seed,
            state,
        })
    }

    /// The process variables of a controller for `robot`, at their defaults.
    ///
    /// # Errors
    /// A leg whose geometry is impossible.
    pub fn variables_of(robot: &Robot) -> Result<Vec<ProcessVariable>, GaitError> {
        Ok(Self::new(robot, &[], Gait::default(), 0)?
            .variables()
            .to_vec())
    }

    /// Sets the rule of the fixed point.
    #[must_use]
    pub fn with_fixed_point(mut self, rule: FixedPoint) -> Self {
        self.rule = rule;
        self
    }

    /// Sets the initial phases; [`TegotaeStart::InStep`] keeps those of the gait.
    #[must_use]
    pub fn with_start(mut self, start: TegotaeStart) -> Self {
        for (limb, phase) in self.legs.limbs.iter().zip(&mut self.state.phases) {
            *phase = match start {
                TegotaeStart::InStep => *phase,
                TegotaeStart::Random => {
                    let name = format!("controller/tegotae/phase/{}", limb.name);
                    wrap(TAU * stream(self.seed, &name).unit())
                }
                TegotaeStart::MidStance => MID_STANCE,
            };
        }
        self
    }

    /// Reads the load of each leg from the signal of this name, in which `*` stands for the name of
    /// the leg; of a signal with three components, from that of the given index.
    ///
    /// # Errors
    /// A name without `*` for several legs, or a component above 2.
    pub fn with_load(mut self, name: &str, component: Option<usize>) -> Result<Self, GaitError> {
        let legs = self.legs.active().count();
        self.load = LoadSignal::new(name, component, legs)?;
        Ok(self)
    }

    /// Sets the curve of the feet in stance.
    #[must_use]
    pub fn with_stance(mut self, stance: StanceCurve) -> Self {
        self.legs.set_stance_curve(stance);
        self
    }

    /// Enables abduction commands.
    ///
    /// # Errors
    /// As [`crate::Cpg::with_abduction`].
    pub fn with_abduction(mut self, abduction: Abduction) -> Result<Self, GaitError> {
        self.legs.enable_abduction(abduction)?;
        Ok(self)
    }

    /// Enables the output of the phases θ in `[0, 2π)`: swing below π, then stance.
    #[must_use]
    pub fn with_phase_output(mut self) -> Self {
        self.legs.enable_phase_output();
        self
    }

    /// Enables the output of the distance of each leg's target from its reach, zero within it.
    #[must_use]
    pub fn with_reach_output(mut self) -> Self {
        self.legs.enable_reach_output();
        self
    }

    /// Enables the output of the mean phase rate of a leg over its last cycle, for a filter that
    /// requires the frequency of its load; before the first cycle it is that of the excitation.
    ///
    /// # Errors
    /// If there is no such leg.
    pub fn with_frequency_of(mut self, leg: &str) -> Result<Self, GaitError> {
        self.legs.enable_frequency_of(leg)?;
        Ok(self)
    }

    /// Number of targets out of reach since the start, one per leg and step.
    pub fn out_of_reach(&self) -> u64 {
        self.legs.out_of_reach()
    }

    /// Phase θ in `[0, 2π)` of the leg with index `leg` in the robot.
    pub fn phase(&self, leg: usize) -> f64 {
        self.state.phases[leg]
    }

    /// Advances the phases of the selected legs by `seconds` under the loads of `inputs`.
    fn advance(&mut self, seconds: f64, excitation: f64, inputs: &[f64]) {
        let [feedback, lag, noise] = [
            self.of_phases.feedback,
            self.of_phases.load_lag,
            self.of_phases.phase_noise,
        ]
        .map(|index| self.legs.value(index));
        let deviation = noise * seconds.sqrt();
        for ((leg, _), input) in self.legs.active().zip(self.load.values(inputs)) {
            let State {
                phases,
                loads,
                noise,
            } = &mut self.state;
            // A plant of another program may report anything.
            let load = if input.is_finite() { input } else { 0.0 };
            let load = low_pass(loads[leg], load.clamp(0.0, LOAD_MAX), lag, seconds);
            let load = load.clamp(0.0, LOAD_MAX);
            let force = feedback * load;
            let phase = advance(self.rule, phases[leg], excitation, force, seconds);
            phases[leg] = if deviation > 0.0 {
                wrap(phase + deviation * noise[leg].normal())
            } else {
                phase
            };
            loads[leg] = load;
        }
    }
}

impl Process for Tegotae {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn ports(&self) -> Vec<Port> {
        let loads = self
            .legs
            .active()
            .map(|(_, limb)| self.load.port(&limb.name));
        let inputs = loads.chain(self.legs.inputs());
        inputs.chain(self.legs.outputs()).collect()
    }

    fn is_monitor(&self, output: &str) -> bool {
        LegCommands::is_monitor(output)
    }

    fn limit_violations(&self) -> Vec<LimitViolation> {
        self.legs.limit_violations()
    }

    fn variables(&self) -> &[ProcessVariable] {
        self.legs.variables()
    }

    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        self.legs.set_variable(index, value, |_| Ok(()))
    }

    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        let seconds = elapsed.as_secs_f64();
        let excitation = self.legs.value(self.of_phases.excitation);
        let (loads, of_trunk) = inputs.split_at(inputs.len() - self.legs.input_count());
        self.advance(seconds, excitation, loads);
        let phases = TegotaePhases {
            phases: &self.state.phases,
            excitation,
        };
        self.legs.step(seconds, &phases, of_trunk, outputs);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.legs.save(), &self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (saved, state): (Saved, State) = snapshot.read()?;
        if !state.is_valid(self.legs.limbs.len()) {
            let found = format!("phases and loads of {} legs", state.phases.len());
            return Err(self.legs.mismatch(found));
        }
        self.legs.restore(saved, |_| Ok(()))?;
        self.state = state;
        Ok(())
    }
}

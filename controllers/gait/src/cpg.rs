//! The controller `cpg`: oscillators, duty map, foot locus and inverse kinematics in series.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit, signal, stream};
use twinrig_robot::Robot;
use twinrig_runtime::{Process, ProcessVariable, VariableError};

use crate::limb::Limb;
use crate::phase_meter::PhaseMeter;
use crate::variables::{self, COUPLING, CROUCH, FREQUENCY, PHASE_DIFFERENCES, RAMP, STEP_LENGTH};
use crate::{Abduction, DutyMap, FootLocus, Gait, GaitError, Oscillators};

/// Open-loop gait controller of the thesis, section 3.2: coupled oscillators → duty map → foot
/// locus → inverse kinematics, for every leg.
///
/// No inputs; outputs `leg/X/hip/command` and `leg/X/knee/command` \[rad\] for the selected legs,
/// then, with [`Cpg::with_abduction`], `leg/X/abduction/command` \[rad\] for each of these, then,
/// with [`Cpg::with_frequency_of`], `leg/X/frequency` \[Hz\] for one leg. All legs of the robot
/// have an oscillator whether commanded or not, so the selection does not affect the commands of
/// the others.
///
/// # Process variables
///
/// | name | unit | range | thesis, table 3.3 |
/// |---|---|---|---|
/// | `frequency` | Hz | all | ω = 2πf, all |
/// | `step_length` | m | ≥ 0 | L, ≥ 0 |
/// | `hip_height/fore`, `/hind` | m | above 0, to the leg's length | H, above h (1) |
/// | `step_height/…` | m | 0 to the leg's length | h, 0 to H |
/// | `mid_stance_offset/…` | m | all | `x_o`, ≥ 0 (2) |
/// | `duty_factor/…` | 1 | between 0 and 1 | d, the same |
/// | `touch_down_angle/…` | rad | 0.05 to π − 0.05 | `θ_td`, 0 to π (3) |
/// | `take_off_angle/…` | rad | 0.05 to π − 0.05 | `θ_to`, 0 to π (3) |
/// | `compression/…` | 1 | 0 to 1 | c, between 0 and 1 (4) |
/// | `phase_difference/X` | rad | −π to π | ψ, phase of leg X relative to the common phase |
/// | `coupling` | rad/s | 0 to 1000 | w of eq. 3.2 |
/// | `ramp` | s | ≥ 0 | –, duration of the step length's rise from 0 after the start |
/// | `crouch` | m | ≥ 0 | –, initial reduction of the hip height, removed over the ramp |
/// | `splay` | rad | −π/2 to π/2 | –, angle of abduction ([`Abduction`]) |
///
/// 1. A foot above the hip is out of reach in any case.
/// 2. Wider here, since gaits with negative offsets run well.
/// 3. At both limits of the thesis tan(θ − π/2) diverges.
/// 4. Here the limits are harmless.
///
/// A change takes full effect at the next step: the target jumps with the locus, as in the thesis'
/// experiment on step length. Only a phase difference sets in gradually, through the coupling.
///
/// At frequency 0 the feet stay at their phase; at step length 0 the robot steps in place. For
/// standing on four feet there is [`crate::Stand`].
///
/// A target out of the leg's reach is replaced by the nearest point within it, and counted
/// ([`Cpg::out_of_reach`]); outputs are always finite.
///
/// ```
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// use twinrig_gait::{Cpg, Gait};
/// use twinrig_kernel::SimDuration;
/// use twinrig_runtime::Process;
///
/// # let robot = twinrig_robot::Robot::example();
/// let mut cpg = Cpg::new(&robot, &["LF", "RF", "LH", "RH"], Gait::Trot)?;
/// let mut commands = [0.0; 8];
/// cpg.step(SimDuration::ZERO, &[], &mut commands);
/// cpg.step(SimDuration::from_millis(2), &[], &mut commands);
/// assert_eq!(commands[0..2], commands[6..8]); // LF and RH move together
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Cpg {
    limbs: Vec<Limb>,
    variables: Vec<ProcessVariable>,
    /// Locus and duty map of the fore and of the hind legs, derived from the variables.
    ends: [(FootLocus, DutyMap); 2],
    abduction: Abduction,
    /// Leg whose mean phase rate is an output.
    metered: Option<usize>,
    state: State,
}

/// State of the controller without its variables.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct State {
    oscillators: Oscillators,
    /// Time since the start \[s\].
    age: f64,
    /// Last commands of every leg \[rad\].
    commands: Vec<[f64; 2]>,
    out_of_reach: u64,
    meter: PhaseMeter,
}

impl Cpg {
    /// Name in scenarios.
    pub const NAME: &'static str = "cpg";

    /// Creates a controller for `legs` of `robot`, locked to `gait` from the start. The defaults of
    /// the variables are a moderate trot, scaled to the length of the legs.
    ///
    /// # Errors
    /// An unknown leg, or a leg with an impossible geometry.
    pub fn new(robot: &Robot, legs: &[&str], gait: Gait) -> Result<Self, GaitError> {
        let limbs = Limb::of_robot(robot, legs)?;
        let phases = phases(&limbs, gait);
        let variables = declare(&limbs, &phases);
        let state = State {
            oscillators: Oscillators::locked(&phases),
            age: 0.0,
            commands: vec![[0.0; 2]; limbs.len()],
            out_of_reach: 0,
            meter: PhaseMeter::default(),
        };
        Ok(Self {
            ends: derive(&variables)?,
            limbs,
            variables,
            abduction: Abduction::None,
            metered: None,
            state,
        })
    }

    /// The process variables of a controller for `robot`, at their defaults.
    ///
    /// # Errors
    /// A leg whose geometry is impossible.
    pub fn variables_of(robot: &Robot, gait: Gait) -> Result<Vec<ProcessVariable>, GaitError> {
        let limbs = Limb::of_robot(robot, &[])?;
        Ok(declare(&limbs, &phases(&limbs, gait)))
    }

    /// Enables abduction commands.
    #[must_use]
    pub fn with_abduction(mut self, abduction: Abduction) -> Self {
        self.abduction = abduction;
        self
    }

    /// Enables the output of the mean phase rate of a leg over its last cycle, for a filter that
    /// requires the frequency of its load; before the first cycle it is the variable `frequency`.
    ///
    /// # Errors
    /// If there is no such leg.
    pub fn with_frequency_of(mut self, leg: &str) -> Result<Self, GaitError> {
        self.metered = Some(Limb::find(&self.limbs, leg)?);
        Ok(self)
    }

    /// Starts every leg at a random phase instead of the gait's. Each leg has its own random
    /// stream.
    #[must_use]
    pub fn with_random_phases(mut self, seed: u64) -> Self {
        for (leg, limb) in self.limbs.iter().enumerate() {
            let turn = stream(seed, &format!("controller/cpg/phase/{}", limb.name)).unit();
            self.state.oscillators.push(leg, PI * (2.0 * turn - 1.0));
        }
        self
    }

    /// Number of targets out of reach since the start, one per leg and step.
    pub fn out_of_reach(&self) -> u64 {
        self.state.out_of_reach
    }

    /// Phase Θ in `[0, 2π]` of the locus of the leg with index `leg` in the robot.
    pub fn phase(&self, leg: usize) -> f64 {
        let (_, duty) = &self.ends[self.limbs[leg].corner.end()];
        duty.phase(self.state.oscillators.turn(leg))
    }

    /// Fraction of the ramp, 0 to 1.
    fn ramp_fraction(&self) -> f64 {
        let ramp = self.variables[RAMP].value();
        if self.state.age < ramp {
            self.state.age / ramp
        } else {
            1.0
        }
    }
}

/// Lengths of the extended fore and hind legs; equal if the robot has only one of these.
pub(crate) fn lengths_max(limbs: &[Limb]) -> [f64; 2] {
    let of = |fore: bool| {
        limbs
            .iter()
            .find(|limb| limb.corner.fore == fore)
            .map(Limb::length_max)
    };
    let fore = of(true).or(of(false)).unwrap_or(1.0);
    [fore, of(false).unwrap_or(fore)]
}

fn phases(limbs: &[Limb], gait: Gait) -> Vec<f64> {
    let phase = |limb: &Limb| gait.phase_difference(limb.corner);
    limbs.iter().map(phase).collect()
}

fn declare(limbs: &[Limb], phases: &[f64]) -> Vec<ProcessVariable> {
    let names = limbs.iter().map(|limb| limb.name.as_str());
    let named: Vec<(&str, f64)> = names.zip(phases.iter().copied()).collect();
    variables::declare(lengths_max(limbs), &named)
}

fn derive(variables: &[ProcessVariable]) -> Result<[(FootLocus, DutyMap); 2], GaitError> {
    let end = |end: usize| -> Result<_, GaitError> {
        let locus = FootLocus::new(&variables::shape(variables, end))?;
        Ok((locus, DutyMap::new(variables::duty_factor(variables, end))?))
    };
    Ok([end(0)?, end(1)?])
}

impl Process for Cpg {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn ports(&self) -> Vec<Port> {
        let active = self.limbs.iter().filter(|limb| limb.active);
        let abducted = self.abduction.of(&self.limbs);
        active
            .flat_map(Limb::ports)
            .chain(abducted.map(|limb| limb.port("abduction")))
            .chain(self.metered.map(|leg| {
                let name = signal::of_leg(&self.limbs[leg].name, "frequency");
                Port::output(name, Unit::Hertz, 1)
            }))
            .collect()
    }

    fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    fn set_variable(&mut self, index: usize, value: f64) -> Result<(), VariableError> {
        let count = self.variables.len();
        let splay = variables::splay(&self.variables);
        let variable = self
            .variables
            .get_mut(index)
            .ok_or(VariableError::NoSuchIndex { index, count })?;
        if index == splay {
            self.abduction.check(variable, value)?;
            return variable.set(value);
        }
        let before = variable.value();
        variable.set(value)?;
        match derive(&self.variables) {
            Ok(ends) => self.ends = ends,
            Err(error) => {
                let variable = &mut self.variables[index];
                let name = variable.name().to_owned();
                variable.set(before)?;
                return Err(VariableError::Refused {
                    name,
                    value,
                    why: error.to_string(),
                });
            }
        }
        if let Some(leg) = index.checked_sub(PHASE_DIFFERENCES) {
            self.state.oscillators.set_difference(leg, value);
        }
        Ok(())
    }

    fn step(&mut self, elapsed: SimDuration, _inputs: &[f64], outputs: &mut [f64]) {
        let seconds = elapsed.as_secs_f64();
        self.state.age += seconds;
        let [frequency, coupling] =
            [FREQUENCY, COUPLING].map(|index| self.variables[index].value());
        self.state.oscillators.advance(seconds, frequency, coupling);

        let ramp_fraction = self.ramp_fraction();
        let ramped;
        let ends = if ramp_fraction < 1.0 {
            let step_length = ramp_fraction * self.variables[STEP_LENGTH].value();
            let crouch = (1.0 - ramp_fraction) * self.variables[CROUCH].value();
            ramped = self.ends.map(|(locus, duty)| {
                let locus = locus.with_step_length(step_length);
                (locus.with_lowered_hip(crouch), duty)
            });
            &ramped
        } else {
            &self.ends
        };
        let State {
            oscillators,
            commands,
            out_of_reach,
            ..
        } = &mut self.state;
        let active = self
            .limbs
            .iter()
            .zip(commands)
            .enumerate()
            .filter(|(_, (limb, _))| limb.active);
        for ((leg, (limb, command)), output) in active.zip(outputs.chunks_exact_mut(2)) {
            let (locus, duty) = &ends[limb.corner.end()];
            let target = locus.point(duty.phase(oscillators.turn(leg)));
            let outside;
            (*command, outside) = limb.command(target);
            *out_of_reach += u64::from(outside);
            output.copy_from_slice(command);
        }
        if self.abduction != Abduction::None {
            let active = self.limbs.iter().filter(|limb| limb.active).count();
            let splay = self.variables[variables::splay(&self.variables)].value();
            let abductions = &mut outputs[2 * active..3 * active];
            self.abduction.command(&self.limbs, splay, abductions);
        }
        if let (Some(leg), Some(output)) = (self.metered, outputs.last_mut()) {
            let turn = self.state.oscillators.turn(leg);
            self.state.meter.step(seconds, turn);
            *output = self.state.meter.frequency().unwrap_or(frequency);
        }
    }

    fn save(&self) -> Snapshot {
        let values: Vec<f64> = self.variables.iter().map(ProcessVariable::value).collect();
        Snapshot::of(&(values, &self.state))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (values, state): (Vec<f64>, State) = snapshot.read()?;
        let mismatch = |found: String| SnapshotError::Mismatch {
            expected: format!("a gait of {} legs", self.limbs.len()),
            found,
        };
        let legs = state.commands.len();
        if values.len() != self.variables.len()
            || legs != self.limbs.len()
            || !state.oscillators.has_legs(legs)
        {
            return Err(mismatch(format!("a gait of {legs} legs")));
        }
        let mut variables = self.variables.clone();
        for (variable, value) in variables.iter_mut().zip(values) {
            variable
                .set(value)
                .map_err(|error| mismatch(error.to_string()))?;
        }
        self.ends = derive(&variables).map_err(|error| mismatch(error.to_string()))?;
        self.variables = variables;
        self.state = state;
        Ok(())
    }
}

//! The controller `cpg`: oscillators, duty map, foot locus and inverse kinematics in series.

use std::f64::consts::PI;

use twinrig_kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit, stream};
use twinrig_robot::Robot;
use twinrig_runtime::{Bound, LimitViolation, Process, ProcessVariable, VariableError};

use crate::leg_commands::{LegCommands, Saved};
use crate::limb::Limb;
use crate::phases::Phases;
use crate::variables::{Variables, index};
use crate::{Abduction, DutyMap, DutyRule, Gait, GaitError, Oscillators, StanceCurve};

/// Open-loop gait controller of the thesis, section 3.2: coupled oscillators → duty map → foot
/// locus → inverse kinematics, for every leg.
///
/// No inputs but those of [`Abduction::Capture`], `body/velocity` and `body/rpy`; outputs
/// `leg/X/hip/command` and `leg/X/knee/command` \[rad\] for the selected legs, then, with
/// [`Cpg::with_abduction`], `leg/X/abduction/command` \[rad\] for each of these, then, with
/// [`Cpg::with_phase_output`], `leg/X/phase` \[rad\] for each of these, then, with
/// [`Cpg::with_frequency_of`], `leg/X/frequency` \[Hz\] for one leg. All legs of the robot have an
/// oscillator whether commanded or not, so the selection does not affect the commands of the
/// others.
///
/// # Process variables
///
/// | name | unit | range | thesis, table 3.3 |
/// |---|---|---|---|
/// | `frequency` | Hz | ≥ 0 | ω = 2πf, all |
/// | `step_length` | m | ≥ 0 | L, ≥ 0 |
/// | `step_length_offset/X` | m | to two lengths of a leg | –, added to L for leg X (5) |
/// | `hip_height/fore`, `/hind` | m | the leg's reach | H, above h (1) |
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
/// | `turn` | rad/s | −π/2 to π/2 | –, rate of yaw, positive to the left (6) |
/// | `sidestep` | m/s | to a length of a leg a second | –, velocity to the left (6) |
/// | `lateral_offset/X` | m | to the leg's length | –, place of the foot to the left (6) |
/// | `dead_band` | rad | 0 to 0.2 | –, half-width of that of the servos of abduction (6) (7) |
/// | `lead` | s | 0 to 0.2 | –, time by which commands of abduction are ahead of the phase (6) |
/// | `capture` | s | 0 to 1 | –, shift of a step to the side over the velocity of the trunk (8) |
///
/// 1. A hip that is lower than the shortest leg is out of reach.
/// 2. Wider here, since gaits with negative offsets run well.
/// 3. At both limits of the thesis tan(θ − π/2) diverges.
/// 4. Here the limits are harmless.
/// 5. A sum below 0 counts as 0.
/// 6. With [`Abduction::Steer`] and [`Abduction::Capture`].
/// 7. Commands are ahead of the motion by it: a servo stops at its border.
/// 8. With [`Abduction::Capture`].
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
    legs: LegCommands,
    of_phases: PhaseVariables,
    /// Duty maps of the fore and of the hind legs, derived from the variables.
    duty: [DutyMap; 2],
    duty_rule: DutyRule,
    /// State of the controller besides that of the commands.
    oscillators: Oscillators,
}

/// Indices of the variables of the phases.
#[derive(Debug, Clone, Copy)]
struct PhaseVariables {
    frequency: usize,
    coupling: usize,
    /// Of the fore legs; that of the hind legs follows.
    duty_factor: usize,
    /// Of the first leg; the others follow in the robot's order.
    differences: usize,
}

impl PhaseVariables {
    /// Declares the variables of legs with these phase differences \[rad\].
    fn declare(limbs: &[Limb], phases: &[f64]) -> Variables {
        let mut variables = Variables::default();
        let rate = Unit::RadianPerSecond;
        variables.add(ProcessVariable::new("frequency", Unit::Hertz, 0.0.., 3.0));
        variables.add(ProcessVariable::new("coupling", rate, 0.0..=1000.0, 2.5));
        let open = (Bound::Excluded(0.0), Bound::Excluded(1.0));
        variables.add_pair("duty_factor", |name, _| {
            ProcessVariable::new(name, Unit::One, open, 0.55)
        });
        for (limb, &phase) in limbs.iter().zip(phases) {
            let name = format!("phase_difference/{}", limb.name);
            variables.add(ProcessVariable::new(name, Unit::Radian, -PI..=PI, phase));
        }
        variables
    }

    /// Finds the variables in a list that has them.
    fn of(variables: &[ProcessVariable]) -> Self {
        let index = |name| index(variables, name);
        Self {
            frequency: index("frequency"),
            coupling: index("coupling"),
            duty_factor: index("duty_factor"),
            differences: index("phase_difference"),
        }
    }

    /// Duty maps of the fore and of the hind legs.
    fn duty_maps(
        self,
        rule: DutyRule,
        variables: &[ProcessVariable],
    ) -> Result<[DutyMap; 2], GaitError> {
        let map = |end: usize| DutyMap::with_rule(rule, variables[self.duty_factor + end].value());
        Ok([map(0)?, map(1)?])
    }
}

/// Phases of the oscillators through the duty maps.
struct CpgPhases<'a> {
    oscillators: &'a Oscillators,
    duty: &'a [DutyMap; 2],
    frequency: f64,
}

impl Phases for CpgPhases<'_> {
    #[inline]
    fn phase(&self, leg: usize, end: usize) -> f64 {
        self.duty[end].phase(self.oscillators.turn(leg))
    }

    fn phase_after(&self, leg: usize, end: usize, seconds: f64) -> f64 {
        let turn = self.oscillators.turn(leg) + self.frequency * seconds;
        self.duty[end].phase(turn - libm::floor(turn))
    }

    fn turn(&self, leg: usize) -> f64 {
        self.oscillators.turn(leg)
    }

    fn frequency(&self) -> f64 {
        self.frequency
    }

    fn stance_share(&self, end: usize) -> f64 {
        self.duty[end].stance_share()
    }
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
        let phase = |limb: &Limb| gait.phase_difference(limb.corner);
        let phases: Vec<f64> = limbs.iter().map(phase).collect();
        let variables = PhaseVariables::declare(&limbs, &phases);
        let legs = LegCommands::new(limbs, variables)?;
        let of_phases = PhaseVariables::of(legs.variables());
        Ok(Self {
            duty: of_phases.duty_maps(DutyRule::default(), legs.variables())?,
            duty_rule: DutyRule::default(),
            legs,
            of_phases,
            oscillators: Oscillators::locked(&phases),
        })
    }

    /// The process variables of a controller for `robot`, at their defaults.
    ///
    /// # Errors
    /// A leg whose geometry is impossible.
    pub fn variables_of(robot: &Robot, gait: Gait) -> Result<Vec<ProcessVariable>, GaitError> {
        Ok(Self::new(robot, &[], gait)?.variables().to_vec())
    }

    /// Sets the curve of the feet in stance.
    #[must_use]
    pub fn with_stance(mut self, stance: StanceCurve) -> Self {
        self.legs.set_stance_curve(stance);
        self
    }

    /// Sets the stance share that a duty factor means.
    ///
    /// # Errors
    /// A duty factor so close to its limits that a share vanishes in `f64`.
    pub fn with_duty_rule(mut self, rule: DutyRule) -> Result<Self, GaitError> {
        self.duty = self.of_phases.duty_maps(rule, self.legs.variables())?;
        self.duty_rule = rule;
        Ok(self)
    }

    /// Enables abduction commands.
    ///
    /// # Errors
    /// [`Abduction::Steer`] or [`Abduction::Capture`] of a leg without a joint of abduction.
    pub fn with_abduction(mut self, abduction: Abduction) -> Result<Self, GaitError> {
        self.legs.enable_abduction(abduction)?;
        Ok(self)
    }

    /// Enables the output of the phases Θ in `[0, 2π)` of the loci: swing below π, then stance.
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
    /// requires the frequency of its load; before the first cycle it is the variable `frequency`.
    ///
    /// # Errors
    /// If there is no such leg.
    pub fn with_frequency_of(mut self, leg: &str) -> Result<Self, GaitError> {
        self.legs.enable_frequency_of(leg)?;
        Ok(self)
    }

    /// Starts every leg at a random phase instead of the gait's. Each leg has its own random
    /// stream.
    #[must_use]
    pub fn with_random_phases(mut self, seed: u64) -> Self {
        for (leg, limb) in self.legs.limbs.iter().enumerate() {
            let turn = stream(seed, &format!("controller/cpg/phase/{}", limb.name)).unit();
            self.oscillators.push(leg, PI * (2.0 * turn - 1.0));
        }
        self
    }

    /// Number of targets out of reach since the start, one per leg and step.
    pub fn out_of_reach(&self) -> u64 {
        self.legs.out_of_reach()
    }

    /// Number of outputs, each with one value.
    pub(crate) fn output_count(&self) -> usize {
        self.legs.outputs().count()
    }

    /// Phase Θ in `[0, 2π]` of the locus of the leg with index `leg` in the robot.
    pub fn phase(&self, leg: usize) -> f64 {
        let end = self.legs.limbs[leg].corner.end();
        self.duty[end].phase(self.oscillators.turn(leg))
    }
}

impl Process for Cpg {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn ports(&self) -> Vec<Port> {
        self.legs.inputs().chain(self.legs.outputs()).collect()
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
        let (of_phases, rule) = (self.of_phases, self.duty_rule);
        let derive = |variables: &[ProcessVariable]| of_phases.duty_maps(rule, variables);
        self.duty = self.legs.set_variable(index, value, derive)?;
        let leg = index.checked_sub(of_phases.differences);
        if let Some(leg) = leg.filter(|&leg| leg < self.legs.limbs.len()) {
            self.oscillators.set_difference(leg, value);
        }
        Ok(())
    }

    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        let seconds = elapsed.as_secs_f64();
        let PhaseVariables {
            frequency,
            coupling,
            ..
        } = self.of_phases;
        let [frequency, coupling] = [frequency, coupling].map(|index| self.legs.value(index));
        self.oscillators.advance(seconds, frequency, coupling);
        let phases = CpgPhases {
            oscillators: &self.oscillators,
            duty: &self.duty,
            frequency,
        };
        self.legs.step(seconds, &phases, inputs, outputs);
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.legs.save(), &self.oscillators))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let (saved, oscillators): (Saved, Oscillators) = snapshot.read()?;
        if !oscillators.has_legs(self.legs.limbs.len()) {
            let found = format!("one of {} oscillators", oscillators.len());
            return Err(self.legs.mismatch(found));
        }
        let (of_phases, rule) = (self.of_phases, self.duty_rule);
        let derive = |variables: &[ProcessVariable]| of_phases.duty_maps(rule, variables);
        self.duty = self.legs.restore(saved, derive)?;
        self.oscillators = oscillators;
        Ok(())
    }
}

//! From the phases of the legs to the commands of their drives.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Port, SimDuration, SimTime, SnapshotError, Unit, signal};
use twinrig_runtime::{Limit, LimitViolation, ProcessVariable, VariableError};

use crate::capture::{self, Shift};
use crate::limb::Limb;
use crate::phase_meter::PhaseMeter;
use crate::phases::Phases;
use crate::steering::LateralPlace;
use crate::variables::{LocusVariables, Variables};
use crate::{Abduction, FootLocus, GaitError, StanceCurve};

/// Last parts of the names of outputs that are no commands.
const PHASE: &str = "phase";
const FREQUENCY: &str = "frequency";
const OUT_OF_REACH: &str = "out_of_reach";

/// Part that all gait controllers have in common: ramp, foot locus and inverse kinematics of every
/// leg, and the outputs. The controllers differ in the phases only.
///
/// It holds all variables of the controller, those of its phases included.
#[derive(Debug, Clone)]
pub(crate) struct LegCommands {
    pub limbs: Vec<Limb>,
    variables: Vec<ProcessVariable>,
    of_locus: LocusVariables,
    /// Loci of the fore and of the hind legs, derived from the variables; the step length is that
    /// of each leg.
    loci: [FootLocus; 2],
    stance: StanceCurve,
    abduction: Abduction,
    /// Angles of abduction of the commanded legs \[rad\], where feet step to the side.
    abducted: Vec<f64>,
    /// Whether the phase of each leg is an output.
    outputs_phase: bool,
    /// Whether the distance of each leg's target from its reach is an output.
    outputs_reach: bool,
    /// Leg whose mean phase rate is an output.
    metered: Option<usize>,
    state: LegState,
}

/// State of the commands without the variables.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct LegState {
    /// Time since the start \[s\].
    age: f64,
    /// Targets out of reach of each leg of the robot.
    out_of_reach: Vec<OutOfReach>,
    /// Shift of the foot of each leg of the robot.
    shifts: Vec<Shift>,
    meter: PhaseMeter,
}

/// Targets of a leg that are out of its reach.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct OutOfReach {
    /// Number of them.
    count: u64,
    /// Time of the first since the start \[s\].
    first_s: f64,
    /// Distance of the present target from the reach, and the greatest one \[m\].
    present_m: f64,
    worst_m: f64,
}

impl OutOfReach {
    #[inline]
    fn add(&mut self, at_s: f64, beyond_m: f64) {
        self.present_m = beyond_m;
        if beyond_m > 0.0 {
            if self.count == 0 {
                self.first_s = at_s;
            }
            self.count += 1;
            self.worst_m = self.worst_m.max(beyond_m);
        }
    }
}

/// Values of all variables, and the state.
pub(crate) type Saved = (Vec<f64>, LegState);

impl LegCommands {
    /// Creates the commands of `limbs`, whose controller has these variables for its phases.
    pub(crate) fn new(limbs: Vec<Limb>, mut of_phases: Variables) -> Result<Self, GaitError> {
        LocusVariables::declare(&mut of_phases, &limbs);
        let variables = of_phases.sorted();
        let of_locus = LocusVariables::of(&variables);
        Ok(Self {
            loci: loci(&of_locus, &variables, StanceCurve::default())?,
            stance: StanceCurve::default(),
            state: LegState {
                out_of_reach: vec![OutOfReach::default(); limbs.len()],
                shifts: vec![Shift::default(); limbs.len()],
                ..LegState::default()
            },
            limbs,
            variables,
            of_locus,
            abduction: Abduction::None,
            abducted: Vec::new(),
            outputs_phase: false,
            outputs_reach: false,
            metered: None,
        })
    }

    pub(crate) fn set_stance_curve(&mut self, stance: StanceCurve) {
        self.stance = stance;
        self.loci = self.loci.map(|locus| locus.with_stance(stance));
    }

    /// Enables abduction commands; steps to the side need joints of abduction.
    pub(crate) fn enable_abduction(&mut self, abduction: Abduction) -> Result<(), GaitError> {
        self.abduction = abduction;
        if !abduction.steers() {
            return Ok(());
        }
        if let Some((_, limb)) = self.active().find(|(_, limb)| !limb.abducts()) {
            let name = limb.name.clone();
            return Err(GaitError::NoAbduction { name });
        }
        self.abducted = vec![0.0; self.active().count()];
        Ok(())
    }

    pub(crate) fn enable_phase_output(&mut self) {
        self.outputs_phase = true;
    }

    pub(crate) fn enable_reach_output(&mut self) {
        self.outputs_reach = true;
    }

    /// Enables the output of the mean phase rate of `leg`.
    pub(crate) fn enable_frequency_of(&mut self, leg: &str) -> Result<(), GaitError> {
        self.metered = Some(Limb::find(&self.limbs, leg)?);
        Ok(())
    }

    /// Number of targets out of reach since the start.
    pub(crate) fn out_of_reach(&self) -> u64 {
        let legs = self.state.out_of_reach.iter();
        legs.map(|leg| leg.count).sum()
    }

    /// Legs whose targets were out of reach.
    pub(crate) fn limit_violations(&self) -> Vec<LimitViolation> {
        let legs = self.limbs.iter().zip(&self.state.out_of_reach);
        let beyond = legs.filter(|(_, of_leg)| of_leg.count > 0);
        let violation = |(limb, of_leg): (&Limb, &OutOfReach)| LimitViolation {
            part: signal::leg_path(&limb.name),
            limit: Limit::Reach,
            first: SimTime::ZERO
                + SimDuration::try_from_secs_f64(of_leg.first_s).unwrap_or(SimDuration::ZERO),
            worst_m: of_leg.worst_m,
        };
        beyond.map(violation).collect()
    }

    pub(crate) fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    /// Value of the variable at `index`.
    #[inline]
    pub(crate) fn value(&self, index: usize) -> f64 {
        self.variables[index].value()
    }

    /// Commanded legs with their indices in the robot.
    pub(crate) fn active(&self) -> impl Iterator<Item = (usize, &Limb)> {
        let limbs = self.limbs.iter().enumerate();
        limbs.filter(|(_, limb)| limb.active)
    }

    /// Inputs of steps that capture the trunk.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = Port> + use<> {
        let captures = self.abduction == Abduction::Capture;
        captures.then(capture::ports).into_iter().flatten()
    }

    /// Number of their values.
    pub(crate) fn input_count(&self) -> usize {
        if self.abduction == Abduction::Capture {
            capture::INPUTS
        } else {
            0
        }
    }

    /// Outputs: commands of hips and knees, of abductions, phases, distances of the targets from
    /// the reach, and a mean phase rate.
    pub(crate) fn outputs(&self) -> impl Iterator<Item = Port> {
        let abducted = self.abduction.of(&self.limbs);
        let phases = self.active().filter(|_| self.outputs_phase);
        let reaches = self.active().filter(|_| self.outputs_reach);
        let name = |leg: &Limb, what| signal::of_leg(&leg.name, what);
        let metered = self.metered.map(|leg| &self.limbs[leg]);
        self.active()
            .flat_map(|(_, limb)| limb.ports())
            .chain(abducted.map(|limb| limb.port("abduction")))
            .chain(phases.map(move |(_, leg)| Port::output(name(leg, PHASE), Unit::Radian, 1)))
            .chain(
                reaches.map(move |(_, leg)| Port::output(name(leg, OUT_OF_REACH), Unit::Meter, 1)),
            )
            .chain(metered.map(move |leg| Port::output(name(leg, FREQUENCY), Unit::Hertz, 1)))
    }

    /// Whether the output is no command.
    pub(crate) fn is_monitor(output: &str) -> bool {
        let what = signal::parse_leg(output).map(|(_, what)| what);
        what.is_some_and(|what| [PHASE, FREQUENCY, OUT_OF_REACH].contains(&what))
    }

    /// Sets a variable, and returns the values that the controller derives from all of them. If
    /// they or the loci are invalid, the variable is unchanged.
    pub(crate) fn set_variable<T>(
        &mut self,
        index: usize,
        value: f64,
        derive: impl FnOnce(&[ProcessVariable]) -> Result<T, GaitError>,
    ) -> Result<T, VariableError> {
        let count = self.variables.len();
        let variable = self
            .variables
            .get_mut(index)
            .ok_or(VariableError::NoSuchIndex { index, count })?;
        if index == self.of_locus.splay {
            self.abduction.check(variable, value)?;
        }
        if self.of_locus.is_of_steering(index, self.limbs.len()) {
            self.abduction.check_steering(variable, value)?;
        }
        if index == self.of_locus.capture {
            self.abduction.check_capture(variable, value)?;
        }
        let before = variable.value();
        variable.set(value)?;
        let loci = loci(&self.of_locus, &self.variables, self.stance);
        match loci.and_then(|loci| Ok((loci, derive(&self.variables)?))) {
            Ok((loci, derived)) => {
                self.loci = loci;
                Ok(derived)
            }
            Err(error) => {
                let variable = &mut self.variables[index];
                let name = variable.name().to_owned();
                variable.set(before)?;
                let why = error.to_string();
                Err(VariableError::Refused { name, value, why })
            }
        }
    }

    /// Writes all outputs at the end of a step of `seconds`, with the values of [`Self::inputs`].
    #[inline]
    pub(crate) fn step(
        &mut self,
        seconds: f64,
        phases: &impl Phases,
        inputs: &[f64],
        outputs: &mut [f64],
    ) {
        self.state.age += seconds;
        let rest = self.write_drives(phases, inputs, outputs);
        let rest = self.write_abductions(rest);
        let rest = self.write_phases(phases, rest);
        let rest = self.write_reaches(rest);
        if let (Some(leg), [output]) = (self.metered, rest) {
            self.state.meter.step(seconds, phases.turn(leg));
            let measured = self.state.meter.frequency();
            *output = measured.unwrap_or_else(|| phases.frequency());
        }
    }

    /// Fraction of the ramp, 0 to 1.
    fn ramp_fraction(&self) -> f64 {
        let ramp = self.value(self.of_locus.ramp);
        if self.state.age < ramp {
            self.state.age / ramp
        } else {
            1.0
        }
    }

    /// Writes the commands of hips and knees; returns the rest of the outputs, as all of these
    /// functions.
    #[inline]
    fn write_drives<'o>(
        &mut self,
        phases: &impl Phases,
        inputs: &[f64],
        outputs: &'o mut [f64],
    ) -> &'o mut [f64] {
        let fraction = self.ramp_fraction();
        let lowered;
        let loci = if fraction < 1.0 {
            let crouch = (1.0 - fraction) * self.value(self.of_locus.crouch);
            lowered = self.loci.map(|locus| locus.with_lowered_hip(crouch));
            &lowered
        } else {
            &self.loci
        };
        let steering = self.abduction.steers().then(|| {
            let left = capture::velocity_left(inputs);
            self.of_locus.steering(&self.variables, fraction, left)
        });
        let mut abducted = self.abducted.iter_mut();
        let mut rest = outputs;
        for (leg, limb) in self.limbs.iter().enumerate() {
            if !limb.active {
                continue;
            }
            let end = limb.corner.end();
            let step_length = fraction * self.of_locus.step_length(&self.variables, leg);
            let locus = &loci[end];
            let (command, beyond_m);
            if let (Some(steering), Some(angle)) = (&steering, abducted.next()) {
                let shift = &mut self.state.shifts[leg];
                shift.aim(
                    phases.phase(leg, end),
                    phases.frequency(),
                    steering.capture_m,
                );
                let aside = LateralPlace {
                    offset: self.of_locus.lateral_offset(&self.variables, leg),
                    shift: *shift,
                };
                let placement = steering.placement(leg, limb, phases, locus, step_length, aside);
                *angle = placement.angle;
                let (drives, short_m) = limb.command(placement.target);
                (command, beyond_m) = (drives, short_m.max(placement.beyond_m));
            } else {
                let locus = locus.with_step_length(step_length);
                (command, beyond_m) = limb.command(locus.point(phases.phase(leg, end)));
            }
            self.state.out_of_reach[leg].add(self.state.age, beyond_m);
            let (output, behind) = rest.split_at_mut(command.len());
            output.copy_from_slice(&command);
            rest = behind;
        }
        rest
    }

    fn write_abductions<'o>(&self, outputs: &'o mut [f64]) -> &'o mut [f64] {
        let count = self.abduction.of(&self.limbs).count();
        let (abductions, rest) = outputs.split_at_mut(count);
        if self.abduction.steers() {
            abductions.copy_from_slice(&self.abducted);
        } else {
            let splay = self.value(self.of_locus.splay);
            self.abduction.command(&self.limbs, splay, abductions);
        }
        rest
    }

    fn write_phases<'o>(&self, phases: &impl Phases, outputs: &'o mut [f64]) -> &'o mut [f64] {
        if !self.outputs_phase {
            return outputs;
        }
        let (of_legs, rest) = outputs.split_at_mut(self.active().count());
        for ((leg, limb), output) in self.active().zip(of_legs) {
            let phase = phases.phase(leg, limb.corner.end());
            // A duty map may round up to a whole turn.
            *output = if phase < TAU { phase } else { 0.0 };
        }
        rest
    }

    fn write_reaches<'o>(&self, outputs: &'o mut [f64]) -> &'o mut [f64] {
        if !self.outputs_reach {
            return outputs;
        }
        let (of_legs, rest) = outputs.split_at_mut(self.active().count());
        for ((leg, _), output) in self.active().zip(of_legs) {
            *output = self.state.out_of_reach[leg].present_m;
        }
        rest
    }

    pub(crate) fn save(&self) -> Saved {
        let values = self.variables.iter().map(ProcessVariable::value);
        (values.collect(), self.state.clone())
    }

    /// Restores the variables and the state, and returns the values that the controller derives
    /// from the variables.
    pub(crate) fn restore<T>(
        &mut self,
        (values, state): Saved,
        derive: impl FnOnce(&[ProcessVariable]) -> Result<T, GaitError>,
    ) -> Result<T, SnapshotError> {
        if values.len() != self.variables.len() {
            return Err(self.mismatch(format!("one of {} variables", values.len())));
        }
        let legs = [state.out_of_reach.len(), state.shifts.len()];
        if legs != [self.limbs.len(); 2] {
            return Err(self.mismatch(format!("one of {legs:?} legs")));
        }
        let mut variables = self.variables.clone();
        for (variable, value) in variables.iter_mut().zip(values) {
            variable
                .set(value)
                .map_err(|error| self.mismatch(error.to_string()))?;
        }
        let loci = loci(&self.of_locus, &variables, self.stance);
        let derived = loci.and_then(|loci| Ok((loci, derive(&variables)?)));
        let (loci, derived) = derived.map_err(|error| self.mismatch(error.to_string()))?;
        self.loci = loci;
        self.variables = variables;
        self.state = state;
        Ok(derived)
    }

    /// The error of a snapshot of another controller.
    pub(crate) fn mismatch(&self, found: String) -> SnapshotError {
        let (legs, variables) = (self.limbs.len(), self.variables.len());
        SnapshotError::Mismatch {
            expected: format!("a gait of {legs} legs with {variables} variables"),
            found,
        }
    }
}

/// Loci of the fore and of the hind legs.
fn loci(
    of_locus: &LocusVariables,
    variables: &[ProcessVariable],
    stance: StanceCurve,
) -> Result<[FootLocus; 2], GaitError> {
    let locus = |end| FootLocus::new(&of_locus.shape(variables, end));
    Ok([locus(0)?, locus(1)?].map(|locus| locus.with_stance(stance)))
}

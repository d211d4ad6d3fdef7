//! State of a compliant plant and its integration in steps.

use std::fmt::Debug;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use twinrig_contact::Surface;
use twinrig_legged::{
    DriveModels, FootMotion, Friction, LEGS, Ledger, LegPosture, NegativeDissipation, PartFault,
    Posture, StepInputs, StepLoad, Stored,
};
use twinrig_runtime::PlantState;

use crate::body_contact::BodyContact;
use crate::commands::Commands;
use crate::events::{ELEMENTS, ElementMotion, EventLog};
use crate::flows::Flows;
use crate::frame::{into_world, rotation};
use crate::lanes::{Features, Quad};
use crate::rk4::{StepControl, StepError};
use crate::servo::DriveLaws;

/// Motion of the trunk in memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrunkState {
    /// Position, world frame \[m\].
    pub position: [f64; 3],
    /// Attitude as a quaternion w, x, y, z from trunk to world, of any length.
    pub attitude: [f64; 4],
    /// Velocity, trunk axes \[m/s\].
    pub velocity: [f64; 3],
    /// Angular velocity, trunk axes \[rad/s\].
    pub turning: [f64; 3],
}

impl From<[Quad; 4]> for TrunkState {
    fn from([position, attitude, velocity, turning]: [Quad; 4]) -> Self {
        Self {
            position: position.three(),
            attitude: attitude.0,
            velocity: velocity.three(),
            turning: turning.three(),
        }
    }
}

impl TrunkState {
    /// Returns the attitude as a quaternion of unit length.
    pub fn unit_attitude(&self) -> [f64; 4] {
        let square: f64 = self.attitude.iter().map(|c| c * c).sum();
        let scale = 1.0 / libm::sqrt(square);
        self.attitude.map(|c| c * scale)
    }

    /// Returns the posture of this trunk with legs.
    pub fn posture(&self, legs: Vec<(String, LegPosture)>) -> Posture {
        Posture {
            position: self.position.into(),
            attitude: self.unit_attitude(),
            velocity: into_world(&rotation(self.attitude), self.velocity).into(),
            angular_velocity: self.turning.into(),
            legs,
        }
    }
}

/// Motion of the first link and of the pulley of all legs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveState {
    /// Absolute angle of the first link \[rad\].
    pub hip: Quad,
    /// Its rate \[rad/s\].
    pub hip_rate: Quad,
    /// Angle of the pulley \[rad\].
    pub pulley: Quad,
    /// Its rate \[rad/s\].
    pub pulley_rate: Quad,
}

/// Motion of the joints of abduction of all legs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AbductionState {
    /// Angle \[rad\].
    pub angle: Quad,
    /// Its rate \[rad/s\].
    pub rate: Quad,
    /// Integral of the torque of the drives on the legs since the start \[N·m·s\].
    pub impulse: Quad,
    /// Inertia of a drive \[kg·m²\].
    pub inertia: f64,
}

/// Everything that a step changes, in memory.
#[derive(Debug)]
pub struct Step<'a, E: Equations> {
    /// Commands of the drives.
    pub commands: &'a Commands<Quad>,
    /// State.
    pub state: &'a mut E::State,
    /// Slope in this state, if known.
    pub slope: &'a mut Option<E::Slope>,
    /// Integrals of powers and forces since the start.
    pub sums: &'a mut Flows<Quad>,
    /// Control of the substeps.
    pub control: &'a mut StepControl,
    /// Load of pushes, if any.
    pub load: Option<&'a StepLoad>,
    /// Log of events.
    pub log: &'a mut EventLog,
    /// Duration \[s\].
    pub seconds: f64,
}

/// Equations of motion of a legged robot with compliant constraints.
pub trait Equations: Clone + Send {
    /// State of trunk and legs.
    type State: Debug + Copy + Send;
    /// Time derivative of the state, with powers and forces.
    type Slope: Debug + Copy + Send;
    /// Serialised state of the plant, which may have other formulations.
    type Saved: Serialize
        + DeserializeOwned
        + From<SavedCompliant>
        + TryInto<SavedCompliant, Error = String>;

    /// Returns the name of the plant.
    fn name(&self) -> &'static str;

    /// Returns the drives; none where the joints turn freely.
    fn drives(&self) -> Option<&DriveModels>;

    /// Returns the laws of the drives.
    fn laws(&self) -> &DriveLaws;

    /// Returns the absolute angle of each hip at the input zero \[rad\].
    fn hip_references(&self) -> &[f64];

    /// Advances a state with error control.
    ///
    /// # Errors
    /// [`StepError`]; the state is undefined then.
    fn step(&self, features: Features, step: Step<'_, Self>) -> Result<(), StepError>;

    /// Returns kinetic, spring and gravity energy \[J\]; the springs include the elements.
    fn stored(&self, features: Features, state: &Self::State) -> Stored;

    /// Returns the energy that lifts the moving masses by the length of a leg \[J\].
    fn energy_scale(&self) -> f64;

    /// Returns depths and rates of the elements.
    fn elements(&self, features: Features, state: &Self::State) -> ElementMotion;

    /// Returns the names of the elements.
    fn element_names(&self) -> [&'static str; ELEMENTS];

    /// Returns the name of a leg.
    fn leg_name(&self, leg: usize) -> &str;

    /// Returns the motion of the trunk.
    fn trunk(&self, state: &Self::State) -> TrunkState;

    /// Returns the place of the trunk's own centre of mass relative to its position, in trunk axes;
    /// none where the position is that of a trunk without payload.
    fn centre_of_trunk(&self) -> Option<[f64; 3]> {
        None
    }

    /// Sets the coefficients of friction.
    fn set_friction(&mut self, friction: &Friction);

    /// Returns the motion of first links and pulleys.
    fn driven(&self, state: &Self::State) -> DriveState;

    /// Returns the motion of the joints of abduction, if legs have them.
    fn abduction(&self, _state: &Self::State) -> Option<AbductionState> {
        None
    }

    /// Returns the contact of the body beyond the feet, if it has any.
    fn body_contact<'a>(&self, _state: &'a Self::State) -> Option<&'a BodyContact<Quad>> {
        None
    }

    /// Returns the absolute angles of the three segments of a leg \[rad\].
    fn angles(&self, state: &Self::State, leg: usize) -> [f64; 3];

    /// Returns the motion of the feet of all legs.
    fn feet(&self, state: &Self::State) -> [FootMotion; LEGS];

    /// Returns the ground below each leg.
    fn surfaces(&self, state: &Self::State, feet: &[FootMotion; LEGS]) -> [Surface; LEGS];

    /// Passes all numbers of a state on, in a fixed order.
    fn visit(&self, state: &mut Self::State, to: &mut dyn FnMut(&mut Quad));

    /// Returns the state in the coordinates that all plants of a robot share.
    fn posture(&self, state: &Self::State) -> Posture;

    /// Returns the entries of a state beyond the posture, by name.
    fn extra_state(&self, state: &Self::State) -> Vec<(String, Vec<f64>)>;

    /// Returns the state in a posture, with relaxed soles, and a line for each part that was not
    /// taken over.
    ///
    /// # Errors
    /// [`PartFault`] if the posture cannot be represented.
    fn state_of(
        &self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<(Self::State, Vec<String>), PartFault>;
}

/// Greatest residual of the energy balance as a share of the energy exchanged, and, as a share of
/// the reference energy, the residual below which it is no error.
const RESIDUAL_MAX: f64 = 0.1;
const RESIDUAL_FLOOR: f64 = 0.02;

/// Failure of a step.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FlowError {
    /// The substeps fail.
    #[error(transparent)]
    Step(#[from] StepError),
    /// The energy balance does not close.
    #[error(
        "steps of {:.3} ms are unstable or too long: {residual:.3e} J of energy are not accounted for",
        1e3 * seconds
    )]
    Energy {
        /// Length of the step \[s\].
        seconds: f64,
        /// Residual of the energy balance \[J\].
        residual: f64,
    },
    /// Friction generates energy.
    #[error(transparent)]
    Dissipation(#[from] NegativeDissipation),
}

/// Equations and state of a plant.
#[derive(Debug, Clone)]
pub struct Flow<E: Equations> {
    /// Equations of motion.
    pub equations: E,
    /// State.
    pub state: E::State,
    /// Slope in this state under these commands, if known.
    pub slope: Option<E::Slope>,
    /// Integrals of powers and forces since the start.
    pub sums: Flows<Quad>,
    /// Control of the substeps.
    pub control: StepControl,
    /// Energy balance.
    pub ledger: Ledger,
    /// Log of events.
    pub log: EventLog,
    commands: Commands<Quad>,
    /// Load of pushes in the next step.
    load: StepLoad,
    /// Sums, and rates of hip and pulley, before the last step, and its duration \[s\].
    sums_before: Flows<Quad>,
    rates_before: [Quad; 2],
    /// Rates of abduction, and integrals of its torque, at the same time.
    abduction_before: [Quad; 2],
    step_seconds: f64,
    features: Features,
    /// Energy of the rotors at the start \[J\].
    rotors_at_start: f64,
}

/// Serialised state of a compliant plant.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SavedCompliant {
    numbers: Vec<Quad>,
    slope_known: bool,
    control: StepControl,
    ledger: Ledger,
    rotors_at_start: f64,
    step_seconds: f64,
}

impl<E: Equations> Flow<E> {
    /// Creates the plant in a state, its servos at rest there; `tolerance` is the greatest error of
    /// a substep \[m\].
    pub fn new(equations: E, state: E::State, tolerance: f64, features: Features) -> Self {
        let DriveState {
            hip,
            hip_rate,
            pulley,
            pulley_rate,
        } = equations.driven(&state);
        let mut commands = Commands::zero();
        if !matches!(equations.laws(), DriveLaws::Motors(_)) {
            (commands.hip[0], commands.knee[0]) = (hip, pulley);
        }
        let abduction = equations.abduction(&state);
        let is_motor = equations
            .drives()
            .is_some_and(|drives| drives.abduction().is_some());
        if let Some(joints) = abduction.as_ref().filter(|_| !is_motor) {
            commands.abduction[0] = joints.angle;
        }
        let stored = equations.stored(features, &state);
        let mut flow = Self {
            equations,
            state,
            slope: None,
            sums: Flows::zero(),
            control: StepControl::new(tolerance),
            ledger: Ledger::opened(stored),
            log: EventLog::default(),
            commands,
            load: StepLoad::default(),
            sums_before: Flows::zero(),
            rates_before: [hip_rate, pulley_rate],
            abduction_before: [Quad::splat(0.0); 2],
            step_seconds: 0.0,
            features,
            rotors_at_start: 0.0,
        };
        flow.rotors_at_start = flow.rotors();
        flow
    }

    /// Sets the inputs of the next step; the slope under others is forgotten.
    pub fn set_inputs(&mut self, inputs: &StepInputs<'_>) {
        let mut commands = self.commands;
        let equations = &self.equations;
        commands.set_inputs(equations.drives(), equations.hip_references(), inputs);
        if !commands.continues(&self.commands.at_end(self.step_seconds)) {
            self.slope = None;
        }
        self.commands = commands;
    }

    /// Sets the load of pushes in the next step. The slope of a step with a load is forgotten at
    /// both of its ends: a load may be discontinuous there, and is not in a snapshot.
    pub fn set_load(&mut self, load: &StepLoad) {
        if !load.is_empty() {
            self.slope = None;
        }
        self.load.copy_from(load);
    }

    /// Advances by `seconds`.
    ///
    /// # Errors
    /// [`FlowError`]; everything is as before then, but for the slope, which is forgotten.
    pub fn step(&mut self, seconds: f64) -> Result<(), FlowError> {
        let (state, sums) = (self.state, self.sums);
        let (control, ledger, events) = (self.control, self.ledger, self.log.len());
        let done = self.equations.step(
            self.features,
            Step {
                commands: &self.commands,
                state: &mut self.state,
                slope: &mut self.slope,
                sums: &mut self.sums,
                control: &mut self.control,
                load: Some(&self.load).filter(|load| !load.is_empty()),
                log: &mut self.log,
                seconds,
            },
        );
        self.close_ledger();
        let done = done.map_err(FlowError::from);
        if let Err(error) = done.and_then(|()| self.check_energy(seconds)) {
            (self.state, self.slope, self.sums) = (state, None, sums);
            (self.control, self.ledger) = (control, ledger);
            self.log.truncate(events);
            return Err(error);
        }
        if !self.load.is_empty() {
            self.slope = None;
        }
        self.sums_before = sums;
        let before = self.equations.driven(&state);
        self.rates_before = [before.hip_rate, before.pulley_rate];
        if let Some(before) = self.equations.abduction(&state) {
            self.abduction_before = [before.rate, before.impulse];
        }
        self.step_seconds = seconds;
        Ok(())
    }

    /// Updates the energy balance.
    fn close_ledger(&mut self) {
        let sum = |quad: Quad| {
            let [a, b, c, d] = quad.0;
            (a + b) + (c + d)
        };
        // The work into the rotors is their energy, exactly.
        self.ledger.actuator = sum(self.sums.actuator) + self.rotors() - self.rotors_at_start;
        self.ledger.dissipated = sum(self.sums.dissipated);
        self.ledger.external = sum(self.sums.external);
        let stored = self.stored();
        self.ledger.close_step(stored);
    }

    /// Checks that the energy balance closes, for steps beyond the limit of stability gain energy,
    /// and that friction dissipates, up to the error of the integration.
    fn check_energy(&self, seconds: f64) -> Result<(), FlowError> {
        let balance = self.ledger.balance();
        let reference = balance.kinetic + balance.spring + self.equations.energy_scale();
        let most = (RESIDUAL_MAX * balance.exchanged).max(RESIDUAL_FLOOR * reference);
        // The form of the comparison rejects NaN.
        if balance.residual.abs() <= most {
            return Ok(self.ledger.check_within([most; 2])?);
        }
        let residual = balance.residual;
        Err(FlowError::Energy { seconds, residual })
    }

    /// Computes the slope at the end of the last step again.
    pub fn update_slope(&mut self) {
        let mut copy = self.clone();
        copy.commands = self.commands.at_end(self.step_seconds);
        copy.slope = None;
        // A step of no duration leaves the slope at its end.
        if copy.step(0.0).is_ok() {
            self.slope = copy.slope;
        }
    }

    /// Returns the energy of the rotors \[J\].
    fn rotors(&self) -> f64 {
        let [hip, knee] = self.equations.laws().inertias();
        let driven = self.equations.driven(&self.state);
        let squares = |quad: Quad| quad.0.iter().map(|rate| rate * rate).sum::<f64>();
        let drives = hip * squares(driven.hip_rate) + knee * squares(driven.pulley_rate);
        match self.equations.abduction(&self.state) {
            Some(joints) => 0.5 * (drives + joints.inertia * squares(joints.rate)),
            None => 0.5 * drives,
        }
    }

    /// Returns kinetic, spring and gravity energy \[J\].
    pub fn stored(&self) -> Stored {
        self.equations.stored(self.features, &self.state)
    }

    /// Returns the greatest depth of a compressed element \[m\].
    pub fn greatest_depth(&self) -> f64 {
        let motion = self.equations.elements(self.features, &self.state);
        let depths = motion.depths.iter().flat_map(|quad| quad.0);
        depths.fold(0.0, f64::max)
    }

    /// Returns the mean of a force or torque over the last step.
    #[inline]
    pub(crate) fn mean(&self, of: impl Fn(&Flows<Quad>) -> &Quad, leg: usize) -> f64 {
        self.per_step(of(&self.sums).0[leg] - of(&self.sums_before).0[leg])
    }

    /// Returns the mean torque that accelerated the rotor of a hip in the last step \[N·m\].
    #[inline]
    pub(crate) fn hip_rotor_torque(&self, leg: usize) -> f64 {
        let [inertia, _] = self.equations.laws().inertias();
        let rate = self.equations.driven(&self.state).hip_rate;
        inertia * self.per_step(rate.0[leg] - self.rates_before[0].0[leg])
    }

    /// Returns the same of a pulley \[N·m\].
    #[inline]
    pub(crate) fn pulley_rotor_torque(&self, leg: usize) -> f64 {
        let [_, inertia] = self.equations.laws().inertias();
        let rate = self.equations.driven(&self.state).pulley_rate;
        inertia * self.per_step(rate.0[leg] - self.rates_before[1].0[leg])
    }

    /// Returns the mean torque of the drive of abduction in the last step \[N·m\].
    pub(crate) fn abduction_torque(&self, leg: usize) -> f64 {
        let Some(now) = self.equations.abduction(&self.state) else {
            return 0.0;
        };
        let [rate, impulse] = self.abduction_before.map(|before| before.0[leg]);
        let (rate, impulse) = (now.rate.0[leg] - rate, now.impulse.0[leg] - impulse);
        self.per_step(impulse + now.inertia * rate)
    }

    #[inline]
    fn per_step(&self, change: f64) -> f64 {
        if self.step_seconds > 0.0 {
            change / self.step_seconds
        } else {
            0.0
        }
    }

    /// Returns this plant in another state, with a new energy balance and new counts.
    pub(crate) fn restarted(&self, state: E::State) -> Self {
        let tolerance = self.control.tolerance();
        let mut next = Self::new(self.equations.clone(), state, tolerance, self.features);
        next.log.enable(self.log.is_enabled());
        next
    }

    /// Passes all numbers of state, sums and commands on, in a fixed order.
    fn visit(&mut self, to: &mut dyn FnMut(&mut Quad)) {
        self.equations.visit(&mut self.state, to);
        let mut pass = |quad: Quad| {
            let mut quad = quad;
            to(&mut quad);
            quad
        };
        self.sums = self.sums.map(&mut pass);
        self.sums_before = self.sums_before.map(&mut pass);
        self.commands.damping = self.commands.damping.map(&mut pass);
        for pair in [
            &mut self.commands.hip,
            &mut self.commands.knee,
            &mut self.commands.abduction,
            &mut self.rates_before,
            &mut self.abduction_before,
        ] {
            *pair = pair.map(&mut pass);
        }
    }

    /// Returns the state to be serialised.
    pub(crate) fn saved(&self) -> SavedCompliant {
        let mut numbers = Vec::new();
        self.clone().visit(&mut |quad| numbers.push(*quad));
        SavedCompliant {
            numbers,
            slope_known: self.slope.is_some(),
            control: self.control,
            ledger: self.ledger,
            rotors_at_start: self.rotors_at_start,
            step_seconds: self.step_seconds,
        }
    }

    /// Restores a saved state, bit for bit.
    pub(crate) fn restore_saved(&mut self, saved: &SavedCompliant) -> Result<(), String> {
        let mut expected = 0;
        self.clone().visit(&mut |_| expected += 1);
        let found = saved.numbers.len();
        if found != expected {
            return Err(format!("{found} numbers, expected {expected}"));
        }
        let mut numbers = saved.numbers.iter().copied();
        self.visit(&mut |quad| *quad = numbers.next().unwrap_or(*quad));
        self.control = saved.control;
        (self.ledger, self.rotors_at_start) = (saved.ledger, saved.rotors_at_start);
        self.step_seconds = saved.step_seconds;
        (self.slope, self.load) = (None, StepLoad::default());
        if saved.slope_known {
            self.update_slope();
        }
        Ok(())
    }
}

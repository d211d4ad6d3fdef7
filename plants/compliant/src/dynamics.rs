//! The compliant flow as the dynamics of a plant.

use nalgebra::{Matrix3, Vector3};
use twinrig_contact::Surface;
use twinrig_kernel::{SimTime, signal};
use twinrig_legged::{
    DriveModels, Dynamics, FootMotion, Friction, LEGS, PartFault, Posture, Readings, StepInputs,
    StepLoad,
};
use twinrig_runtime::{EnergyBalance, PlantEvent, PlantEventKind, PlantState, WorkCounts};

use crate::events::is_of_trunk;
use crate::flow::{Equations, Flow, FlowError};
use crate::frame::{into_world, rotation};
use crate::rk4::StepError;

impl<E: Equations> Readings for Flow<E> {
    fn position(&self) -> Vector3<f64> {
        let position = Vector3::from(self.equations.trunk(&self.state).position);
        match self.equations.centre_of_trunk() {
            None => position,
            Some(centre) => position + self.rotation() * Vector3::from(centre),
        }
    }

    fn attitude(&self) -> [f64; 4] {
        self.equations.trunk(&self.state).unit_attitude()
    }

    fn rotation(&self) -> Matrix3<f64> {
        let rows = rotation(self.equations.trunk(&self.state).attitude);
        Matrix3::from_fn(|i, j| rows[i][j])
    }

    fn velocity(&self) -> Vector3<f64> {
        let trunk = self.equations.trunk(&self.state);
        let velocity = Vector3::from(into_world(&rotation(trunk.attitude), trunk.velocity));
        match self.equations.centre_of_trunk() {
            None => velocity,
            Some(centre) => {
                let turning = self.angular_velocity();
                velocity + self.rotation() * turning.cross(&Vector3::from(centre))
            }
        }
    }

    fn angular_velocity(&self) -> Vector3<f64> {
        self.equations.trunk(&self.state).turning.into()
    }

    fn energy(&self) -> EnergyBalance {
        self.ledger.balance()
    }

    fn hip(&self, leg: usize) -> f64 {
        self.equations.driven(&self.state).hip.0[leg] - self.equations.hip_references()[leg]
    }

    fn hip_rate(&self, leg: usize) -> f64 {
        self.equations.driven(&self.state).hip_rate.0[leg]
    }

    fn hip_torque(&self, leg: usize) -> f64 {
        self.mean(|sums| &sums.hip, leg) + self.hip_rotor_torque(leg)
    }

    fn pulley(&self, leg: usize) -> f64 {
        self.equations.driven(&self.state).pulley.0[leg]
    }

    fn pulley_rate(&self, leg: usize) -> f64 {
        self.equations.driven(&self.state).pulley_rate.0[leg]
    }

    fn knee_torque(&self, leg: usize) -> f64 {
        self.mean(|sums| &sums.knee, leg) + self.pulley_rotor_torque(leg)
    }

    fn cable_tension(&self, leg: usize) -> f64 {
        self.mean(|sums| &sums.cable, leg)
    }

    fn abduction(&self, leg: usize) -> f64 {
        let joints = self.equations.abduction(&self.state);
        joints.map_or(0.0, |joints| joints.angle.0[leg])
    }

    fn abduction_rate(&self, leg: usize) -> f64 {
        let joints = self.equations.abduction(&self.state);
        joints.map_or(0.0, |joints| joints.rate.0[leg])
    }

    fn abduction_torque(&self, leg: usize) -> f64 {
        Self::abduction_torque(self, leg)
    }

    fn angles(&self, leg: usize) -> [f64; 3] {
        self.equations.angles(&self.state, leg)
    }

    fn feet(&self) -> [FootMotion; LEGS] {
        self.equations.feet(&self.state)
    }

    fn surfaces(&self, feet: &[FootMotion; LEGS]) -> [Surface; LEGS] {
        self.equations.surfaces(&self.state, feet)
    }

    fn ground_impulse(&self, leg: usize) -> [f64; 3] {
        let [x, y, z] = &self.sums.ground;
        [x.0[leg], y.0[leg], z.0[leg]]
    }

    fn segments_impulse(&self, leg: usize) -> [f64; 3] {
        let contact = self.equations.body_contact(&self.state);
        contact.map_or([0.0; 3], |contact| contact.on_legs.map(|quad| quad.0[leg]))
    }

    fn trunk_impulse(&self) -> [f64; 3] {
        let contact = self.equations.body_contact(&self.state);
        contact.map_or([0.0; 3], |contact| contact.on_trunk.three())
    }
}

impl<E: Equations> Dynamics for Flow<E> {
    type Saved = E::Saved;

    fn name(&self) -> &'static str {
        self.equations.name()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        let drives = self.equations.drives();
        let legs = self.equations.hip_references().len();
        let of_drives = legs * drives.map_or(0, DriveModels::inputs);
        let (inputs, abduction) = inputs.split_at_mut(of_drives.min(inputs.len()));
        if drives.is_some_and(|drives| drives.abduction().is_some()) {
            abduction.fill(0.0);
        } else {
            for (leg, input) in abduction.iter_mut().enumerate() {
                *input = Readings::abduction(self, leg);
            }
        }
        if let Some(DriveModels::Motors(_)) = drives {
            inputs.fill(0.0);
            return;
        }
        for (leg, pair) in inputs.chunks_exact_mut(2).enumerate() {
            (pair[0], pair[1]) = (self.hip(leg), self.pulley(leg));
        }
    }

    fn set_inputs(&mut self, inputs: &StepInputs<'_>) {
        Self::set_inputs(self, inputs);
    }

    fn set_friction(&mut self, friction: &Friction) {
        self.equations.set_friction(friction);
        self.slope = None;
    }

    fn set_load(&mut self, load: &StepLoad) {
        Self::set_load(self, load);
    }

    fn advance(&mut self, from: SimTime, seconds: f64) -> Result<(), PartFault> {
        let events = self.log.len();
        let done = self.step(seconds);
        self.log.shift(events, from.as_secs_f64());
        done.map_err(|error| {
            let part = match &error {
                FlowError::Step(
                    StepError::TooStiff { fastest, .. } | StepError::Abrupt { fastest, .. },
                ) => signal::leg_path(self.equations.leg_name(fastest.leg)),
                _ => "integrator".to_owned(),
            };
            PartFault::new(part, error.to_string())
        })
    }

    fn counts(&self) -> WorkCounts {
        WorkCounts {
            steps: self.control.work.accepted,
            evaluations: self.control.work.evaluations,
            events: self.control.work.events,
            ..WorkCounts::default()
        }
    }

    fn constraint_violation(&self) -> Option<f64> {
        Some(self.greatest_depth())
    }

    fn least_substep_s(&self) -> Option<f64> {
        let rate = self.control.work.greatest_rate;
        (rate > 0.0).then(|| 1.0 / rate)
    }

    fn save(&self) -> E::Saved {
        self.saved().into()
    }

    fn restore(&mut self, saved: E::Saved) -> Result<(), String> {
        self.restore_saved(&saved.try_into()?)
    }

    fn posture(&self) -> Posture {
        self.equations.posture(&self.state)
    }

    fn extra_state(&self) -> Vec<(String, Vec<f64>)> {
        self.equations.extra_state(&self.state)
    }

    fn resume_from(
        &mut self,
        posture: &Posture,
        extra: &PlantState,
    ) -> Result<Vec<String>, PartFault> {
        let (state, lines) = self.equations.state_of(posture, extra)?;
        *self = self.restarted(state);
        Ok(lines)
    }

    fn log_events(&mut self, enabled: bool) {
        self.log.enable(enabled);
    }

    fn drain_events(&mut self, to: &mut Vec<PlantEvent>) {
        let (names, equations) = (self.equations.element_names(), &self.equations);
        to.extend(self.log.drain().map(|event| PlantEvent {
            at_s: event.at_s,
            part: if is_of_trunk(event.element) {
                format!("body/{}", names[event.element])
            } else {
                signal::of_leg(equations.leg_name(event.leg), names[event.element])
            },
            kind: if event.compressed {
                PlantEventKind::Reached
            } else {
                PlantEventKind::Released
            },
        }));
    }
}

//! Conversion from and to the state that all plants of a robot share.
//!
//! The plant has other coordinates: the centre of mass of the trunk with the masses at its hips,
//! and feet with absolute velocities. Hip angle and foot position are equivalent to the angles of
//! the three segments as long as the ankle bends in its regular direction.

use nalgebra::Vector3;
use twinrig_kernel::signal;
use twinrig_legged::{DriveModels, LegPosture, PartFault, Posture};
use twinrig_robot::leg::Planar;

use crate::drives::Inputs;
use crate::flow::Flow;
use crate::model::{LegModel, Model};
use crate::plant::Islands;
use crate::state::State;

impl Islands {
    /// Posture of the robot.
    pub(crate) fn shared_posture(&self) -> Posture {
        let trunk = &self.flows[0];
        let (state, rotation) = (&trunk.state, trunk.placement.rotation);
        let arm = -trunk.model.centre;
        let flows = self.flows.iter();
        Posture {
            position: state.position() + rotation * arm,
            attitude: state.attitude(),
            velocity: rotation * (state.velocity() + state.rate().cross(&arm)),
            angular_velocity: state.rate(),
            legs: flows.flat_map(Flow::postures).collect(),
        }
    }

    /// Flows in a posture, with a new energy balance and new counters.
    pub(crate) fn flows_at(&self, posture: &Posture) -> Result<Vec<Flow>, PartFault> {
        let mut legs = posture.legs.iter();
        let mut flows = Vec::with_capacity(self.flows.len());
        for flow in &self.flows {
            let flow_legs: Vec<_> = legs.by_ref().take(flow.model.legs.len()).collect();
            let (state, inputs) = state_of_posture(&flow.model, posture, &flow_legs)
                .map_err(|(leg, why)| PartFault::new(signal::leg_path(&leg), why))?;
            let flow = Flow::new(flow.model.clone(), &state, inputs);
            flows.push(flow.map_err(|error| PartFault::new("integrator", error.to_string()))?);
        }
        Ok(flows)
    }
}

impl Flow {
    /// Postures of the flow's legs.
    fn postures(&self) -> impl Iterator<Item = (String, LegPosture)> {
        let (state, legs) = (&self.state, self.model.legs.iter().enumerate());
        legs.map(move |(i, leg)| {
            let pose = &self.placement.poses[i];
            let [_, second, third] = pose.angles();
            let carried = leg.carried(state.foot(i), state.velocity(), state.rate());
            let relative = state.foot_velocity(i) - carried;
            let velocity = leg.pantograph.velocity(pose, state.hip_rate(i), relative);
            let posture = LegPosture {
                angles: [state.hip(i), second, third],
                rates: velocity.omega,
                pulley: state.pulley(i),
                pulley_rate: state.pulley_rate(i),
            };
            (leg.name.clone(), posture)
        })
    }
}

impl LegModel {
    /// Velocity in the leg plane that the trunk's motion gives to a foot, trunk axes \[m/s\].
    pub(crate) fn carried(
        &self,
        foot: Planar,
        velocity: Vector3<f64>,
        rate: Vector3<f64>,
    ) -> Planar {
        let carried = velocity + rate.cross(&self.foot_in_trunk(foot));
        Planar::new(carried.x, carried.z)
    }

    /// Position \[m\] and velocity \[m/s\] of a foot relative to the hip. Fails with the reason
    /// where hip and foot do not determine the pose.
    pub(crate) fn foot_and_velocity(&self, of: &LegPosture) -> Result<(Planar, Planar), String> {
        let [_, second, third] = of.angles;
        if libm::sin(third - second) <= 0.0 {
            return Err(
                "its ankle is folded up beyond the second segment, where hip and foot do not determine the pose".to_owned(),
            );
        }
        let pose = self.pantograph.pose_of_angles(of.angles);
        let pose = pose.map_err(|error| error.to_string())?;
        // A link's rotation moves the foot by that link.
        let link_velocity = |span: Planar, rate: f64| Planar::new(-span.y, span.x) * rate;
        let relative = link_velocity(pose.knee, of.rates[0])
            + link_velocity(pose.ankle - pose.knee, of.rates[1])
            + link_velocity(pose.foot - pose.ankle, of.rates[2]);
        Ok((pose.foot, relative))
    }
}

/// Converts a posture to the plant's coordinates, and to the inputs that keep servos there; motors
/// coast. Fails with a leg that cannot be represented, and the reason.
fn state_of_posture(
    model: &Model,
    posture: &Posture,
    legs: &[&(String, LegPosture)],
) -> Result<(State, Inputs), (String, String)> {
    let mut state = State::zero();
    state.set_attitude(posture.attitude);
    let rotation = state.rotation();
    let rate = posture.angular_velocity;
    let velocity = rotation.tr_mul(&posture.velocity) + rate.cross(&model.centre);
    state.set_position(posture.position + rotation * model.centre);
    state.set_velocity(velocity);
    state.set_rate(rate);
    let mut inputs = Inputs::default();
    for (i, (leg, (name, of))) in model.legs.iter().zip(legs).enumerate() {
        let first = of.angles[0];
        let foot = leg.foot_and_velocity(of);
        let (foot, relative) = foot.map_err(|why| (name.clone(), why))?;
        state.set_foot(i, foot);
        state.set_hip(i, first);
        state.set_pulley(i, of.pulley);
        state.set_foot_velocity(i, relative + leg.carried(foot, velocity, rate));
        state.set_hip_rate(i, of.rates[0]);
        state.set_pulley_rate(i, of.pulley_rate);
        if let Some(DriveModels::Servos(_)) = model.drives {
            let hip = first - leg.pantograph.hip_reference();
            inputs[i][..2].copy_from_slice(&[hip, of.pulley]);
        }
    }
    Ok((state, inputs))
}

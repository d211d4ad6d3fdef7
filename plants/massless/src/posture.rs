//! Where the plant is, in the words that all plants of a robot share, and how it goes on from where another is.
//!
//! Its own coordinates are others: the centre of mass of the trunk with what hangs at its hips, and the feet with absolute
//! velocities. Hip angle and foot say as much as the angles of three segments, where the ankle bends the way it is built.

use nalgebra::Vector3;
use twinrig_leg::Planar;
use twinrig_legged::{Fitted, LegPosture, Posture};
use twinrig_runtime::{Plant, PlantFault, PlantState};

use crate::drives::Inputs;
use crate::flow::Flow;
use crate::model::{LegModel, Model};
use crate::plant::Massless;
use crate::state::State;

impl Massless {
    /// Where it is.
    pub(crate) fn posture(&self) -> Posture {
        let trunk = &self.flows[0];
        let (state, rotation) = (&trunk.state, trunk.here.rotation);
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

    /// Goes on from a state with all its books and counts new; where it cannot, nothing has changed.
    pub(crate) fn go_on_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let refused = |part: &str, why: String| PlantFault {
            time: from.time,
            part: part.to_owned(),
            energy: self.energy().stored(),
            why,
        };
        let mut posture = self.posture();
        let mut lines = posture.resume_from(from);
        posture.sound().map_err(|why| refused("body", why))?;
        lines.extend(posture.keep_to(self.flows[0].model.base));
        let mut legs = posture.legs.iter();
        let mut flows = Vec::with_capacity(self.flows.len());
        for flow in &self.flows {
            let own: Vec<_> = legs.by_ref().take(flow.model.legs.len()).collect();
            let (state, inputs) = taken(&flow.model, &posture, &own)
                .map_err(|(leg, why)| refused(&format!("leg/{leg}"), why))?;
            let flow = Flow::new(flow.model.clone(), &state, inputs);
            flows.push(flow.map_err(|error| refused("integrator", error.to_string()))?);
        }
        self.begin_at(flows, from.time);
        Ok(lines)
    }
}

impl Flow {
    /// Where its legs are.
    fn postures(&self) -> impl Iterator<Item = (String, LegPosture)> {
        let (state, legs) = (&self.state, self.model.legs.iter().enumerate());
        legs.map(move |(i, leg)| {
            let pose = &self.here.poses[i];
            let [_, second, third] = pose.angles();
            let carried = carried(leg, state.foot(i), state.velocity(), state.rate());
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

/// Velocity in the leg plane at which the trunk carries a foot along, trunk axes.
fn carried(leg: &LegModel, foot: Planar, velocity: Vector3<f64>, rate: Vector3<f64>) -> Planar {
    let carried = velocity + rate.cross(&leg.foot_in_trunk(foot));
    Planar::new(carried.x, carried.z)
}

/// A posture in the plant's own coordinates, and the inputs that keep servos there; motors are left to coast. Or the leg that
/// it cannot represent, and why.
fn taken(
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
        let refused = |why: &str| (name.clone(), why.to_owned());
        let [first, second, third] = of.angles;
        if libm::sin(third - second) <= 0.0 {
            return Err(refused(
                "its ankle is folded up beyond the second segment, where hip and foot do not tell the pose",
            ));
        }
        let pose = leg.pantograph.pose_of_angles(of.angles);
        let pose = pose.map_err(|error| refused(&error.to_string()))?;
        // What of a leg turns moves all that hangs on it.
        let turned = |span: Planar, rate: f64| Planar::new(-span.y, span.x) * rate;
        let relative = turned(pose.knee, of.rates[0])
            + turned(pose.ankle - pose.knee, of.rates[1])
            + turned(pose.foot - pose.ankle, of.rates[2]);
        state.set_foot(i, pose.foot);
        state.set_hip(i, first);
        state.set_pulley(i, of.pulley);
        state.set_foot_velocity(i, relative + carried(leg, pose.foot, velocity, rate));
        state.set_hip_rate(i, of.rates[0]);
        state.set_pulley_rate(i, of.pulley_rate);
        if let Some(Fitted::Servos(_)) = model.drives {
            let hip = first - leg.pantograph.hip_reference();
            inputs[i][..2].copy_from_slice(&[hip, of.pulley]);
        }
    }
    Ok((state, inputs))
}

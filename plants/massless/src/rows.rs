//! Kinematics of a leg in one state, and the constraint rows that follow from it.

use libm::sincos;
use nalgebra::{Matrix3, Vector3};
use twinrig_contact::Surface;
use twinrig_robot::JointFriction;
use twinrig_robot::leg::{Gradient, LegError, Length, Planar, Pose, Stop, Velocity};

use crate::model::LegModel;
use crate::state::State;

/// Kinematics and forces of a leg in one state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegKinematics {
    pub(crate) pose: Pose,
    pub(crate) joint_velocity: Velocity,
    /// Foot from the centre of mass, trunk frame.
    pub(crate) foot: Vector3<f64>,
    /// Absolute velocity of the foot, trunk axes.
    pub(crate) absolute: Vector3<f64>,
    /// Part of the foot's sideways acceleration that does not stem from the trunk's acceleration
    /// \[m/s²\].
    pub(crate) lateral_bias: f64,
    /// Gradient of the springs' energy.
    pub(crate) spring: Gradient,
    /// Generalised force of the joints' friction.
    pub(crate) friction: Gradient,
}

/// Constraint: a gap (or a tangential displacement) whose rate is linear in the velocities.
///
/// The trunk's velocities form two groups that its inertia does not couple: sagittal (x, z, pitch)
/// and lateral (y, roll, yaw).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub(crate) leg: usize,
    pub(crate) sagittal: Vector3<f64>,
    pub(crate) lateral: Vector3<f64>,
    pub(crate) foot: Planar,
    pub(crate) hip: f64,
    pub(crate) pulley: f64,
}

impl LegKinematics {
    pub(crate) fn new(model: &LegModel, state: &State, leg: usize) -> Result<Self, LegError> {
        let foot_in_hip = state.foot(leg);
        let (sine, cosine) = sincos(state.hip(leg));
        let pose = model.pantograph.pose(sine, cosine, foot_in_hip)?;
        let foot = model.hip + Vector3::new(foot_in_hip.x, 0.0, foot_in_hip.y);
        let rate = state.rate();
        let carried = state.velocity() + rate.cross(&foot);
        let foot_velocity = state.foot_velocity(leg);
        let relative = Planar::new(foot_velocity.x - carried.x, foot_velocity.y - carried.z);
        let joint_velocity = model
            .pantograph
            .velocity(&pose, state.hip_rate(leg), relative);
        let spring = match &model.table {
            None => model.pantograph.spring_gradient(&pose),
            Some(table) => table.look_up(sine, cosine, foot_in_hip)?.1,
        };
        let [hip, knee, ankle] = joint_friction(model, &joint_velocity);
        Ok(Self {
            pose,
            joint_velocity,
            foot,
            absolute: Vector3::new(foot_velocity.x, carried.y, foot_velocity.y),
            lateral_bias: rate.z * relative.x - rate.x * relative.y,
            spring,
            friction: model
                .pantograph
                .torque_gradient(&pose, [knee - hip, ankle - knee, -ankle]),
        })
    }

    /// Viscous coefficients of hip, knee and ankle \[N·m·s/rad\], and the gradients of their rates
    /// with respect to the velocities of hip and foot relative to the trunk.
    pub(crate) fn joint_gradients(&self, model: &LegModel) -> [(f64, Gradient); 3] {
        let segment = |torques| model.pantograph.torque_gradient(&self.pose, torques);
        let [first, second, third] = [
            segment([1.0, 0.0, 0.0]),
            segment([0.0, 1.0, 0.0]),
            segment([0.0, 0.0, 1.0]),
        ];
        let JointFriction {
            hip, knee, ankle, ..
        } = model.friction;
        [
            (hip, first),
            (knee, second + first * -1.0),
            (ankle, third + second * -1.0),
        ]
    }

    /// Energy dissipated by the joints' friction for a displacement of foot and hip relative to the
    /// trunk in `seconds` \[J\].
    pub(crate) fn friction_loss(
        &self,
        model: &LegModel,
        foot: Planar,
        hip: f64,
        seconds: f64,
    ) -> f64 {
        let moved = model.pantograph.velocity(&self.pose, hip, foot);
        let [w1, w2, w3] = moved.omega;
        let [hip, knee, ankle] = joint_friction(model, &moved);
        (hip * w1 + knee * (w2 - w1) + ankle * (w3 - w2)) / seconds
    }

    /// Coefficients of the trunk's (y, roll, yaw) rates in the foot's sideways velocity.
    pub(crate) fn sideways(&self) -> Vector3<f64> {
        Vector3::new(1.0, -self.foot.z, self.foot.x)
    }

    /// Force of springs and joint friction on the foot, in the leg plane \[N\].
    pub(crate) fn leg_force(&self) -> Planar {
        self.friction.foot - self.spring.foot
    }

    /// Torque of springs and joint friction on a drive (0: hip, 1: pulley) \[N·m\]; the cable is a
    /// constraint and not included.
    pub(crate) fn load(&self, drive: usize) -> f64 {
        if drive == 0 {
            self.friction.hip - self.spring.hip
        } else {
            0.0
        }
    }

    /// Rate of a stop's gap.
    pub(crate) fn gap_rate(&self, model: &LegModel, stop: Stop, pulley_rate: f64) -> f64 {
        let (length, sign) = stop.limits();
        let cable = if stop == Stop::Cable {
            model.pantograph.pulley_radius() * pulley_rate
        } else {
            0.0
        };
        sign * model
            .pantograph
            .length_rate(&self.pose, &self.joint_velocity, length)
            - cable
    }

    /// Row of a stop.
    pub(crate) fn stop_row(&self, model: &LegModel, stop: Stop, leg: usize) -> Row {
        let (length, sign) = stop.limits();
        let pulley = if stop == Stop::Cable {
            -model.pantograph.pulley_radius()
        } else {
            0.0
        };
        self.length_row(model, length, sign, pulley, leg)
    }

    /// Row of the distance from knee to foot, which decreases as the ankle folds up.
    pub(crate) fn ankle_row(&self, model: &LegModel, leg: usize) -> Row {
        self.length_row(model, Length::Span, 1.0, 0.0, leg)
    }

    /// Row of a length of the leg, times a sign.
    fn length_row(
        &self,
        model: &LegModel,
        length: Length,
        sign: f64,
        pulley: f64,
        leg: usize,
    ) -> Row {
        let gradient = model.pantograph.length_gradient(&self.pose, length) * sign;
        let (gx, gz, r) = (gradient.foot.x, gradient.foot.y, &self.foot);
        Row {
            leg,
            sagittal: Vector3::new(-gx, -gz, r.x * gz - r.z * gx),
            lateral: Vector3::new(0.0, -r.y * gz, r.y * gx),
            foot: gradient.foot,
            hip: gradient.hip,
            pulley,
        }
    }

    /// Rows of a contact: along the ground's normal and two tangents.
    pub(crate) fn contact_rows(
        &self,
        surface: &Surface,
        rotation: &Matrix3<f64>,
        leg: usize,
    ) -> [Row; 3] {
        let [first, second] = surface.tangents();
        [surface.normal, first, second].map(|direction| {
            let d = rotation.tr_mul(&direction);
            Row {
                leg,
                sagittal: Vector3::zeros(),
                lateral: self.sideways() * d.y,
                foot: Planar::new(d.x, d.z),
                hip: 0.0,
                pulley: 0.0,
            }
        })
    }
}

/// Friction torques of hip, knee and ankle \[N·m\].
fn joint_friction(model: &LegModel, velocity: &Velocity) -> [f64; 3] {
    let [w1, w2, w3] = velocity.omega;
    let JointFriction {
        hip, knee, ankle, ..
    } = model.friction;
    [hip * w1, knee * (w2 - w1), ankle * (w3 - w2)]
}

impl Row {
    /// Rate of the gap.
    pub(crate) fn rate(&self, state: &State) -> f64 {
        let (v, w, leg) = (state.velocity(), state.rate(), self.leg);
        self.sagittal.dot(&Vector3::new(v.x, v.z, w.y))
            + self.lateral.dot(&Vector3::new(v.y, w.x, w.z))
            + self.foot.dot(&state.foot_velocity(leg))
            + self.hip * state.hip_rate(leg)
            + self.pulley * state.pulley_rate(leg)
    }
}

//! Assembly of the robot in the engine, at a posture.

use nalgebra::Unit;
use rapier3d_f64::dynamics::{
    GenericJoint, GenericJointBuilder, ImpulseJointHandle, JointAxesMask, JointAxis, LockedAxes,
    MassProperties, MotorModel, RevoluteJointBuilder, RigidBodyBuilder, RigidBodyHandle,
    RopeJointBuilder, SpringJointBuilder,
};
use rapier3d_f64::geometry::{
    ColliderBuilder, ColliderHandle, Group, InteractionGroups, InteractionTestMode,
};
use rapier3d_f64::math::{Pose, Rotation, Vector};
use serde::{Deserialize, Serialize};
use twinrig_legged::{Base, LegPosture, Posture};

use crate::body_colliders::{self, BodyHandles};
use crate::conversion::{abducted, link_attitude, rotation, to_engine};
use crate::model::{BodyPoint, CABLE, Carrier, FOOT, KNEE_STOPS, Leg, Model, Point, ROPES, TRUNK};
use crate::options::{Joints, Options};
use crate::world::Sets;

/// Axis of the joints of a leg; positive angles swing forward.
pub(crate) const AXIS: Vector = Vector::new(0.0, -1.0, 0.0);

/// Axis of abduction on the trunk; positive angles swing to the left.
pub(crate) const ABDUCTION: Vector = Vector::X;

/// Index of the knee among the joints of a leg.
const KNEE: usize = 1;

/// Handles of the robot's parts in the engine.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Handles {
    pub(crate) trunk: RigidBodyHandle,
    pub(crate) legs: Vec<LegHandles>,
    /// Contact of trunk, knees and ankles, if they have any.
    pub(crate) body: Option<BodyHandles>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct LegHandles {
    pub(crate) segments: [RigidBodyHandle; 3],
    /// Carrier of a leg that abducts.
    pub(crate) carrier: Option<CarrierHandles>,
    /// None for the cable if there are no drives, and for stops that are limits of a joint.
    pub(crate) ropes: [Option<ImpulseJointHandle>; ROPES],
    pub(crate) hip: Option<ImpulseJointHandle>,
    /// Colliders of the foot and of the ground below it.
    pub(crate) contact: Option<[ColliderHandle; 2]>,
}

/// Handles of the carrier of a leg that abducts.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct CarrierHandles {
    pub(crate) body: RigidBodyHandle,
    /// Its hinge on the trunk, whose limits are the stops.
    pub(crate) hinge: ImpulseJointHandle,
    /// Motor, if it has a servo.
    pub(crate) drive: Option<ImpulseJointHandle>,
}

impl LegHandles {
    /// Returns the handle of a segment, or of the body above them.
    pub(crate) fn body(&self, trunk: RigidBodyHandle, body: usize) -> RigidBodyHandle {
        let above = || self.carrier.map_or(trunk, |carrier| carrier.body);
        self.segments.get(body).copied().unwrap_or_else(above)
    }
}

/// Initial pose and velocity of a body.
#[derive(Debug, Clone, Copy)]
struct Motion {
    pose: Pose,
    velocity: Vector,
    turning: Vector,
}

impl Motion {
    /// Returns the velocity of a point of the body, given in world coordinates.
    fn at(&self, point: Vector) -> Vector {
        self.velocity + self.turning.cross(point - self.pose.translation)
    }
}

/// Assembles the robot at a posture, whose attitude has a nonzero norm, with angle and rate of
/// abduction of each leg \[rad, rad/s\].
pub(crate) fn assemble(
    model: &Model,
    options: &Options,
    posture: &Posture,
    abduction: &[[f64; 2]],
) -> (Sets, Handles) {
    let mut sets = Sets::new();
    let attitude = rotation(posture.attitude).unwrap_or(Rotation::IDENTITY);
    let trunk = Motion {
        pose: Pose::from_parts(to_engine(&posture.position), attitude),
        velocity: to_engine(&posture.velocity),
        turning: attitude * to_engine(&posture.angular_velocity),
    };
    let handle = insert_trunk(model, options, &trunk, &mut sets);
    let mut legs = Vec::new();
    for (i, leg) in model.legs.iter().enumerate() {
        let at = posture.legs.iter().find(|(name, _)| *name == leg.name);
        let at = at.map_or_else(LegPosture::default, |(_, at)| *at);
        let carrier = leg.carrier.as_ref().map(|carrier| {
            insert_carrier(
                model,
                options,
                (carrier, abduction[i]),
                (&trunk, handle),
                &mut sets,
            )
        });
        let (above, on) = match &carrier {
            Some((motion, carrier)) => (motion, carrier.body),
            None => (&trunk, handle),
        };
        let parts = insert_leg(model, options, (i, leg, &at), (above, on), &mut sets);
        legs.push(LegHandles {
            carrier: carrier.map(|(_, carrier)| carrier),
            ..parts
        });
    }
    for (_, body) in sets.bodies.iter_mut() {
        // The engine would do so in its first step only, but `Machine::response` reads them before.
        body.recompute_mass_properties_from_colliders(&sets.colliders);
    }
    if options.joints == Joints::Multibody {
        set_tree_posture(model, posture, &trunk, handle, &mut sets);
    }
    let body_of = |point: &BodyPoint| {
        let leg = point.leg.map(|leg| &legs[leg]);
        leg.map_or(handle, |leg: &LegHandles| {
            leg.body(handle, point.point.body)
        })
    };
    let body = body_colliders::insert(model, body_of, &mut sets);
    let handles = Handles {
        trunk: handle,
        legs,
        body,
    };
    if options.step_only {
        insert_springs(model, &handles, &mut sets);
    }
    (sets, handles)
}

fn insert_trunk(
    model: &Model,
    options: &Options,
    trunk: &Motion,
    sets: &mut Sets,
) -> RigidBodyHandle {
    if model.base == Base::Fixed {
        return sets
            .bodies
            .insert(RigidBodyBuilder::fixed().pose(trunk.pose));
    }
    let mut body = dynamic(trunk, model.mass, model.inertia);
    if model.base == Base::Free {
        return sets.bodies.insert(body);
    }
    if options.joints == Joints::Impulse {
        let locked = LockedAxes::TRANSLATION_LOCKED_Y
            | LockedAxes::ROTATION_LOCKED_X
            | LockedAxes::ROTATION_LOCKED_Z;
        body = body.locked_axes(locked);
    }
    let handle = sets.bodies.insert(body);
    if options.joints == Joints::Multibody {
        let world = sets.bodies.insert(RigidBodyBuilder::fixed());
        let plane = JointAxesMask::LIN_Y | JointAxesMask::ANG_X | JointAxesMask::ANG_Z;
        let joint = GenericJointBuilder::new(plane).build();
        sets.multibody_joints.insert(world, handle, joint, true);
    }
    handle
}

/// Returns a body with the centre of mass at its origin.
fn dynamic(motion: &Motion, mass: f64, inertia: Vector) -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic()
        .pose(motion.pose)
        .linvel(motion.velocity)
        .angvel(motion.turning)
        .additional_mass_properties(MassProperties::new(Vector::ZERO, mass, inertia))
        .gyroscopic_forces_enabled(true)
        .allow_fast_rotation(true)
        .can_sleep(false)
}

/// Inserts a carrier with its hinge at an angle and a rate \[rad, rad/s\].
fn insert_carrier(
    model: &Model,
    options: &Options,
    (carrier, [angle, rate]): (&Carrier, [f64; 2]),
    (trunk, on): (&Motion, RigidBodyHandle),
    sets: &mut Sets,
) -> (Motion, CarrierHandles) {
    let place = trunk.pose.transform_point(carrier.place);
    let motion = Motion {
        pose: Pose::from_parts(place, trunk.pose.rotation * abducted(angle)),
        velocity: trunk.at(place),
        turning: trunk.turning + trunk.pose.rotation * ABDUCTION * rate,
    };
    let inertia = Vector::splat(carrier.moment);
    let body = sets.bodies.insert(dynamic(&motion, carrier.mass, inertia));
    let hinge = RevoluteJointBuilder::new(ABDUCTION)
        .local_anchor1(carrier.place)
        .local_anchor2(Vector::ZERO)
        .limits(carrier.axis.range);
    let mut hinge: GenericJoint = hinge.build().into();
    hinge.softness = options.solver.joint_softness.coefficients();
    let hinge = sets.impulse_joints.insert(on, body, hinge, true);
    let drive = model
        .abduction
        .map(|_| insert_drive(ABDUCTION, [on, body], sets));
    (motion, CarrierHandles { body, hinge, drive })
}

/// Inserts a motor about an axis of both bodies.
fn insert_drive(
    axis: Vector,
    [on, body]: [RigidBodyHandle; 2],
    sets: &mut Sets,
) -> ImpulseJointHandle {
    let drive = GenericJointBuilder::new(JointAxesMask::empty())
        .local_axis1(axis)
        .local_axis2(axis)
        .motor_model(JointAxis::AngX, MotorModel::ForceBased)
        .build();
    sets.impulse_joints.insert(on, body, drive, true)
}

/// Inserts a leg below the body `on`.
fn insert_leg(
    model: &Model,
    options: &Options,
    (i, leg, at): (usize, &Leg, &LegPosture),
    (base, on): (&Motion, RigidBodyHandle),
    sets: &mut Sets,
) -> LegHandles {
    let mut above = *base;
    let mut joint = base.pose.transform_point(leg.hip);
    let mut handles = [on; 3];
    for (k, segment) in leg.segments.iter().enumerate() {
        let attitude = base.pose.rotation * link_attitude(at.angles[k]);
        let down = attitude * Vector::new(0.0, 0.0, -1.0);
        let turning = base.turning + base.pose.rotation * AXIS * at.rates[k];
        let centre = joint + down * segment.centre;
        let motion = Motion {
            pose: Pose::from_parts(centre, attitude),
            velocity: above.at(joint) + turning.cross(centre - joint),
            turning,
        };
        let along = options.axial_share * segment.moment;
        let inertia = Vector::new(segment.moment, segment.moment, along);
        handles[k] = sets.bodies.insert(dynamic(&motion, segment.mass, inertia));
        let upper = if k == 0 { on } else { handles[k - 1] };
        let revolute = RevoluteJointBuilder::new(AXIS)
            .local_anchor1(above.pose.inverse_transform_point(joint))
            .local_anchor2(Vector::new(0.0, 0.0, segment.centre));
        let mut revolute: GenericJoint = revolute.build().into();
        // The anchor on the upper body is the exact one of the model, without the posture's
        // rounding.
        let anchor = if k == 0 {
            leg.hip
        } else {
            let upper = &leg.segments[k - 1];
            Vector::new(0.0, 0.0, upper.centre - upper.length)
        };
        revolute.set_local_anchor1(anchor);
        revolute.softness = options.solver.joint_softness.coefficients();
        if options.step_only {
            complete_joint(&mut revolute, leg, k);
        }
        match options.joints {
            Joints::Impulse => {
                sets.impulse_joints
                    .insert(upper, handles[k], revolute, true);
            }
            Joints::Multibody => {
                sets.multibody_joints
                    .insert(upper, handles[k], revolute, true);
            }
        }
        joint += down * segment.length;
        above = motion;
    }
    let ropes = insert_ropes(model, options, leg, (on, handles), sets);
    LegHandles {
        segments: handles,
        carrier: None,
        ropes,
        hip: model
            .drives
            .is_some()
            .then(|| insert_drive(AXIS, [on, handles[0]], sets)),
        contact: insert_foot(model, leg, i, handles[2], sets),
    }
}

fn insert_ropes(
    model: &Model,
    options: &Options,
    leg: &Leg,
    (trunk, segments): (RigidBodyHandle, [RigidBodyHandle; 3]),
    sets: &mut Sets,
) -> [Option<ImpulseJointHandle>; ROPES] {
    let body = |body: usize| if body == TRUNK { trunk } else { segments[body] };
    std::array::from_fn(|k| {
        let is_limit = options.step_only && KNEE_STOPS.contains(&k);
        if is_limit || (k == CABLE && model.drives.is_none()) {
            return None;
        }
        let rope = &leg.ropes[k];
        let [from, to] = rope.ends;
        let mut joint: GenericJoint = match options.joints {
            Joints::Impulse => RopeJointBuilder::new(rope.length).build().into(),
            Joints::Multibody => GenericJoint::default(),
        };
        joint.set_local_anchor1(from.at).set_local_anchor2(to.at);
        joint.softness = options.solver.joint_softness.coefficients();
        Some(
            sets.impulse_joints
                .insert(body(from.body), body(to.body), joint, true),
        )
    })
}

fn insert_foot(
    model: &Model,
    leg: &Leg,
    i: usize,
    segment: RigidBodyHandle,
    sets: &mut Sets,
) -> Option<[ColliderHandle; 2]> {
    let ground = model.ground.as_ref()?;
    let groups = |member: usize, other: usize| {
        let bit = |n: usize| Group::from_bits_truncate(1 << n);
        InteractionGroups::new(bit(member), bit(other), InteractionTestMode::And)
    };
    // Each foot collides with its own ground plane only.
    let [foot, floor] = [2 * i, 2 * i + 1];
    let configured = |builder: ColliderBuilder, groups| {
        builder
            .density(0.0)
            .friction(ground.friction)
            .restitution(ground.restitution)
            .collision_groups(groups)
    };
    let ball =
        configured(ColliderBuilder::ball(FOOT), groups(foot, floor)).translation(leg.foot.at);
    let ball = sets
        .colliders
        .insert_with_parent(ball, segment, &mut sets.bodies);
    let plane = configured(
        ColliderBuilder::halfspace(Unit::new_unchecked(Vector::Z)),
        groups(floor, foot),
    )
    .translation(Vector::new(0.0, 0.0, -FOOT));
    Some([ball, sets.colliders.insert(plane)])
}

/// Sets the tree to the posture: its coordinates are zero with all links in line below the trunk.
fn set_tree_posture(
    model: &Model,
    posture: &Posture,
    trunk: &Motion,
    handle: RigidBodyHandle,
    sets: &mut Sets,
) {
    let (mut places, mut rates) = (Vec::new(), Vec::new());
    match model.base {
        Base::Fixed => {}
        Base::Free => {
            places.extend([0.0; 6]);
            rates.extend(trunk.velocity.to_array());
            rates.extend(trunk.turning.to_array());
        }
        Base::Planar => {
            let [w, _, y, _] = posture.attitude;
            let at = trunk.pose.translation;
            places.extend([at.x, at.z, 2.0 * libm::atan2(y, w)]);
            rates.extend([trunk.velocity.x, trunk.velocity.z, trunk.turning.y]);
        }
    }
    for leg in &model.legs {
        let at = posture.legs.iter().find(|(name, _)| *name == leg.name);
        let at = at.map_or_else(LegPosture::default, |(_, at)| *at);
        let relative = |of: [f64; 3]| [of[0], of[1] - of[0], of[2] - of[1]];
        places.extend(relative(at.angles));
        rates.extend(relative(at.rates));
    }
    let Some(link) = sets.multibody_joints.rigid_body_link(handle).copied() else {
        return;
    };
    if let Some(tree) = sets.multibody_joints.get_multibody_mut(link.multibody) {
        tree.forward_kinematics(&sets.bodies, true);
        // By default the engine damps every revolute joint.
        tree.damping_mut().fill(0.0);
        tree.apply_displacements(&places);
        tree.generalized_velocity_mut().copy_from_slice(&rates);
        tree.forward_kinematics(&sets.bodies, false);
        tree.update_rigid_bodies(&mut sets.bodies, true);
    }
}

/// Adds friction, and the stops of the knee, to the revolute joint above segment `k`.
fn complete_joint(joint: &mut GenericJoint, leg: &Leg, k: usize) {
    joint
        .set_motor_model(JointAxis::AngX, MotorModel::ForceBased)
        .set_motor_velocity(JointAxis::AngX, 0.0, leg.friction[k]);
    if k == KNEE {
        joint.set_limits(JointAxis::AngX, leg.knee_range());
    }
}

/// Inserts the springs as joints.
fn insert_springs(model: &Model, handles: &Handles, sets: &mut Sets) {
    for (leg, at) in model.legs.iter().zip(&handles.legs) {
        let body = |point: &Point| at.body(handles.trunk, point.body);
        for spring in &leg.springs {
            let [from, to] = &spring.ends;
            let joint = SpringJointBuilder::new(spring.rest, spring.stiffness, 0.0)
                .local_anchor1(from.at)
                .local_anchor2(to.at);
            sets.impulse_joints
                .insert(body(from), body(to), joint, true);
        }
    }
}

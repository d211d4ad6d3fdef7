//! Colliders of trunk, knees and ankles, on level ground.

use nalgebra::Unit;
use rapier3d_f64::dynamics::{CoefficientCombineRule, RigidBodyHandle};
use rapier3d_f64::geometry::{
    ColliderBuilder, ColliderHandle, Group, InteractionGroups, InteractionTestMode,
};
use rapier3d_f64::math::Vector;
use serde::{Deserialize, Serialize};

use crate::model::{BodyPoint, FOOT, Model};
use crate::world::Sets;

/// Colliders of the contact points, and of the ground below all of them.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct BodyHandles {
    pub(crate) balls: Vec<ColliderHandle>,
    pub(crate) floor: ColliderHandle,
}

/// Groups of the points and of their ground; those of the feet begin at the other end.
const GROUPS: [Group; 2] = [Group::GROUP_31, Group::GROUP_32];

/// Coefficient of the ground below the points, of which the lesser one of ground and point counts.
const ROUGH: f64 = 1e3;

/// Inserts the colliders of the points, if there are any; `body` returns the body of one.
pub(crate) fn insert(
    model: &Model,
    body: impl Fn(&BodyPoint) -> RigidBodyHandle,
    sets: &mut Sets,
) -> Option<BodyHandles> {
    let ground = model.ground.as_ref().filter(|_| !model.body.is_empty())?;
    let [member, other] = GROUPS;
    let groups = |of, with| InteractionGroups::new(of, with, InteractionTestMode::And);
    let configured = |builder: ColliderBuilder, friction: f64, groups| {
        builder
            .density(0.0)
            .friction(friction)
            .friction_combine_rule(CoefficientCombineRule::Min)
            .restitution(ground.restitution)
            .collision_groups(groups)
    };
    let balls = model.body.iter().map(|of| {
        let ball = ColliderBuilder::ball(FOOT).translation(of.point.at);
        let ball = configured(ball, ground.friction, groups(member, other));
        sets.colliders
            .insert_with_parent(ball, body(of), &mut sets.bodies)
    });
    let balls = balls.collect();
    let plane = ColliderBuilder::halfspace(Unit::new_unchecked(Vector::Z))
        .translation(Vector::new(0.0, 0.0, -FOOT));
    let floor = sets
        .colliders
        .insert(configured(plane, ROUGH, groups(other, member)));
    Some(BodyHandles { balls, floor })
}

//! Detection of diverged values, and the names of their joints and actuators.

use mujoco_rs::prelude::{MjModel, MjtJoint, MjtObjBase};

/// Magnitude from which MuJoCo regards a value as diverged.
const MAX_MAGNITUDE: f64 = 1e10;

/// Degrees of freedom of a free joint, in MuJoCo's order.
const FREE_JOINT_AXES: [&str; 6] = [
    "x of ",
    "y of ",
    "z of ",
    "the rotation about x of ",
    "the rotation about y of ",
    "the rotation about z of ",
];

/// Returns the index of the first diverged value.
pub(crate) fn first_index(numbers: &[f64]) -> Option<usize> {
    numbers
        .iter()
        .position(|x| x.is_nan() || x.abs() >= MAX_MAGNITUDE)
}

/// Returns the name of a degree of freedom.
pub(crate) fn dof_name(model: &MjModel, dof: usize) -> String {
    let joint = usize::try_from(model.dof_jntid()[dof]).unwrap_or(0);
    let free = model.jnt_type()[joint] == MjtJoint::mjJNT_FREE;
    let first = usize::try_from(model.jnt_dofadr()[joint]).unwrap_or(dof);
    let axis = FREE_JOINT_AXES.get(dof - first).filter(|_| free);
    format!("{}{}", axis.unwrap_or(&""), joint_name(model, joint))
}

/// Returns the name of the joint of a position coordinate.
pub(crate) fn position_name(model: &MjModel, position: usize) -> String {
    let mut starts = model.jnt_qposadr().iter();
    let after = starts.position(|&start| usize::try_from(start).is_ok_and(|s| s > position));
    joint_name(model, after.unwrap_or(model.jnt_type().len()) - 1)
}

/// Returns the name of the actuator of a control.
pub(crate) fn actuator_name(model: &MjModel, id: usize) -> String {
    let name = element_name(model, MjtObjBase::mjOBJ_ACTUATOR, id);
    name.unwrap_or_else(|| format!("actuator number {id}"))
}

/// Returns the name of a joint; for a joint without one, its type and its body.
fn joint_name(model: &MjModel, joint: usize) -> String {
    let unnamed = || {
        let kind = match model.jnt_type()[joint] {
            MjtJoint::mjJNT_FREE => "free joint",
            MjtJoint::mjJNT_BALL => "ball joint",
            MjtJoint::mjJNT_SLIDE => "slide joint",
            MjtJoint::mjJNT_HINGE => "hinge",
        };
        let body = usize::try_from(model.jnt_bodyid()[joint]).unwrap_or(0);
        let body = element_name(model, MjtObjBase::mjOBJ_BODY, body)
            .unwrap_or_else(|| format!("body number {body}"));
        format!("the {kind} of {body}")
    };
    element_name(model, MjtObjBase::mjOBJ_JOINT, joint).unwrap_or_else(unnamed)
}

fn element_name(model: &MjModel, kind: MjtObjBase, id: usize) -> Option<String> {
    let name = model.id_to_name(kind, id).filter(|name| !name.is_empty());
    name.map(str::to_owned)
}

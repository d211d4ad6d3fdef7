//! Numbers gone wild, and whose they are.

use mujoco_rs::prelude::{MjModel, MjtJoint, MjtObjBase};

/// Beyond this MuJoCo takes a number for gone wild.
const WILD: f64 = 1e10;

/// The ways that a free joint can go, in MuJoCo's order.
const WAYS: [&str; 6] = [
    "x of ",
    "y of ",
    "z of ",
    "the turn about x of ",
    "the turn about y of ",
    "the turn about z of ",
];

/// The first number that is wild.
pub(crate) fn first(numbers: &[f64]) -> Option<usize> {
    numbers.iter().position(|x| x.is_nan() || x.abs() >= WILD)
}

/// Whose velocity or acceleration number `dof` is.
pub(crate) fn dof(model: &MjModel, dof: usize) -> String {
    let joint = usize::try_from(model.dof_jntid()[dof]).unwrap_or(0);
    let free = model.jnt_type()[joint] == MjtJoint::mjJNT_FREE;
    let first = usize::try_from(model.jnt_dofadr()[joint]).unwrap_or(dof);
    let way = WAYS.get(dof - first).filter(|_| free);
    format!("{}{}", way.unwrap_or(&""), named(model, joint))
}

/// Whose position number `place` is.
pub(crate) fn place(model: &MjModel, place: usize) -> String {
    let mut starts = model.jnt_qposadr().iter();
    let after = starts.position(|&start| usize::try_from(start).is_ok_and(|s| s > place));
    named(model, after.unwrap_or(model.jnt_type().len()) - 1)
}

/// The actuator that control number `id` belongs to.
pub(crate) fn actuator(model: &MjModel, id: usize) -> String {
    let name = of(model, MjtObjBase::mjOBJ_ACTUATOR, id);
    name.unwrap_or_else(|| format!("actuator number {id}"))
}

/// What a joint is called; one without a name by what it is and by the body that it moves.
fn named(model: &MjModel, joint: usize) -> String {
    let unnamed = || {
        let kind = match model.jnt_type()[joint] {
            MjtJoint::mjJNT_FREE => "free joint",
            MjtJoint::mjJNT_BALL => "ball joint",
            MjtJoint::mjJNT_SLIDE => "slide joint",
            MjtJoint::mjJNT_HINGE => "hinge",
        };
        let body = usize::try_from(model.jnt_bodyid()[joint]).unwrap_or(0);
        let body = of(model, MjtObjBase::mjOBJ_BODY, body)
            .unwrap_or_else(|| format!("body number {body}"));
        format!("the {kind} of {body}")
    };
    of(model, MjtObjBase::mjOBJ_JOINT, joint).unwrap_or_else(unnamed)
}

fn of(model: &MjModel, kind: MjtObjBase, id: usize) -> Option<String> {
    let name = model.id_to_name(kind, id).filter(|name| !name.is_empty());
    name.map(str::to_owned)
}

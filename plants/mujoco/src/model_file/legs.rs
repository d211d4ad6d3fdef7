//! Legs of a model, from the names of its signals.

use mujoco_rs::prelude::{MjModel, MjtObjBase, MjtTrn};

use crate::engine::Engine;
use crate::model_file::signals::{ElementKind, ModelSignals};
use crate::model_file::source::position;
use twinrig_kernel::signal;

/// A leg in the names of signals: `leg/LF/…`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leg {
    /// `LF`.
    pub name: String,
    /// Whether it is ahead of the centre of mass at the start, along x.
    pub fore: bool,
    /// Whether it is to the left of it, along y.
    pub left: bool,
}

/// Returns the legs in the order of their first occurrence in `signals`, and their bodies. `Err` is
/// the name of a leg none of whose elements has a position.
pub(crate) fn legs(
    engine: &Engine,
    signals: &ModelSignals,
) -> Result<(Vec<Leg>, Vec<usize>), String> {
    let (mut legs, mut bodies): (Vec<Leg>, Vec<usize>) = (Vec::new(), Vec::new());
    let elements: Vec<(&str, ElementKind, &str)> = elements(signals).collect();
    for &(signal, ..) in &elements {
        let Some(name) = leg_of(signal) else {
            continue;
        };
        if legs.iter().any(|leg| leg.name == name) {
            continue;
        }
        let mut of_leg = elements
            .iter()
            .filter(|(signal, ..)| leg_of(signal) == Some(name));
        let found = of_leg.find_map(|&(_, kind, name)| {
            let id = kind.find(engine.model(), name)?;
            location(engine, kind, id)
        });
        let (body, at) = found.ok_or_else(|| name.to_owned())?;
        let centre = engine.data().subtree_com()[root(engine.model(), body)];
        legs.push(Leg {
            name: name.to_owned(),
            fore: at[0] >= centre[0],
            left: at[1] >= centre[1],
        });
        bodies.push(body);
    }
    Ok((legs, bodies))
}

/// Returns the weight of the trees that contain `bodies`, of all bodies if the list is empty \[N\].
pub(crate) fn weight(model: &MjModel, bodies: &[usize]) -> f64 {
    let [x, y, z] = model.opt().gravity;
    let gravity = (x * x + y * y + z * z).sqrt();
    let mut roots: Vec<usize> = bodies.iter().map(|&body| root(model, body)).collect();
    roots.sort_unstable();
    roots.dedup();
    if roots.is_empty() {
        // Body 0 is the world, the root of all trees.
        roots.push(0);
    }
    let masses = roots.iter().map(|&root| model.body_subtreemass()[root]);
    gravity * masses.sum::<f64>()
}

fn elements(signals: &ModelSignals) -> impl Iterator<Item = (&str, ElementKind, &str)> {
    let outputs = signals.outputs.iter();
    let outputs =
        outputs.map(|output| (output.signal.as_str(), output.thing, output.name.as_str()));
    let inputs = signals.inputs.iter();
    let inputs = inputs.map(|input| {
        (
            input.signal.as_str(),
            ElementKind::Actuator,
            input.actuator.as_str(),
        )
    });
    outputs.chain(inputs)
}

fn leg_of(signal: &str) -> Option<&str> {
    let (leg, _) = signal::parse_leg(signal)?;
    Some(leg)
}

fn root(model: &MjModel, body: usize) -> usize {
    usize::try_from(model.body_rootid()[body]).unwrap_or(0)
}

/// Returns the body and the present position of an element; none for elements without a position.
fn location(engine: &Engine, kind: ElementKind, id: usize) -> Option<(usize, [f64; 3])> {
    let (model, data) = (engine.model(), engine.data());
    let body = |bodies: &[i32]| usize::try_from(*bodies.get(id)?).ok();
    match kind {
        ElementKind::Joint => Some((body(model.jnt_bodyid())?, data.xanchor()[id])),
        ElementKind::Body => Some((id, position(data, kind, id))),
        ElementKind::Site => Some((body(model.site_bodyid())?, position(data, kind, id))),
        ElementKind::Geom => Some((body(model.geom_bodyid())?, position(data, kind, id))),
        ElementKind::Actuator => {
            let on = usize::try_from(model.actuator_trnid()[id][0]).ok()?;
            let kind = match model.actuator_trntype()[id] {
                MjtTrn::mjTRN_JOINT | MjtTrn::mjTRN_JOINTINPARENT => ElementKind::Joint,
                MjtTrn::mjTRN_SITE => ElementKind::Site,
                MjtTrn::mjTRN_BODY => ElementKind::Body,
                _ => return None,
            };
            location(engine, kind, on)
        }
        ElementKind::Sensor => {
            let on = usize::try_from(model.sensor_objid()[id]).ok()?;
            let kind = match model.sensor_objtype()[id] {
                MjtObjBase::mjOBJ_JOINT => ElementKind::Joint,
                MjtObjBase::mjOBJ_SITE => ElementKind::Site,
                MjtObjBase::mjOBJ_GEOM => ElementKind::Geom,
                MjtObjBase::mjOBJ_BODY | MjtObjBase::mjOBJ_XBODY => ElementKind::Body,
                MjtObjBase::mjOBJ_ACTUATOR => ElementKind::Actuator,
                _ => return None,
            };
            location(engine, kind, on)
        }
    }
}

//! The legs that the names of signals speak of, and where they are in the model.

use mujoco_rs::prelude::{MjModel, MjtObjBase, MjtTrn};

use crate::engine::Engine;
use crate::model_file::signals::{ElementKind, ModelSignals};
use crate::model_file::source::position;

/// A leg, as the names of its signals have it: `leg/LF/…`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Leg {
    /// `LF`.
    pub name: String,
    /// Whether it is before the centre of mass at the start, along x.
    pub fore: bool,
    /// Whether it is to the left of it, along y.
    pub left: bool,
}

/// The legs of the signals of `signals`, in the order in which these name them, and the bodies that they are at. `Err` is one
/// of which nothing has a place.
pub(crate) fn legs(
    engine: &Engine,
    signals: &ModelSignals,
) -> Result<(Vec<Leg>, Vec<usize>), String> {
    let (mut legs, mut bodies): (Vec<Leg>, Vec<usize>) = (Vec::new(), Vec::new());
    let things: Vec<(&str, ElementKind, &str)> = things(signals).collect();
    for &(signal, ..) in &things {
        let Some(name) = leg_of(signal) else {
            continue;
        };
        if legs.iter().any(|leg| leg.name == name) {
            continue;
        }
        let mut of_leg = things
            .iter()
            .filter(|(signal, ..)| leg_of(signal) == Some(name));
        let found = of_leg.find_map(|&(_, thing, called)| {
            let id = thing.find(engine.model(), called)?;
            placed(engine, thing, id)
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

/// Weight of the trees that `bodies` are in, of all if there are none \[N\].
pub(crate) fn weight(model: &MjModel, bodies: &[usize]) -> f64 {
    let [x, y, z] = model.opt().gravity;
    let gravity = (x * x + y * y + z * z).sqrt();
    let mut roots: Vec<usize> = bodies.iter().map(|&body| root(model, body)).collect();
    roots.sort_unstable();
    roots.dedup();
    if roots.is_empty() {
        // The world is body 0, and everything is in its tree.
        roots.push(0);
    }
    let masses = roots.iter().map(|&root| model.body_subtreemass()[root]);
    gravity * masses.sum::<f64>()
}

fn things(signals: &ModelSignals) -> impl Iterator<Item = (&str, ElementKind, &str)> {
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
    let (leg, _) = signal.strip_prefix("leg/")?.split_once('/')?;
    Some(leg)
}

fn root(model: &MjModel, body: usize) -> usize {
    usize::try_from(model.body_rootid()[body]).unwrap_or(0)
}

/// The body of a thing, and where the thing is now; none for what is nowhere.
fn placed(engine: &Engine, thing: ElementKind, id: usize) -> Option<(usize, [f64; 3])> {
    let (model, data) = (engine.model(), engine.data());
    let body = |bodies: &[i32]| usize::try_from(*bodies.get(id)?).ok();
    match thing {
        ElementKind::Joint => Some((body(model.jnt_bodyid())?, data.xanchor()[id])),
        ElementKind::Body => Some((id, position(data, thing, id))),
        ElementKind::Site => Some((body(model.site_bodyid())?, position(data, thing, id))),
        ElementKind::Geom => Some((body(model.geom_bodyid())?, position(data, thing, id))),
        ElementKind::Actuator => {
            let on = usize::try_from(model.actuator_trnid()[id][0]).ok()?;
            let thing = match model.actuator_trntype()[id] {
                MjtTrn::mjTRN_JOINT | MjtTrn::mjTRN_JOINTINPARENT => ElementKind::Joint,
                MjtTrn::mjTRN_SITE => ElementKind::Site,
                MjtTrn::mjTRN_BODY => ElementKind::Body,
                _ => return None,
            };
            placed(engine, thing, on)
        }
        ElementKind::Sensor => {
            let on = usize::try_from(model.sensor_objid()[id]).ok()?;
            let thing = match model.sensor_objtype()[id] {
                MjtObjBase::mjOBJ_JOINT => ElementKind::Joint,
                MjtObjBase::mjOBJ_SITE => ElementKind::Site,
                MjtObjBase::mjOBJ_GEOM => ElementKind::Geom,
                MjtObjBase::mjOBJ_BODY | MjtObjBase::mjOBJ_XBODY => ElementKind::Body,
                MjtObjBase::mjOBJ_ACTUATOR => ElementKind::Actuator,
                _ => return None,
            };
            placed(engine, thing, on)
        }
    }
}

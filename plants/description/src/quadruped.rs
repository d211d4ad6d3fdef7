//! Recognition of a quadruped in a tree: trunk, four legs of two or three segments.

mod bend;
mod chain;
mod leg;

use nalgebra::Vector3;
use twinrig_document::Problem;

use crate::tree::{Freedom, Inertial, Tree};
pub(crate) use bend::Bend;
use chain::{Chain, chains};
pub(crate) use leg::{Abduction, Leg};

/// A quadruped, in the frame of its centre of mass.
#[derive(Debug)]
pub(crate) struct Quadruped {
    pub(crate) trunk: Inertial,
    /// Edges of the trunk, if known \[m\].
    pub(crate) size: Option<[f64; 3]>,
    /// LF, RF, LH and RH.
    pub(crate) legs: Vec<Leg>,
    /// Properties that the robot file cannot express.
    pub(crate) notes: Vec<String>,
}

/// Greatest product of inertia of a trunk that goes unsaid, as a share of the greatest moment.
const PRODUCT_UNSAID: f64 = 1e-3;

/// Recognises the quadruped of a tree.
pub(crate) fn quadruped(tree: Tree) -> Result<Quadruped, Problem> {
    let tree = tree.without_fixed_joints();
    let children = tree.children();
    let root = trunk(&tree, &children)?;
    let mut notes = Vec::new();
    let chains = chains(&tree, &children, root)?;
    let mut trunk = tree.bodies[root].inertial;
    for chain in chains.iter().filter(|chain| chain.has_abducting_mass()) {
        trunk = trunk.with(&chain.abducting);
    }
    if trunk.mass <= 0.0 {
        let message = "the trunk has no mass";
        return Err(Problem::at(&tree.bodies[root].place, message, ""));
    }
    let inertia = trunk.inertia;
    let greatest = (0..3).map(|i| inertia[(i, i)]).fold(0.0, f64::max);
    let products = [(0, 1), (0, 2), (1, 2)].map(|at| inertia[at].abs());
    if products.into_iter().fold(0.0, f64::max) > PRODUCT_UNSAID * greatest {
        notes.push("products of inertia of the trunk are left out".to_owned());
    }
    let mut legs = named(&tree, &chains, trunk.centre, &mut notes)?;
    abductions(&chains, &mut legs, &mut notes);
    Ok(Quadruped {
        trunk,
        size: tree.bodies[root].size,
        legs,
        notes,
    })
}

/// Keeps the joints of abduction if all legs have them, else locks them, with a note.
fn abductions(chains: &[Chain], legs: &mut [Leg], notes: &mut Vec<String>) {
    if chains.iter().all(|chain| chain.abductions.is_empty()) {
        return;
    }
    if !legs.iter().all(|leg| leg.abduction.is_some()) {
        for leg in legs {
            leg.abduction = None;
        }
        notes.push(
            "the joints of hip abduction are locked at zero: of each leg, one with limits on both \
             sides of zero would be a joint of the robot file"
                .to_owned(),
        );
    }
    if chains.iter().any(Chain::has_abducting_mass) {
        notes.push("the mass of parts that abduct above the hip is that of the trunk".to_owned());
    }
}

/// Returns the index of the trunk: the root, or the only body that moves freely from a root without
/// mass.
fn trunk(tree: &Tree, children: &[Vec<usize>]) -> Result<usize, Problem> {
    let mut root = 0;
    loop {
        let mut free = children[root].iter().copied().filter(|child| {
            let joint = tree.bodies[*child].joint.as_ref();
            let is_world = tree.bodies[root].inertial.mass <= 0.0;
            is_world && joint.is_some_and(|joint| joint.freedom == Freedom::Free)
        });
        let Some(first) = free.next() else {
            return Ok(root);
        };
        if let Some(second) = free.next() {
            let (one, other) = (&tree.bodies[first], &tree.bodies[second]);
            let message = format!(
                "`{}` and `{}` both move freely: these are two robots",
                one.name, other.name
            );
            return Err(Problem::at(&other.place, message, "leave one of them"));
        }
        root = first;
    }
}

/// Names the legs by the corners at which they are.
fn named(
    tree: &Tree,
    chains: &[Chain],
    centre: Vector3<f64>,
    notes: &mut Vec<String>,
) -> Result<Vec<Leg>, Problem> {
    if chains.len() != 4 {
        let count = chains.len();
        let message = format!("a quadruped has four legs; this trunk has {count}");
        let help = "a leg is a chain of hinges; other parts must be fixed to the trunk";
        return Err(Problem::at(&tree.place, message, help));
    }
    let count = chains.len() as f64;
    let middle: Vector3<f64> = chains.iter().map(|chain| chain.hip / count).sum();
    let mut legs = Vec::new();
    for (name, fore, left) in [
        ("LF", true, true),
        ("RF", true, false),
        ("LH", false, true),
        ("RH", false, false),
    ] {
        let at_corner = |chain: &&Chain| {
            let at = chain.hip - middle;
            (at.x > 0.0) == fore && (at.y > 0.0) == left
        };
        let mut found = chains.iter().filter(at_corner);
        let (Some(chain), None) = (found.next(), found.next()) else {
            let message = format!("no leg, or more than one, is at the corner {name} of the trunk");
            let help = "x must be forward and y left; each corner has one hip";
            return Err(Problem::at(&tree.place, message, help));
        };
        legs.push(chain.leg(name, centre)?);
    }
    if chains
        .iter()
        .any(|chain| chain.leg("", centre).is_ok_and(|leg| leg.bend.is_backward))
    {
        notes.push(
            "a knee bends backward: the leg of the robot file is its mirror image, with the same reach"
                .to_owned(),
        );
    }
    if legs.iter().any(|leg| leg.is_divided) {
        notes.push(
            "legs have two segments: the first is divided in halves, between which the second is \
             mounted; foot positions are the same, and the distribution of mass is not"
                .to_owned(),
        );
    }
    if chains.iter().any(|chain| chain.sideways.abs() > 1e-9) {
        notes.push(
            "segments are displaced sideways: hips are in the plane of their feet".to_owned(),
        );
    }
    Ok(legs)
}

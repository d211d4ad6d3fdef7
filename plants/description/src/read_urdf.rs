//! URDF as a tree.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::{Matrix3, Vector3};
use roxmltree::Node;
use twinrig_document::{Problem, suggestion};

use crate::tree::{Body, Frame, Freedom, Inertial, Joint, Tree, turn};
use crate::xml::{Text, child, children};

/// Reads the tree of a URDF.
pub(crate) fn tree(text: Text<'_>) -> Result<Tree, Problem> {
    let document = text.parse("robot")?;
    let robot = document.root_element();
    refuse_xacro(text, robot)?;
    let mut links = BTreeMap::new();
    for link in children(robot, "link") {
        let name = text.required(link, "name")?;
        if links.insert(name, link).is_some() {
            let message = format!("two links are named `{name}`");
            return Err(text.problem(link, message, "names of links must be unique"));
        }
    }
    if links.is_empty() {
        return Err(text.problem(robot, "the robot has no links", ""));
    }
    // Joint above and joints below each link.
    let mut above = BTreeMap::new();
    let mut below: BTreeMap<&str, Vec<(Node, &str)>> = BTreeMap::new();
    for joint in children(robot, "joint") {
        let parent = end(text, joint, "parent", &links)?;
        let child = end(text, joint, "child", &links)?;
        if above.insert(child, joint).is_some() {
            let message = format!("the link `{child}` has two parents");
            return Err(text.problem(joint, message, "links and joints must be a tree"));
        }
        below.entry(parent).or_default().push((joint, child));
    }
    let mut roots = links.keys().filter(|name| !above.contains_key(*name));
    let Some(root) = roots.next() else {
        let message = "every link has a parent: the joints are a loop";
        return Err(text.problem(robot, message, "links and joints must be a tree"));
    };
    if let Some(other) = roots.next() {
        let message = format!("`{root}` and `{other}` have no parent: these are two robots");
        return Err(text.problem(links[other], message, "add the joint that connects them"));
    }
    let mut bodies = vec![body(text, links[root], root, None)?];
    let mut open = VecDeque::from([(*root, 0)]);
    while let Some((name, parent)) = open.pop_front() {
        for (joint, child) in below.get(name).into_iter().flatten() {
            open.push_back((child, bodies.len()));
            let joint = self::joint(text, *joint, parent)?;
            bodies.push(body(text, links[child], child, Some(joint))?);
        }
    }
    if bodies.len() < links.len() {
        let message = "some joints are a loop, apart from the root";
        return Err(text.problem(robot, message, "links and joints must be a tree"));
    }
    Ok(Tree {
        name: robot.attribute("name").unwrap_or_default().to_owned(),
        place: text.place(robot),
        bodies,
    })
}

fn refuse_xacro(text: Text<'_>, robot: Node<'_, '_>) -> Result<(), Problem> {
    let mut nodes = robot.descendants();
    let is_xacro = |node: &Node| {
        let space = node.tag_name().namespace();
        space.is_some_and(|space| space.contains("xacro"))
    };
    match nodes.find(is_xacro) {
        None => Ok(()),
        Some(node) => Err(text.problem(
            node,
            "this is xacro, a language that writes URDF",
            "expand it first: xacro FILE > robot.urdf",
        )),
    }
}

/// Returns the name of the link at an end of a joint.
fn end<'n, 't: 'n>(
    text: Text<'t>,
    joint: Node<'n, 't>,
    which: &'static str,
    links: &BTreeMap<&'n str, Node<'n, 't>>,
) -> Result<&'n str, Problem> {
    let Some(end) = child(joint, which) else {
        return Err(text.problem(joint, format!("the joint has no <{which}>"), ""));
    };
    let name = text.required(end, "link")?;
    if links.contains_key(name) {
        return Ok(name);
    }
    let help = suggestion(name, "links are", links.keys().copied());
    Err(text.problem(end, format!("there is no link `{name}`"), help))
}

fn body(
    text: Text<'_>,
    link: Node<'_, '_>,
    name: &str,
    joint: Option<Joint>,
) -> Result<Body, Problem> {
    let mut size = None;
    let mut points = Vec::new();
    for shape in children(link, "visual").chain(children(link, "collision")) {
        let Some(geometry) = child(shape, "geometry") else {
            continue;
        };
        if let Some(cuboid) = child(geometry, "box") {
            size = size.or(text.numbers(cuboid, "size")?);
        }
        if child(geometry, "sphere").is_some() && shape.has_tag_name("collision") {
            points.push((String::new(), origin(text, shape)?.position));
        }
    }
    Ok(Body {
        name: name.to_owned(),
        place: text.place(link),
        inertial: inertial(text, link)?,
        joint,
        size,
        points,
    })
}

/// Returns the frame that `<origin>` of an element describes.
fn origin(text: Text<'_>, node: Node<'_, '_>) -> Result<Frame, Problem> {
    let Some(origin) = child(node, "origin") else {
        return Ok(Frame::identity());
    };
    let position = text.numbers(origin, "xyz")?.unwrap_or_default();
    let [roll, pitch, yaw] = text.numbers(origin, "rpy")?.unwrap_or_default();
    Ok(Frame {
        rotation: turn(2, yaw) * turn(1, pitch) * turn(0, roll),
        position: Vector3::from(position),
    })
}

fn inertial(text: Text<'_>, link: Node<'_, '_>) -> Result<Inertial, Problem> {
    let Some(inertial) = child(link, "inertial") else {
        return Ok(Inertial::none());
    };
    let Some(mass) = child(inertial, "mass") else {
        return Err(text.problem(inertial, "<inertial> has no <mass>", ""));
    };
    text.required(mass, "value")?;
    let value = text.number(mass, "value")?.unwrap_or_default();
    if value < 0.0 {
        return Err(text.problem(mass, "the mass is negative", ""));
    }
    let mut moments = Matrix3::zeros();
    if let Some(inertia) = child(inertial, "inertia") {
        for (i, row) in ["x", "y", "z"].iter().enumerate() {
            for (j, column) in ["x", "y", "z"].iter().enumerate().skip(i) {
                let name = format!("i{row}{column}");
                let moment = text.number(inertia, &name)?.unwrap_or_default();
                moments[(i, j)] = moment;
                moments[(j, i)] = moment;
            }
        }
    }
    let own = Inertial {
        mass: value,
        centre: Vector3::zeros(),
        inertia: moments,
    };
    Ok(own.seen_from(&origin(text, inertial)?))
}

fn joint(text: Text<'_>, joint: Node<'_, '_>, parent: usize) -> Result<Joint, Problem> {
    let kind = text.required(joint, "type")?;
    let freedom = match kind {
        "fixed" => Freedom::Fixed,
        "revolute" | "continuous" => Freedom::Hinge,
        "floating" => Freedom::Free,
        "prismatic" | "planar" => Freedom::Other,
        _ => {
            let kinds = ["fixed", "revolute", "continuous", "floating", "prismatic"];
            let help = suggestion(kind, "types are", kinds);
            return Err(text.problem(joint, format!("there is no joint type `{kind}`"), help));
        }
    };
    let axis = match child(joint, "axis") {
        Some(axis) => text.numbers(axis, "xyz")?,
        None => None,
    };
    let limit = child(joint, "limit");
    let of_limit = |name| limit.map_or(Ok(None), |limit| text.number(limit, name));
    let range = match kind {
        "revolute" => Some([
            of_limit("lower")?.unwrap_or_default(),
            of_limit("upper")?.unwrap_or_default(),
        ]),
        _ => None,
    };
    let dynamics = child(joint, "dynamics");
    let damping = dynamics.map_or(Ok(None), |dynamics| text.number(dynamics, "damping"));
    Ok(Joint {
        name: joint.attribute("name").unwrap_or_default().to_owned(),
        place: text.place(joint),
        freedom,
        parent,
        frame: origin(text, joint)?,
        anchor: Vector3::zeros(),
        axis: Vector3::from(axis.unwrap_or([1.0, 0.0, 0.0])),
        range,
        torque: of_limit("effort")?,
        speed: of_limit("velocity")?,
        damping: damping?,
    })
}

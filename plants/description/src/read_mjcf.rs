//! MJCF as a tree: bodies, joints, masses and forces. Contacts, tendons, equalities and assets are
//! not read.

mod defaults;
mod shape;

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use roxmltree::Node;
use twinrig_document::Problem;

use crate::tree::{Body, Frame, Freedom, Inertial, Joint, Tree, turn};
use crate::xml::{Text, child, children};
use defaults::Defaults;

/// Elements that change the tree of bodies when MuJoCo compiles it.
const REWRITING: [&str; 4] = ["include", "frame", "replicate", "attach"];

/// Elements of drives.
const DRIVES: [&str; 5] = ["general", "motor", "position", "velocity", "intvelocity"];

/// Reads the tree of an MJCF.
pub(crate) fn tree(text: Text<'_>) -> Result<Tree, Problem> {
    let document = text.parse("mujoco")?;
    let root = document.root_element();
    let mut nodes = root.descendants();
    if let Some(node) = nodes.find(|node| REWRITING.iter().any(|name| node.has_tag_name(*name))) {
        let message = format!("<{}> is not read", node.tag_name().name());
        let help = "save the model as one file: mujoco.mj_saveLastXML, or `Save xml` in its viewer";
        return Err(text.problem(node, message, help));
    }
    let Some(world) = child(root, "worldbody") else {
        return Err(text.problem(root, "the model has no <worldbody>", ""));
    };
    let reader = Reader::new(text, root)?;
    // Beside a body that moves freely, the others are surroundings.
    let is_free = |body: &Node| {
        let own = |name| children(*body, name);
        let free = |joint: Node| joint.attribute("type") == Some("free");
        own("freejoint").next().is_some() || own("joint").any(free)
    };
    let any_free = children(world, "body").any(|body| is_free(&body));
    let roots: Vec<_> = children(world, "body")
        .filter(|body| !any_free || is_free(body))
        .collect();
    let mut bodies = vec![Body {
        name: "world".to_owned(),
        place: text.place(world),
        inertial: Inertial::none(),
        joint: None,
        size: None,
        points: Vec::new(),
    }];
    let mut open: Vec<(Node, usize, &str)> = Vec::new();
    open.extend(
        roots
            .into_iter()
            .rev()
            .map(|body| (body, 0, defaults::MAIN)),
    );
    while let Some((node, parent, class)) = open.pop() {
        let class = node.attribute("childclass").unwrap_or(class);
        reader.add(node, parent, class, &mut bodies)?;
        let index = bodies.len() - 1;
        let below: Vec<_> = children(node, "body").collect();
        open.extend(below.into_iter().rev().map(|body| (body, index, class)));
    }
    Ok(Tree {
        name: root.attribute("model").unwrap_or_default().to_owned(),
        place: text.place(root),
        bodies,
    })
}

/// Reader of elements with the settings of the model.
struct Reader<'n, 't> {
    text: Text<'t>,
    defaults: Defaults<'n, 't>,
    /// Factor from the angles of the model to radians.
    angle: f64,
    /// Axes of Euler angles, in order; small letters turn with the body.
    sequence: String,
    /// Whether masses are those of shapes, whatever `<inertial>` says.
    always_shapes: bool,
    /// Greatest torque of drives, by joint \[N·m\].
    torques: BTreeMap<&'n str, f64>,
}

impl<'n, 't: 'n> Reader<'n, 't> {
    fn new(text: Text<'t>, root: Node<'n, 't>) -> Result<Self, Problem> {
        let of_compiler = |name| {
            let mut compilers = children(root, "compiler");
            compilers.find_map(|compiler| compiler.attribute(name))
        };
        let sequence = of_compiler("eulerseq").unwrap_or("xyz");
        let is_radian = of_compiler("angle") == Some("radian");
        let mut reader = Self {
            text,
            defaults: Defaults::new(root),
            angle: if is_radian { 1.0 } else { 1_f64.to_radians() },
            sequence: sequence.to_owned(),
            always_shapes: of_compiler("inertiafromgeom") == Some("true"),
            torques: BTreeMap::new(),
        };
        let drives = children(root, "actuator").flat_map(|section| section.children());
        for drive in drives.filter(|node| DRIVES.contains(&node.tag_name().name())) {
            if let (Some(joint), Some(torque)) = (drive.attribute("joint"), reader.torque(drive)?) {
                reader.torques.insert(joint, torque);
            }
        }
        Ok(reader)
    }

    /// Returns the greatest torque of a drive, if it is limited \[N·m\].
    fn torque(&self, drive: Node<'n, 't>) -> Result<Option<f64>, Problem> {
        let list = |name| match self.defaults.holder(drive, defaults::MAIN, name) {
            Some(holder) => self.text.list(holder, name),
            None => Ok(None),
        };
        let greatest = |range: Option<Vec<f64>>| range.and_then(|range| range.get(1).copied());
        let gear = list("gear")?
            .and_then(|gear| gear.first().copied())
            .unwrap_or(1.0);
        let by_force = greatest(list("forcerange")?);
        let by_control = match drive.tag_name().name() {
            "motor" => greatest(list("ctrlrange")?),
            _ => None,
        };
        Ok(by_force.or(by_control).map(|force| force * gear))
    }

    /// Returns the element that has an attribute of `node`: itself, or a default.
    fn holder(&self, node: Node<'n, 't>, class: &str, name: &str) -> Option<Node<'n, 't>> {
        self.defaults.holder(node, class, name)
    }

    fn numbers<const N: usize>(
        &self,
        node: Node<'n, 't>,
        class: &str,
        name: &str,
    ) -> Result<Option<[f64; N]>, Problem> {
        match self.holder(node, class, name) {
            Some(holder) => self.text.numbers(holder, name),
            None => Ok(None),
        }
    }

    fn word(&self, node: Node<'n, 't>, class: &str, name: &str) -> Option<&'n str> {
        self.holder(node, class, name)?.attribute(name)
    }

    /// Returns position and orientation of an element in its parent.
    fn frame(&self, node: Node<'n, 't>, class: &str) -> Result<Frame, Problem> {
        let position = self.numbers(node, class, "pos")?.unwrap_or_default();
        Ok(Frame {
            rotation: self.rotation(node, class)?,
            position: Vector3::from(position),
        })
    }

    fn rotation(&self, node: Node<'n, 't>, class: &str) -> Result<Matrix3<f64>, Problem> {
        let unit = |vector: Vector3<f64>| {
            let length = vector.norm();
            if length > 0.0 {
                return Ok(vector / length);
            }
            Err(self
                .text
                .problem(node, "an orientation has no direction", ""))
        };
        if let Some(quaternion) = self.numbers::<4>(node, class, "quat")? {
            let length = quaternion
                .map(|part| part * part)
                .iter()
                .sum::<f64>()
                .sqrt();
            if length <= 0.0 {
                return Err(self.text.problem(node, "the quaternion is zero", ""));
            }
            return Ok(of_quaternion(quaternion.map(|part| part / length)));
        }
        if let Some([x, y, z, angle]) = self.numbers(node, class, "axisangle")? {
            let axis = unit(Vector3::new(x, y, z))?;
            let half = 0.5 * angle * self.angle;
            let [x, y, z] = (axis * libm::sin(half)).into();
            return Ok(of_quaternion([libm::cos(half), x, y, z]));
        }
        if let Some(angles) = self.numbers::<3>(node, class, "euler")? {
            let mut rotation = Matrix3::identity();
            for (letter, angle) in self.sequence.chars().zip(angles) {
                let axis = match letter.to_ascii_lowercase() {
                    'x' => 0,
                    'y' => 1,
                    _ => 2,
                };
                let turn = turn(axis, angle * self.angle);
                rotation = if letter.is_ascii_lowercase() {
                    rotation * turn
                } else {
                    turn * rotation
                };
            }
            return Ok(rotation);
        }
        if let Some([a, b, c, d, e, f]) = self.numbers(node, class, "xyaxes")? {
            let x = unit(Vector3::new(a, b, c))?;
            let y = Vector3::new(d, e, f);
            let y = unit(y - x * x.dot(&y))?;
            return Ok(Matrix3::from_columns(&[x, y, x.cross(&y)]));
        }
        if let Some(z) = self.numbers::<3>(node, class, "zaxis")? {
            return Ok(upright(unit(Vector3::from(z))?));
        }
        Ok(Matrix3::identity())
    }

    /// Adds a body, with one body without mass for each of its joints but the last.
    fn add(
        &self,
        node: Node<'n, 't>,
        parent: usize,
        class: &str,
        bodies: &mut Vec<Body>,
    ) -> Result<(), Problem> {
        let mut frame = self.frame(node, class)?;
        let name = node.attribute("name").unwrap_or("without name");
        let mut parent = parent;
        let is_joint = |node: &Node| node.has_tag_name("joint") || node.has_tag_name("freejoint");
        let mut joints: Vec<Joint> = Vec::new();
        for joint in node.children().filter(is_joint) {
            joints.push(self.joint(joint, class, frame)?);
            frame = Frame::identity();
        }
        if joints.is_empty() {
            joints.push(Joint {
                name: name.to_owned(),
                place: self.text.place(node),
                freedom: Freedom::Fixed,
                parent,
                frame,
                anchor: Vector3::zeros(),
                axis: Vector3::z(),
                range: None,
                torque: None,
                speed: None,
                damping: None,
            });
        }
        let last = joints.len() - 1;
        for (index, joint) in joints.into_iter().enumerate() {
            let mut body = Body {
                name: name.to_owned(),
                place: self.text.place(node),
                inertial: Inertial::none(),
                joint: Some(Joint { parent, ..joint }),
                size: None,
                points: Vec::new(),
            };
            if index == last {
                self.fill(node, class, &mut body)?;
            }
            parent = bodies.len();
            bodies.push(body);
        }
        Ok(())
    }

    fn joint(&self, node: Node<'n, 't>, class: &str, frame: Frame) -> Result<Joint, Problem> {
        let freedom = match self.word(node, class, "type") {
            _ if node.has_tag_name("freejoint") => Freedom::Free,
            Some("free") => Freedom::Free,
            Some("hinge") | None => Freedom::Hinge,
            Some(_) => Freedom::Other,
        };
        let is_limited = self.word(node, class, "limited") != Some("false");
        let zero = self.numbers(node, class, "ref")?.map_or(0.0, |[zero]| zero);
        let range = self
            .numbers::<2>(node, class, "range")?
            .filter(|_| is_limited);
        let name = node.attribute("name").unwrap_or("without name");
        let damping = match self.holder(node, class, "damping") {
            Some(holder) => self.text.list(holder, "damping")?,
            None => None,
        };
        let own = self.numbers::<2>(node, class, "actuatorfrcrange")?;
        let by_drive = self.torques.get(name).copied();
        Ok(Joint {
            name: name.to_owned(),
            place: self.text.place(node),
            freedom,
            parent: 0,
            frame,
            anchor: Vector3::from(self.numbers(node, class, "pos")?.unwrap_or_default()),
            axis: Vector3::from(
                self.numbers(node, class, "axis")?
                    .unwrap_or([0.0, 0.0, 1.0]),
            ),
            range: range.map(|range| range.map(|angle| (angle - zero) * self.angle)),
            torque: by_drive.or(own.map(|[_, greatest]| greatest)),
            speed: None,
            damping: damping.and_then(|damping| damping.first().copied()),
        })
    }

    /// Adds masses, contact points and the shape of a body.
    fn fill(&self, node: Node<'n, 't>, class: &str, body: &mut Body) -> Result<(), Problem> {
        let inertial = child(node, "inertial").filter(|_| !self.always_shapes);
        if let Some(inertial) = inertial {
            body.inertial = self.inertial(inertial)?;
        }
        for site in children(node, "site") {
            let name = site.attribute("name").unwrap_or_default().to_owned();
            body.points.push((name, self.frame(site, class)?.position));
        }
        for geom in children(node, "geom") {
            let shape = self.shape(geom, class)?;
            if inertial.is_none() {
                body.inertial = body.inertial.with(&self.of_shape(geom, class, &shape)?);
            }
            if shape.kind == "sphere" {
                let name = geom.attribute("name").unwrap_or_default().to_owned();
                body.points.push((name, shape.frame.position));
            }
            if shape.kind == "box" && body.size.is_none() {
                body.size = Some(shape.size.map(|half| 2.0 * half));
            }
        }
        Ok(())
    }

    fn inertial(&self, node: Node<'n, 't>) -> Result<Inertial, Problem> {
        self.text.required(node, "mass")?;
        let mass = self.text.number(node, "mass")?.unwrap_or_default();
        if mass < 0.0 {
            return Err(self.text.problem(node, "the mass is negative", ""));
        }
        let diagonal = self.text.numbers(node, "diaginertia")?.unwrap_or_default();
        let mut inertia = Matrix3::from_diagonal(&Vector3::from(diagonal));
        if let Some([xx, yy, zz, xy, xz, yz]) = self.text.numbers(node, "fullinertia")? {
            inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        }
        let own = Inertial {
            mass,
            centre: Vector3::zeros(),
            inertia,
        };
        Ok(own.seen_from(&self.frame(node, defaults::MAIN)?))
    }
}

/// Returns the rotation of a unit quaternion (w, x, y, z).
fn of_quaternion([w, x, y, z]: [f64; 4]) -> Matrix3<f64> {
    let vector = Vector3::new(x, y, z);
    let cross = Matrix3::new(0.0, -z, y, z, 0.0, -x, -y, x, 0.0);
    Matrix3::identity() * (w * w - vector.norm_squared())
        + vector * vector.transpose() * 2.0
        + cross * (2.0 * w)
}

/// Returns a rotation that turns z to the unit vector `axis`.
fn upright(axis: Vector3<f64>) -> Matrix3<f64> {
    let beside = if axis.x.abs() < 0.8 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let x = (beside - axis * axis.dot(&beside)).normalize();
    Matrix3::from_columns(&[x, axis.cross(&x), axis])
}

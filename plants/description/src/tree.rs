//! A robot as a tree of bodies and joints, as both formats describe it.

use nalgebra::{Matrix3, Vector3};
use twinrig_document::Place;

/// Position and orientation in another frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub(crate) rotation: Matrix3<f64>,
    /// \[m\]
    pub(crate) position: Vector3<f64>,
}

impl Frame {
    pub(crate) fn identity() -> Self {
        Self {
            rotation: Matrix3::identity(),
            position: Vector3::zeros(),
        }
    }

    /// Returns `other`, which is in this frame, in the frame of this frame.
    pub(crate) fn then(&self, other: &Self) -> Self {
        Self {
            rotation: self.rotation * other.rotation,
            position: self.place(other.position),
        }
    }

    pub(crate) fn place(&self, point: Vector3<f64>) -> Vector3<f64> {
        self.position + self.rotation * point
    }
}

/// Returns the rotation about an axis of coordinates.
pub(crate) fn turn(axis: usize, angle: f64) -> Matrix3<f64> {
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut turn = Matrix3::identity();
    turn[(i, i)] = cosine;
    turn[(j, j)] = cosine;
    turn[(i, j)] = -sine;
    turn[(j, i)] = sine;
    turn
}

/// Mass with its distribution, in the frame of its body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inertial {
    /// \[kg\]
    pub(crate) mass: f64,
    /// Centre of mass \[m\].
    pub(crate) centre: Vector3<f64>,
    /// About the centre of mass \[kg·m²\].
    pub(crate) inertia: Matrix3<f64>,
}

impl Inertial {
    pub(crate) fn none() -> Self {
        Self {
            mass: 0.0,
            centre: Vector3::zeros(),
            inertia: Matrix3::zeros(),
        }
    }

    /// Returns the same in the frame in which its frame is `frame`.
    pub(crate) fn seen_from(&self, frame: &Frame) -> Self {
        Self {
            mass: self.mass,
            centre: frame.place(self.centre),
            inertia: frame.rotation * self.inertia * frame.rotation.transpose(),
        }
    }

    /// Returns both as one; the frames are the same.
    pub(crate) fn with(&self, other: &Self) -> Self {
        if self.mass <= 0.0 {
            return *other;
        }
        if other.mass <= 0.0 {
            return *self;
        }
        let mass = self.mass + other.mass;
        let centre = (self.centre * self.mass + other.centre * other.mass) / mass;
        let about = |part: &Self| {
            let arm = part.centre - centre;
            let square = Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
            part.inertia + square * part.mass
        };
        Self {
            mass,
            centre,
            inertia: about(self) + about(other),
        }
    }
}

/// Freedom of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Freedom {
    Fixed,
    Hinge,
    /// Six degrees of freedom, of a trunk.
    Free,
    /// Anything else, which legs do not have.
    Other,
}

/// Connection of a body to its parent.
#[derive(Debug, Clone)]
pub(crate) struct Joint {
    pub(crate) name: String,
    pub(crate) place: Place,
    pub(crate) freedom: Freedom,
    /// Index of the parent, which is less than that of the body.
    pub(crate) parent: usize,
    /// Frame of the body in the frame of the parent, where the joint is zero.
    pub(crate) frame: Frame,
    /// A point of the axis, in the frame of the body \[m\].
    pub(crate) anchor: Vector3<f64>,
    /// Axis of a hinge, in the frame of the body.
    pub(crate) axis: Vector3<f64>,
    /// Least and greatest angle, if limited \[rad\].
    pub(crate) range: Option<[f64; 2]>,
    /// Drive: greatest torque \[N·m\] and speed \[rad/s\], if known.
    pub(crate) torque: Option<f64>,
    pub(crate) speed: Option<f64>,
    /// Viscous friction, if known \[N·m·s/rad\].
    pub(crate) damping: Option<f64>,
}

/// A rigid body.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub(crate) name: String,
    pub(crate) place: Place,
    pub(crate) inertial: Inertial,
    /// Connection to the parent; the root has none.
    pub(crate) joint: Option<Joint>,
    /// Edges of a box that shows the body \[m\].
    pub(crate) size: Option<[f64; 3]>,
    /// Named points that are no body: sites, and centres of balls \[m\].
    pub(crate) points: Vec<(String, Vector3<f64>)>,
}

/// A robot: the root first, parents before their children.
#[derive(Debug)]
pub(crate) struct Tree {
    pub(crate) name: String,
    pub(crate) place: Place,
    pub(crate) bodies: Vec<Body>,
}

impl Tree {
    /// Returns the tree without fixed joints: bodies that are fixed to each other are one, and the
    /// frames of those that were fixed are points of it.
    pub(crate) fn without_fixed_joints(self) -> Self {
        let mut merged: Vec<Body> = Vec::new();
        // Index of each body's whole, and its frame there.
        let mut wholes: Vec<(usize, Frame)> = Vec::new();
        for mut body in self.bodies {
            let Some(joint) = &mut body.joint else {
                wholes.push((merged.len(), Frame::identity()));
                merged.push(body);
                continue;
            };
            let (whole, outer) = wholes[joint.parent];
            let frame = outer.then(&joint.frame);
            if joint.freedom != Freedom::Fixed {
                (joint.parent, joint.frame) = (whole, frame);
                wholes.push((merged.len(), Frame::identity()));
                merged.push(body);
                continue;
            }
            wholes.push((whole, frame));
            let into = &mut merged[whole];
            into.inertial = into.inertial.with(&body.inertial.seen_from(&frame));
            into.points.push((body.name, frame.position));
            let points = body.points.into_iter();
            into.points
                .extend(points.map(|(name, point)| (name, frame.place(point))));
            let is_level = (frame.rotation - Matrix3::identity()).norm() < 1e-9;
            into.size = into.size.or(body.size.filter(|_| is_level));
        }
        Self {
            bodies: merged,
            ..self
        }
    }

    /// Returns, for each body, the indices of the bodies whose parent it is.
    pub(crate) fn children(&self) -> Vec<Vec<usize>> {
        let mut children = vec![Vec::new(); self.bodies.len()];
        for (index, body) in self.bodies.iter().enumerate() {
            if let Some(joint) = &body.joint {
                children[joint.parent].push(index);
            }
        }
        children
    }
}

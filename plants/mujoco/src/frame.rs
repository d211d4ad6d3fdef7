//! Where everything is and how it moves, out of MuJoCo's coordinates.

use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};
use twinrig_legged::{Base, LegPosture, Posture};
use twinrig_robot::GRAVITY;

use crate::addresses::{Addresses, LegAddresses};
use crate::model::{LegModel, Model};
use crate::options::Coordinates;

/// In the plane of a leg: forward and up, seen from the trunk's centre of mass, in its axes.
type Planar = Vector2<f64>;

/// A segment: the joint above it, its angle, and how both move in the trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bar {
    pub(crate) top: Planar,
    pub(crate) angle: f64,
    pub(crate) speed: Planar,
    pub(crate) rate: f64,
    along: Planar,
}

/// A leg.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegFrame {
    pub(crate) bars: [Bar; 3],
    pub(crate) pulley: f64,
    pub(crate) pulley_rate: f64,
}

/// The trunk: world axes, the angular velocity in its own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkFrame {
    pub(crate) position: Vector3<f64>,
    pub(crate) attitude: [f64; 4],
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) angular_velocity: Vector3<f64>,
}

fn turned(v: Planar) -> Planar {
    Planar::new(-v.y, v.x)
}

impl Bar {
    fn new(top: Planar, angle: f64, speed: Planar, rate: f64) -> Self {
        let along = Planar::new(libm::sin(angle), -libm::cos(angle));
        Self {
            top,
            angle,
            speed,
            rate,
            along,
        }
    }

    /// The point that is so far down the segment.
    pub(crate) fn at(&self, far: f64) -> Planar {
        self.top + self.along * far
    }

    /// Its velocity.
    pub(crate) fn speed_at(&self, far: f64) -> Planar {
        self.speed + turned(self.along) * (self.rate * far)
    }
}

impl LegFrame {
    pub(crate) fn new(
        leg: &LegModel,
        at: &LegAddresses,
        coordinates: Coordinates,
        qpos: &[f64],
        qvel: &[f64],
    ) -> Self {
        let bars = match coordinates {
            Coordinates::Minimal => chained(leg, at, qpos, qvel),
            Coordinates::Maximal => [0, 1, 2].map(|which| loose(leg, at, which, qpos, qvel)),
        };
        let (mut pulley, mut pulley_rate) = (0.0, 0.0);
        if let Some([place, dof]) = at.pulley {
            pulley = qpos[place] / leg.pulley_radius;
            pulley_rate = qvel[dof] / leg.pulley_radius;
        }
        Self {
            bars,
            pulley,
            pulley_rate,
        }
    }

    /// The foot and its velocity.
    pub(crate) fn foot(&self, leg: &LegModel) -> [Planar; 2] {
        let length = leg.segments[2].length;
        [self.bars[2].at(length), self.bars[2].speed_at(length)]
    }

    /// Length of diagonal and parallel rod.
    pub(crate) fn rods(&self, leg: &LegModel) -> [f64; 2] {
        let [first, _, third] = &self.bars;
        let inner = first.at(leg.segments[0].length - leg.l_delta);
        let ankle = self.ankle(leg);
        [ankle - inner, third.at(-leg.l_delta) - inner].map(|rod| rod.norm())
    }

    fn ankle(&self, leg: &LegModel) -> Planar {
        self.bars[1].at(leg.segments[1].length)
    }

    /// What is open that should be closed: pins, stops that are passed, a cable that is too long; the worst \[m\].
    pub(crate) fn constraint_violation(&self, leg: &LegModel, driven: bool) -> f64 {
        let [first, second, third] = &self.bars;
        let hip = Planar::new(leg.hip[0], leg.hip[2]);
        let pins = [
            (first.top - hip).norm(),
            (second.top - first.at(leg.segments[0].length)).norm(),
            (third.top - self.ankle(leg)).norm(),
        ];
        let [diagonal, parallel] = self.rods(leg);
        let stops = [
            diagonal - leg.diagonal_max,
            leg.diagonal_min - diagonal,
            parallel - leg.parallel_max,
            leg.l_delta * (first.angle - third.angle),
        ];
        let cable =
            (self.ankle(leg) - hip).norm() - leg.cable_max + leg.pulley_radius * self.pulley;
        let cable = if driven { cable } else { 0.0 };
        let all = pins.into_iter().chain(stops).chain([cable]);
        all.fold(0.0, f64::max)
    }

    /// Energy in the springs \[J\].
    pub(crate) fn spring_energy(&self, leg: &LegModel) -> f64 {
        let rods = self.rods(leg);
        let springs = rods.iter().zip([leg.diagonal, leg.parallel]);
        springs
            .map(|(length, [stiffness, rest])| 0.5 * stiffness * (length - rest) * (length - rest))
            .sum()
    }

    /// Kinetic energy of the segments, and of what turns with hip and pulley; energy of height \[J\].
    pub(crate) fn moving(
        &self,
        leg: &LegModel,
        trunk: &TrunkFrame,
        inertias: [f64; 2],
    ) -> [f64; 2] {
        let [at_hip, at_pulley] = inertias;
        let mut kinetic = 0.5 * at_hip * self.bars[0].rate * self.bars[0].rate
            + 0.5 * at_pulley * self.pulley_rate * self.pulley_rate;
        let mut gravity = 0.0;
        for (bar, segment) in self.bars.iter().zip(&leg.segments) {
            let place = spatial(bar.at(segment.centre), leg.hip[1]);
            let own = spatial(bar.speed_at(segment.centre), 0.0);
            let velocity = trunk.carried(&place, &own);
            let turning = trunk.angular_velocity - Vector3::y() * bar.rate;
            let lengthwise = turning.dot(&spatial(bar.along, 0.0));
            let across = turning.norm_squared() - lengthwise * lengthwise;
            kinetic += 0.5 * segment.mass * velocity.norm_squared() + 0.5 * segment.moment * across;
            gravity += segment.mass * GRAVITY * (trunk.position + trunk.rotation * place).z;
        }
        [kinetic, gravity]
    }

    pub(crate) fn posture(&self) -> LegPosture {
        LegPosture {
            angles: self.bars.map(|bar| bar.angle),
            rates: self.bars.map(|bar| bar.rate),
            pulley: self.pulley,
            pulley_rate: self.pulley_rate,
        }
    }
}

/// A point of a leg's plane in the trunk.
pub(crate) fn spatial(point: Planar, across: f64) -> Vector3<f64> {
    Vector3::new(point.x, across, point.y)
}

/// The bars of hinges.
fn chained(leg: &LegModel, at: &LegAddresses, qpos: &[f64], qvel: &[f64]) -> [Bar; 3] {
    let reference = leg.pantograph.hip_reference();
    let bends = [reference, -leg.q2_ref, leg.q2_ref];
    let mut top = Planar::new(leg.hip[0], leg.hip[2]);
    let (mut angle, mut rate, mut speed) = (0.0, 0.0, Planar::zeros());
    [0, 1, 2].map(|which| {
        let [[place, dof], ..] = at.segments[which];
        angle += qpos[place] + bends[which];
        rate += qvel[dof];
        let bar = Bar::new(top, angle, speed, rate);
        let length = leg.segments[which].length;
        (top, speed) = (bar.at(length), bar.speed_at(length));
        bar
    })
}

/// A bar that is a body of its own.
fn loose(leg: &LegModel, at: &LegAddresses, which: usize, qpos: &[f64], qvel: &[f64]) -> Bar {
    let addresses = at.segments[which];
    let [x, z, angle] = addresses.map(|[place, _]| qpos[place]);
    let [vx, vz, rate] = addresses.map(|[_, dof]| qvel[dof]);
    let centre = Bar::new(Planar::new(x, z), angle, Planar::new(vx, vz), rate);
    let up = -leg.segments[which].centre;
    Bar::new(centre.at(up), angle, centre.speed_at(up), rate)
}

impl TrunkFrame {
    pub(crate) fn new(model: &Model, at: &Addresses, qpos: &[f64], qvel: &[f64]) -> Self {
        let start = model.start.position;
        let (mut position, mut velocity) = (start, Vector3::zeros());
        let (mut attitude, mut angular_velocity) = ([1.0, 0.0, 0.0, 0.0], Vector3::zeros());
        match model.base {
            Base::Free => {
                let (places, dofs) = (&qpos[at.trunk[0]..], &qvel[at.trunk[1]..]);
                position = Vector3::new(places[0], places[1], places[2]);
                attitude = [places[3], places[4], places[5], places[6]];
                velocity = Vector3::new(dofs[0], dofs[1], dofs[2]);
                angular_velocity = Vector3::new(dofs[3], dofs[4], dofs[5]);
            }
            Base::Planar => {
                let (places, dofs) = (&qpos[at.trunk[0]..], &qvel[at.trunk[1]..]);
                position += Vector3::new(places[0], 0.0, places[1]);
                let half = 0.5 * places[2];
                attitude = [libm::cos(half), 0.0, libm::sin(half), 0.0];
                velocity = Vector3::new(dofs[0], 0.0, dofs[1]);
                angular_velocity = Vector3::y() * dofs[2];
            }
            Base::Fixed => {}
        }
        let [w, x, y, z] = attitude;
        let unit = UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
        Self {
            position,
            attitude,
            rotation: unit.to_rotation_matrix().into_inner(),
            velocity,
            angular_velocity,
        }
    }

    /// Velocity in the world of a point of the trunk's axes that moves in them at `own`.
    pub(crate) fn carried(&self, place: &Vector3<f64>, own: &Vector3<f64>) -> Vector3<f64> {
        self.velocity + self.rotation * (self.angular_velocity.cross(place) + own)
    }

    /// Kinetic energy and energy of height \[J\].
    pub(crate) fn moving(&self, model: &Model) -> [f64; 2] {
        if !model.is_free() {
            return [0.0; 2];
        }
        let turning = self.angular_velocity.iter().zip(&model.trunk_inertia);
        let spin: f64 = turning.map(|(rate, moment)| moment * rate * rate).sum();
        [
            0.5 * model.trunk_mass * self.velocity.norm_squared() + 0.5 * spin,
            model.trunk_mass * GRAVITY * self.position.z,
        ]
    }
}

/// Puts a posture into MuJoCo's coordinates.
pub(crate) fn place(
    model: &Model,
    at: &Addresses,
    posture: &Posture,
    qpos: &mut [f64],
    qvel: &mut [f64],
) {
    match model.base {
        Base::Free => {
            let places = &mut qpos[at.trunk[0]..];
            places[..3].copy_from_slice(posture.position.as_slice());
            places[3..7].copy_from_slice(&posture.attitude);
            let dofs = &mut qvel[at.trunk[1]..];
            dofs[..3].copy_from_slice(posture.velocity.as_slice());
            dofs[3..6].copy_from_slice(posture.angular_velocity.as_slice());
        }
        Base::Planar => {
            let moved = posture.position - model.start.position;
            let [w, _, y, _] = posture.attitude;
            let pitch = 2.0 * libm::atan2(y, w);
            qpos[at.trunk[0]..][..3].copy_from_slice(&[moved.x, moved.z, pitch]);
            let (along, up) = (posture.velocity.x, posture.velocity.z);
            qvel[at.trunk[1]..][..3].copy_from_slice(&[along, up, posture.angular_velocity.y]);
        }
        Base::Fixed => {}
    }
    let legs = model.legs.iter().zip(&at.legs).zip(&posture.legs);
    for ((leg, at), (_, posture)) in legs {
        place_leg(leg, at, model.coordinates, posture, qpos, qvel);
    }
}

fn place_leg(
    leg: &LegModel,
    at: &LegAddresses,
    coordinates: Coordinates,
    posture: &LegPosture,
    qpos: &mut [f64],
    qvel: &mut [f64],
) {
    let reference = leg.pantograph.hip_reference();
    let bends = [reference, -leg.q2_ref, leg.q2_ref];
    let (mut before, mut rate_before) = (0.0, 0.0);
    let mut joint = Planar::new(leg.hip[0], leg.hip[2]);
    let mut speed = Planar::zeros();
    for (which, bend) in bends.into_iter().enumerate() {
        let (angle, rate) = (posture.angles[which], posture.rates[which]);
        let segment = leg.segments[which];
        let bar = Bar::new(joint, angle, speed, rate);
        match coordinates {
            Coordinates::Minimal => {
                let [[place, dof], ..] = at.segments[which];
                qpos[place] = angle - before - bend;
                qvel[dof] = rate - rate_before;
            }
            Coordinates::Maximal => {
                let (centre, drift) = (bar.at(segment.centre), bar.speed_at(segment.centre));
                let values = [(centre.x, drift.x), (centre.y, drift.y), (angle, rate)];
                for ([place, dof], (value, speed)) in at.segments[which].iter().zip(values) {
                    (qpos[*place], qvel[*dof]) = (value, speed);
                }
            }
        }
        (before, rate_before) = (angle, rate);
        (joint, speed) = (bar.at(segment.length), bar.speed_at(segment.length));
    }
    if let Some([place, dof]) = at.pulley {
        qpos[place] = posture.pulley * leg.pulley_radius;
        qvel[dof] = posture.pulley_rate * leg.pulley_radius;
    }
}

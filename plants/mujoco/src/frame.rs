//! Kinematics of trunk and legs from MuJoCo's coordinates.

use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};
use twinrig_legged::{Base, LEGS, LegPosture, Posture};
use twinrig_robot::GRAVITY;

use crate::addresses::{Addresses, LegAddresses};
use crate::inputs::DRIVES;
use crate::model::{LegModel, Model};
use crate::options::Coordinates;

/// Point in the plane of a leg: forward and up from the trunk's centre of mass, in trunk axes.
type Planar = Vector2<f64>;

/// Segment: position of the joint above it, its angle, and the rates of both in the trunk.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bar {
    pub(crate) top: Planar,
    pub(crate) angle: f64,
    pub(crate) speed: Planar,
    pub(crate) rate: f64,
    along: Planar,
}

/// Carrier of a leg: axes of the trunk, turned about x by the angle of abduction, with the origin
/// on that axis; the trunk itself if the leg does not abduct.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Carrier {
    /// Angle and rate of abduction \[rad, rad/s\].
    pub(crate) angle: f64,
    pub(crate) rate: f64,
    sine: f64,
    cosine: f64,
    origin: Vector3<f64>,
}

impl Carrier {
    fn new(leg: &LegModel, at: &LegAddresses, qpos: &[f64], qvel: &[f64]) -> Self {
        let joint = at.abduction.map(|[place, dof]| [qpos[place], qvel[dof]]);
        let [angle, rate] = joint.unwrap_or_default();
        let [left, up] = leg.abduction.map_or([0.0; 2], |axis| axis.place);
        Self {
            angle,
            rate,
            sine: libm::sin(angle),
            cosine: libm::cos(angle),
            origin: Vector3::new(0.0, left, up),
        }
    }

    /// Transforms a vector from leg to trunk axes.
    fn into_trunk(self, v: &Vector3<f64>) -> Vector3<f64> {
        let (s, c) = (self.sine, self.cosine);
        Vector3::new(v.x, c * v.y - s * v.z, s * v.y + c * v.z)
    }

    /// Returns place and velocity in the trunk, in its axes, of a point of the leg's plane that
    /// moves within that plane.
    fn point(self, place: Planar, speed: Planar, across: f64) -> [Vector3<f64>; 2] {
        let arm = self.into_trunk(&spatial(place, across));
        let around = Vector3::new(0.0, -arm.z, arm.y) * self.rate;
        let speed = self.into_trunk(&spatial(speed, 0.0));
        [self.origin + arm, speed + around]
    }
}

/// Kinematics of a leg.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegFrame {
    pub(crate) carrier: Carrier,
    pub(crate) bars: [Bar; 3],
    pub(crate) pulley: f64,
    pub(crate) pulley_rate: f64,
}

/// Kinematics of the trunk: world axes, but the angular velocity in trunk axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrunkFrame {
    pub(crate) position: Vector3<f64>,
    pub(crate) attitude: [f64; 4],
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) angular_velocity: Vector3<f64>,
}

fn perpendicular(v: Planar) -> Planar {
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

    /// Returns the point at a distance down the segment.
    pub(crate) fn at(&self, distance: f64) -> Planar {
        self.top + self.along * distance
    }

    /// Returns the velocity of that point.
    pub(crate) fn speed_at(&self, distance: f64) -> Planar {
        self.speed + perpendicular(self.along) * (self.rate * distance)
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
            Coordinates::Minimal => hinged_bars(leg, at, qpos, qvel),
            Coordinates::Maximal => [0, 1, 2].map(|which| free_bar(leg, at, which, qpos, qvel)),
        };
        let (mut pulley, mut pulley_rate) = (0.0, 0.0);
        if let Some([place, dof]) = at.pulley {
            pulley = qpos[place] / leg.pulley_radius;
            pulley_rate = qvel[dof] / leg.pulley_radius;
        }
        Self {
            carrier: Carrier::new(leg, at, qpos, qvel),
            bars,
            pulley,
            pulley_rate,
        }
    }

    /// Returns place and velocity of the foot in the trunk, in its axes.
    pub(crate) fn foot(&self, leg: &LegModel) -> [Vector3<f64>; 2] {
        self.end(leg, 2)
    }

    /// Returns the same of the lower end of a segment.
    pub(crate) fn end(&self, leg: &LegModel, segment: usize) -> [Vector3<f64>; 2] {
        self.on_segment(leg, segment, leg.segments[segment].length)
    }

    /// Returns the same of the point at a distance down a segment.
    fn on_segment(&self, leg: &LegModel, segment: usize, distance: f64) -> [Vector3<f64>; 2] {
        let bar = &self.bars[segment];
        let (place, speed) = (bar.at(distance), bar.speed_at(distance));
        self.carrier.point(place, speed, leg.hip[1])
    }

    /// Returns the lengths of diagonal and parallel rod.
    pub(crate) fn rods(&self, leg: &LegModel) -> [f64; 2] {
        let [first, _, third] = &self.bars;
        let inner = first.at(leg.segments[0].length - leg.l_delta);
        let ankle = self.ankle(leg);
        [ankle - inner, third.at(-leg.l_delta) - inner].map(|rod| rod.norm())
    }

    fn ankle(&self, leg: &LegModel) -> Planar {
        self.bars[1].at(leg.segments[1].length)
    }

    /// Returns the maximum constraint violation \[m\]: pins, stops, cable length.
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
        let swing = leg.abduction.map_or(0.0, |axis| {
            let ([least, greatest], angle) = (axis.range, self.carrier.angle);
            leg.segments[0].length * (least - angle).max(angle - greatest)
        });
        let cable =
            (self.ankle(leg) - hip).norm() - leg.cable_max + leg.pulley_radius * self.pulley;
        let cable = if driven { cable } else { 0.0 };
        let all = pins.into_iter().chain(stops).chain([swing, cable]);
        all.fold(0.0, f64::max)
    }

    /// Returns the energy in the springs \[J\].
    pub(crate) fn spring_energy(&self, leg: &LegModel) -> f64 {
        let rods = self.rods(leg);
        let springs = rods.iter().zip([leg.diagonal, leg.parallel]);
        springs
            .map(|(length, [stiffness, rest])| 0.5 * stiffness * (length - rest) * (length - rest))
            .sum()
    }

    /// Returns the kinetic energy of the segments and of the drives' inertias, and the potential
    /// energy of gravity \[J\].
    pub(crate) fn energies(
        &self,
        leg: &LegModel,
        trunk: &TrunkFrame,
        inertias: [f64; DRIVES],
    ) -> [f64; 2] {
        let ([at_hip, at_pulley, at_abduction], carrier) = (inertias, self.carrier);
        let mut kinetic = 0.5 * at_hip * self.bars[0].rate * self.bars[0].rate
            + 0.5 * at_pulley * self.pulley_rate * self.pulley_rate
            + 0.5 * at_abduction * carrier.rate * carrier.rate;
        let mut gravity = 0.0;
        let carried = trunk.angular_velocity + Vector3::x() * carrier.rate;
        let across = carrier.into_trunk(&Vector3::y());
        for (i, (bar, segment)) in self.bars.iter().zip(&leg.segments).enumerate() {
            let [place, relative] = self.on_segment(leg, i, segment.centre);
            let velocity = trunk.point_velocity(&place, &relative);
            let turning = carried - across * bar.rate;
            let lengthwise = turning.dot(&carrier.into_trunk(&spatial(bar.along, 0.0)));
            let square = turning.norm_squared() - lengthwise * lengthwise;
            kinetic += 0.5 * segment.mass * velocity.norm_squared() + 0.5 * segment.moment * square;
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

/// Returns a point of a leg's plane in leg axes.
fn spatial(point: Planar, across: f64) -> Vector3<f64> {
    Vector3::new(point.x, across, point.y)
}

/// Returns the segments of a chain of hinges.
fn hinged_bars(leg: &LegModel, at: &LegAddresses, qpos: &[f64], qvel: &[f64]) -> [Bar; 3] {
    let hip_reference = leg.pantograph.hip_reference();
    let references = [hip_reference, -leg.q2_ref, leg.q2_ref];
    let mut top = Planar::new(leg.hip[0], leg.hip[2]);
    let (mut angle, mut rate, mut speed) = (0.0, 0.0, Planar::zeros());
    [0, 1, 2].map(|which| {
        let [[place, dof], ..] = at.segments[which];
        angle += qpos[place] + references[which];
        rate += qvel[dof];
        let bar = Bar::new(top, angle, speed, rate);
        let length = leg.segments[which].length;
        (top, speed) = (bar.at(length), bar.speed_at(length));
        bar
    })
}

/// Returns a segment that is a separate body.
fn free_bar(leg: &LegModel, at: &LegAddresses, which: usize, qpos: &[f64], qvel: &[f64]) -> Bar {
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

    /// Returns the world velocity of a point that moves in trunk axes at `relative`.
    pub(crate) fn point_velocity(
        &self,
        place: &Vector3<f64>,
        relative: &Vector3<f64>,
    ) -> Vector3<f64> {
        self.velocity + self.rotation * (self.angular_velocity.cross(place) + relative)
    }

    /// Returns the kinetic energy and the potential energy of gravity \[J\].
    pub(crate) fn energies(&self, model: &Model) -> [f64; 2] {
        if !model.is_free() {
            return [0.0; 2];
        }
        let turning = self.angular_velocity.iter().zip(&model.trunk_inertia);
        let spin: f64 = turning.map(|(rate, moment)| moment * rate * rate).sum();
        let mut energies = [
            0.5 * model.trunk_mass * self.velocity.norm_squared() + 0.5 * spin,
            model.trunk_mass * GRAVITY * self.position.z,
        ];
        if let Some(payload) = &model.payload {
            let (rate, moment) = (&self.angular_velocity, Vector3::from(payload.moment));
            let inertia = Matrix3::from(payload.inertia());
            let square = self.velocity.norm_squared();
            let swing = self.velocity.dot(&(self.rotation * rate.cross(&moment)));
            energies[0] += 0.5 * (payload.mass * square + rate.dot(&(inertia * rate))) + swing;
            let lift = (self.rotation * moment).z;
            energies[1] += GRAVITY * (payload.mass * self.position.z + lift);
        }
        energies
    }
}

/// Converts a posture, and angles and rates of abduction, to MuJoCo's coordinates.
pub(crate) fn set_coordinates(
    model: &Model,
    at: &Addresses,
    posture: &Posture,
    abduction: &[[f64; 2]; LEGS],
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
            let offset = posture.position - model.start.position;
            let [w, _, y, _] = posture.attitude;
            let pitch = 2.0 * libm::atan2(y, w);
            qpos[at.trunk[0]..][..3].copy_from_slice(&[offset.x, offset.z, pitch]);
            let (along, up) = (posture.velocity.x, posture.velocity.z);
            qvel[at.trunk[1]..][..3].copy_from_slice(&[along, up, posture.angular_velocity.y]);
        }
        Base::Fixed => {}
    }
    let legs = model.legs.iter().zip(&at.legs).zip(&posture.legs);
    for ((leg, at), (_, posture)) in legs {
        set_leg_coordinates(leg, at, model.coordinates, posture, qpos, qvel);
    }
    for (at, [angle, rate]) in at.legs.iter().zip(abduction) {
        if let Some([place, dof]) = at.abduction {
            (qpos[place], qvel[dof]) = (*angle, *rate);
        }
    }
}

fn set_leg_coordinates(
    leg: &LegModel,
    at: &LegAddresses,
    coordinates: Coordinates,
    posture: &LegPosture,
    qpos: &mut [f64],
    qvel: &mut [f64],
) {
    let hip_reference = leg.pantograph.hip_reference();
    let references = [hip_reference, -leg.q2_ref, leg.q2_ref];
    let (mut angle_above, mut rate_above) = (0.0, 0.0);
    let mut joint = Planar::new(leg.hip[0], leg.hip[2]);
    let mut speed = Planar::zeros();
    for (which, reference_angle) in references.into_iter().enumerate() {
        let (angle, rate) = (posture.angles[which], posture.rates[which]);
        let segment = leg.segments[which];
        let bar = Bar::new(joint, angle, speed, rate);
        match coordinates {
            Coordinates::Minimal => {
                let [[place, dof], ..] = at.segments[which];
                qpos[place] = angle - angle_above - reference_angle;
                qvel[dof] = rate - rate_above;
            }
            Coordinates::Maximal => {
                let (centre, drift) = (bar.at(segment.centre), bar.speed_at(segment.centre));
                let values = [(centre.x, drift.x), (centre.y, drift.y), (angle, rate)];
                for ([place, dof], (value, speed)) in at.segments[which].iter().zip(values) {
                    (qpos[*place], qvel[*dof]) = (value, speed);
                }
            }
        }
        (angle_above, rate_above) = (angle, rate);
        (joint, speed) = (bar.at(segment.length), bar.speed_at(segment.length));
    }
    if let Some([place, dof]) = at.pulley {
        qpos[place] = posture.pulley * leg.pulley_radius;
        qvel[dof] = posture.pulley_rate * leg.pulley_radius;
    }
}

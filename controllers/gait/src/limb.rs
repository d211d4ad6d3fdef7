//! Leg of a controller: from a foot target to two motor angles.

use core::ops::RangeInclusive;

use twinrig_kernel::{Port, Unit, signal};
use twinrig_robot::leg::{LegCommand, Pantograph, Planar};
use twinrig_robot::{AbductionAxis, LegMount, Robot};

use crate::{Corner, GaitError};

/// Targets are clamped to this distance from the hip \[m\], so that their squares do not overflow.
const TARGET_MAX: f64 = 1e6;

fn unknown<'n>(name: &str, known: impl Iterator<Item = &'n str>) -> GaitError {
    GaitError::UnknownLeg {
        name: name.to_owned(),
        known: known.collect::<Vec<_>>().join(", "),
    }
}

/// One leg of the robot.
#[derive(Debug, Clone)]
pub(crate) struct Limb {
    pub name: String,
    pub corner: Corner,
    /// Whether the leg is commanded; legs that are not still have an oscillator.
    pub active: bool,
    /// Hip in the trunk frame \[m\].
    pub hip: [f64; 3],
    /// Joint of abduction, if the leg has one.
    abduction: Option<AbductionAxis>,
    pantograph: Pantograph,
}

impl Limb {
    /// Creates all legs of `robot`; those in `legs` are active.
    pub(crate) fn of_robot(robot: &Robot, legs: &[&str]) -> Result<Vec<Self>, GaitError> {
        if let Some(name) = legs
            .iter()
            .find(|&&name| robot.legs.iter().all(|mount| mount.name != name))
        {
            let known = robot.legs.iter().map(|mount| mount.name.as_str());
            return Err(unknown(name, known));
        }
        robot
            .legs
            .iter()
            .map(|mount| Self::new(mount, legs.contains(&mount.name.as_str())))
            .collect()
    }

    /// Returns the index of the leg `name`.
    pub(crate) fn find(limbs: &[Self], name: &str) -> Result<usize, GaitError> {
        let found = limbs.iter().position(|limb| limb.name == name);
        found.ok_or_else(|| unknown(name, limbs.iter().map(|limb| limb.name.as_str())))
    }

    fn new(mount: &LegMount, active: bool) -> Result<Self, GaitError> {
        let pantograph = Pantograph::new(&mount.leg).map_err(|source| GaitError::Leg {
            name: mount.name.clone(),
            source,
        })?;
        Ok(Self {
            name: mount.name.clone(),
            corner: Corner::of_hip(mount.hip),
            active,
            hip: mount.hip,
            abduction: mount.abduction_axis(),
            pantograph,
        })
    }

    /// Lengths of the extended fore and hind legs \[m\]; equal if the robot has only one of these.
    pub(crate) fn lengths_max(limbs: &[Self]) -> [f64; 2] {
        Self::reaches(limbs).map(|reach| *reach.end())
    }

    /// Shortest and longest distance from hip to foot of fore and hind legs \[m\]; equal if the
    /// robot has only one of these.
    pub(crate) fn reaches(limbs: &[Self]) -> [RangeInclusive<f64>; 2] {
        let of = |fore: bool| {
            let limb = limbs.iter().find(|limb| limb.corner.fore == fore)?;
            Some(limb.pantograph.length_min()..=limb.pantograph.length_max())
        };
        let fore = of(true).or(of(false)).unwrap_or(0.0..=1.0);
        [fore.clone(), of(false).unwrap_or(fore)]
    }

    /// Place of the foot in front of the trunk's centre of mass by the angles of the segments
    /// \[rad\], for a level trunk \[m\]; NaN if they have none.
    #[inline]
    pub(crate) fn place_of(&self, angles: [f64; 3]) -> f64 {
        let pose = self.pantograph.pose_of_angles(angles);
        pose.map_or(f64::NAN, |pose| self.hip[0] + pose.foot.x)
    }

    /// Ports of the hip and knee commands.
    pub(crate) fn ports(&self) -> [Port; 2] {
        ["hip", "knee"].map(|joint| self.port(joint))
    }

    /// Port of the command of `joint`.
    pub(crate) fn port(&self, joint: &str) -> Port {
        let name = signal::command(&self.name, joint);
        Port::output(name, Unit::Radian, 1)
    }

    /// Returns whether the leg has a joint of abduction.
    pub(crate) fn abducts(&self) -> bool {
        self.abduction.is_some()
    }

    /// Place of the hip from the axis of abduction, to the left and up \[m\].
    fn hip_from_axis(&self) -> [f64; 2] {
        let [_, y, z] = self.hip;
        self.abduction
            .map_or([0.0; 2], |axis| [y - axis.place[0], z - axis.place[1]])
    }

    /// Returns the place to the left of a foot at an angle of abduction \[rad\], `z` above the hip
    /// in trunk axes, from that with an upright leg \[m\].
    pub(crate) fn place_aside(&self, angle: f64, z: f64) -> f64 {
        let [beside, above] = self.hip_from_axis();
        let height = above + z;
        (beside - height * libm::sin(angle)) / libm::cos(angle) - beside
    }

    /// Returns the angle of abduction \[rad\] that brings a foot to `aside` \[m\], to the left of
    /// its place with an upright leg, and `z` above the hip in trunk axes; and its height above the
    /// hip in leg axes \[m\].
    pub(crate) fn abducted(&self, aside: f64, z: f64) -> [f64; 2] {
        let [beside, above] = self.hip_from_axis();
        let (y, height) = (beside + aside, above + z);
        // (b, ζ) in leg axes, turned by the angle, is (y, z) from the axis.
        let square = y * y + height * height - beside * beside;
        let below = -libm::sqrt(square.max(0.0));
        let angle = libm::atan2(beside * height - below * y, beside * y + below * height);
        [angle, below - above]
    }

    /// Returns the nearest angle of abduction between the stops \[rad\].
    pub(crate) fn within_stops(&self, angle: f64) -> f64 {
        let [least, greatest] = self.abduction.map_or([0.0; 2], |axis| axis.range);
        angle.clamp(least, greatest)
    }

    /// Returns the way of a foot at an angle of abduction \[rad\], `z` above the hip in leg axes,
    /// to the nearest stop, zero between them \[m\].
    pub(crate) fn beyond_stops(&self, angle: f64, z: f64) -> f64 {
        let [_, above] = self.hip_from_axis();
        (angle - self.within_stops(angle)).abs() * -(above + z)
    }

    /// Returns the hip and knee angles \[rad\] that bring the foot to `target` \[m\], or to the
    /// nearest point in the leg's reach, and the distance of the target from it, zero within reach
    /// \[m\].
    #[inline]
    pub(crate) fn command(&self, target: [f64; 2]) -> ([f64; 2], f64) {
        let [x, z] = target.map(|coordinate| coordinate.clamp(-TARGET_MAX, TARGET_MAX));
        let (LegCommand { hip, knee }, beyond) = self.pantograph.inverse_nearest(Planar::new(x, z));
        ([hip, knee], beyond)
    }
}

//! Leg of a controller: from a foot target to two motor angles.

use core::ops::RangeInclusive;

use twinrig_kernel::{Port, Unit, signal};
use twinrig_robot::leg::{LegCommand, Pantograph, Planar};
use twinrig_robot::{LegMount, Robot};

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
    /// Place of the hip in front of the trunk's centre of mass \[m\].
    hip_x: f64,
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
            hip_x: mount.hip[0],
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
        pose.map_or(f64::NAN, |pose| self.hip_x + pose.foot.x)
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

//! Facts of the body: mass, inertia, places of the hips.

use twinrig_kernel::Unit;
use twinrig_legged::Segment;
use twinrig_robot::leg::{Joints, LegError, Pantograph, Planar};
use twinrig_robot::{LegMount, Robot};

use super::fact::Fact;
use super::leg::LegKind;

/// Returns the facts of the body.
///
/// # Errors
/// [`LegError`] for a leg that cannot be extended.
pub(super) fn facts(robot: &Robot, kinds: &[LegKind]) -> Result<Vec<Fact>, LegError> {
    let mut facts = vec![
        Fact::new("mass", "mass", [robot.mass()], Unit::Kilogram, "trunk.mass")
            .and_masses(kinds)
            .with_note(format!("{} legs", robot.legs.len())),
        Fact::new(
            "weight",
            "weight",
            [robot.weight()],
            Unit::Newton,
            "trunk.mass",
        )
        .and_masses(kinds),
        Fact::new(
            "trunk_mass",
            "trunk without legs",
            [robot.trunk.mass],
            Unit::Kilogram,
            "trunk.mass",
        ),
        Fact::new(
            "trunk_size",
            "trunk, length … width … height",
            robot.trunk.size,
            Unit::Meter,
            "trunk.size",
        )
        .with_note("for display and contact"),
        Fact::new(
            "trunk_inertia",
            "inertia of the trunk about x … y … z",
            robot.trunk.inertia,
            Unit::KilogramSquareMeter,
            "trunk.inertia",
        ),
    ];
    let fact = Fact::new(
        "inertia",
        "inertia of the robot about x … y … z",
        inertia(robot)?,
        Unit::KilogramSquareMeter,
        "trunk.mass trunk.inertia mount",
    );
    facts.push(
        fact.and_masses(kinds)
            .with_note("about its centre of mass, legs extended"),
    );
    for (key, name, axis) in [
        ("hip_length", "hips, foremost to hindmost", 0),
        ("hip_width", "hips, left to right", 1),
    ] {
        let places = || robot.legs.iter().map(|mount| mount.hip[axis]);
        let extent = places().fold(f64::MIN, f64::max) - places().fold(f64::MAX, f64::min);
        facts.push(Fact::new(key, name, [extent], Unit::Meter, "mount"));
    }
    facts.extend(lying(robot).map(|fact| fact.and_masses(kinds)));
    Ok(facts)
}

/// Returns the depth in the ground of a robot that lies on its trunk, if trunks have contact.
fn lying(robot: &Robot) -> Option<Fact> {
    let contact = robot.contact?;
    let (toe, spring) = (
        contact.toe_region,
        robot.weight() / (4.0 * contact.stiffness),
    );
    // The stiffness grows from zero over the toe region: of its square first, then half of it less
    // than a spring that begins at the surface.
    let depth = if spring < 0.5 * toe {
        libm::sqrt(2.0 * toe * spring)
    } else {
        spring + 0.5 * toe
    };
    let keys = "trunk.mass contact.stiffness contact.toe_region";
    let name = "depth of the trunk on the ground";
    let fact = Fact::new("trunk_depth", name, [depth], Unit::Meter, keys);
    Some(fact.with_note("on four corners, under the weight of the robot"))
}

impl Fact {
    /// Adds the masses of all legs to the keys from which the fact follows.
    fn and_masses(mut self, kinds: &[LegKind]) -> Self {
        for part in ["l1", "l2", "l3", "foot"] {
            let keys = kinds.iter().map(|kind| kind.key(&format!("mass.{part}")));
            self.from.extend(keys);
        }
        self
    }
}

/// Returns the moments of inertia of the robot about the axes of the trunk through its centre of
/// mass, the legs extended and the feet below the hips \[kg·m²\].
///
/// # Errors
/// [`LegError`] for a leg without that pose.
fn inertia(robot: &Robot) -> Result<[f64; 3], LegError> {
    let mut bodies = vec![Body {
        mass: robot.trunk.mass,
        place: [0.0; 3],
        inertia: robot.trunk.inertia,
    }];
    for mount in &robot.legs {
        bodies.extend(segments(mount)?);
    }
    let mass: f64 = bodies.iter().map(|body| body.mass).sum();
    let centre = [0, 1, 2].map(|axis| {
        let moments = bodies.iter().map(|body| body.mass * body.place[axis]);
        moments.sum::<f64>() / mass
    });
    Ok([0, 1, 2].map(|axis| {
        let about = bodies.iter().map(|body| {
            let arm = |other: usize| body.place[other] - centre[other];
            let (a, b) = (arm((axis + 1) % 3), arm((axis + 2) % 3));
            body.inertia[axis] + body.mass * (a * a + b * b)
        });
        about.sum()
    }))
}

/// Rigid body: mass \[kg\], centre of mass \[m\] and moments of inertia about it \[kg·m²\], trunk
/// axes.
struct Body {
    mass: f64,
    place: [f64; 3],
    inertia: [f64; 3],
}

/// Returns the segments of an extended leg.
fn segments(mount: &LegMount) -> Result<[Body; 3], LegError> {
    let pantograph = Pantograph::new(&mount.leg)?;
    let extended = pantograph.angles(0.0, Joints { q2: 0.0, q3: 0.0 });
    let pose = pantograph.pose_of_angles(extended)?;
    let joints = [Planar::zeros(), pose.knee, pose.ankle];
    let segments = Segment::of(&mount.leg);
    Ok([0, 1, 2].map(|n| {
        let (segment, along) = (segments[n], pose.along[n]);
        let centre = joints[n] + along * segment.centre;
        let [x, y, z] = mount.hip;
        Body {
            mass: segment.mass,
            place: [x + centre.x, y, z + centre.y],
            // A thin rod has no inertia about its own axis.
            inertia: [
                segment.moment * along.y * along.y,
                segment.moment,
                segment.moment * along.x * along.x,
            ],
        }
    }))
}

#[cfg(test)]
mod tests {
    use twinrig_robot::Robot;

    use super::*;

    #[test]
    fn inertia_is_that_of_points_of_mass() {
        let mut robot = Robot::example();
        robot.legs[0].hip = [0.13, 0.06, -0.02];
        let mut points: Vec<(f64, [f64; 3])> = vec![(robot.trunk.mass, [0.0; 3])];
        let count = 20_000;
        for mount in &robot.legs {
            let leg = &mount.leg;
            let pantograph = Pantograph::new(leg).unwrap();
            let pose = pantograph
                .pose_of_angles(pantograph.angles(0.0, Joints { q2: 0.0, q3: 0.0 }))
                .unwrap();
            let inner = pose.ankle - pose.along[2] * leg.l_delta;
            let ends = [
                (leg.mass.l1, Planar::zeros(), pose.knee),
                (leg.mass.l2, pose.knee, pose.ankle),
                (leg.mass.l3, inner, pose.foot),
            ];
            let at = |p: Planar| [mount.hip[0] + p.x, mount.hip[1], mount.hip[2] + p.y];
            for (mass, from, to) in ends {
                points.extend((0..count).map(|n| {
                    let share = (f64::from(n) + 0.5) / f64::from(count);
                    (mass / f64::from(count), at(from + (to - from) * share))
                }));
            }
            points.push((leg.mass.foot, at(pose.foot)));
        }
        let mass: f64 = points.iter().map(|(m, _)| m).sum();
        assert!((mass - robot.mass()).abs() < 1e-9);
        let centre = [0, 1, 2].map(|k| points.iter().map(|(m, p)| m * p[k]).sum::<f64>() / mass);
        let found = inertia(&robot).unwrap();
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let square = |p: &[f64; 3], k: usize| (p[k] - centre[k]) * (p[k] - centre[k]);
            let sum: f64 = points
                .iter()
                .map(|(m, p)| m * (square(p, a) + square(p, b)))
                .sum();
            let expected = sum + robot.trunk.inertia[axis];
            assert!(
                (found[axis] / expected - 1.0).abs() < 1e-6,
                "{axis}: {found:?} {expected}"
            );
        }
    }
}

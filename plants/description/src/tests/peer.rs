//! Exported URDF in Pinocchio, an independent reader and an independent implementation of rigid
//! bodies.

use std::path::Path;

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde_json::{Value, json};
use twinrig_description::urdf;
use twinrig_legged::Segment;
use twinrig_robot::leg::{Joints, Pantograph, Planar};
use twinrig_robot::{Robot, RobotFile};
use twinrig_testing::python;

/// Number of joint vectors for each robot.
const STATES: usize = 50;

/// Greatest deviation of masses \[kg\] and positions \[m\]: thousands of roundings.
const TOLERANCE: f64 = 1e-12;

/// Greatest deviation of moments of inertia \[kg·m²\]: 1e-14 about the axis of each of 12 segments,
/// and of 4 links that abduct, which have none here, and roundings.
const MOMENT_TOLERANCE: f64 = 1.7e-13;

/// Joint angles of one leg \[rad\]; that of abduction is zero without such a joint.
#[derive(Clone, Copy)]
struct Angles {
    abduction: f64,
    hip: f64,
    knee: f64,
    ankle: f64,
}

/// Returns numbers from 0 to 1 that fill a square evenly and do not repeat.
fn spread(index: usize, multiple: f64) -> f64 {
    ((index as f64 + 1.0) * multiple).fract()
}

/// Returns the angles of all legs in one state; the pantographs are open by up to 0.4 rad.
fn state(robot: &Robot, index: usize) -> Vec<Angles> {
    let legs = robot.legs.iter().enumerate();
    let angles = legs.map(|(number, mount)| {
        let at = index * robot.legs.len() + number;
        let bottomed = Pantograph::new(&mount.leg)
            .unwrap()
            .knee_bottomed()
            .unwrap();
        let knee = bottomed * spread(at, 2_f64.sqrt());
        let axis = mount.abduction_axis();
        let abduction = axis.map_or(0.0, |axis| {
            let [least, greatest] = axis.range;
            least + (greatest - least) * spread(at, 7_f64.sqrt())
        });
        Angles {
            abduction,
            hip: 2.0 * spread(at, 3_f64.sqrt()) - 1.0,
            knee,
            ankle: 0.4 * spread(at, 5_f64.sqrt()) - knee,
        }
    });
    angles.collect()
}

/// Mass, centre of mass, inertia about it and points, as the script reports them.
struct Composite {
    mass: f64,
    moment: Vector3<f64>,
    /// About the origin.
    inertia: Matrix3<f64>,
    points: Vec<(String, Vector3<f64>)>,
}

impl Composite {
    fn of(robot: &Robot, state: &[Angles]) -> Self {
        let mut all = Self {
            mass: 0.0,
            moment: Vector3::zeros(),
            inertia: Matrix3::zeros(),
            points: Vec::new(),
        };
        let trunk = Matrix3::from_diagonal(&Vector3::from(robot.trunk.inertia));
        all.add(robot.trunk.mass, Vector3::zeros(), trunk);
        for (mount, angles) in robot.legs.iter().zip(state) {
            let leg = Pantograph::new(&mount.leg).unwrap();
            let (q2, q3) = (angles.knee, angles.ankle);
            let pose = leg
                .pose_of_angles(leg.angles(angles.hip, Joints { q2, q3 }))
                .unwrap();
            let aside = Rotation3::from_axis_angle(&Vector3::x_axis(), angles.abduction);
            let hip = Vector3::from(mount.hip);
            let axis = mount.abduction_axis().map_or(hip, |axis| {
                let [y, z] = axis.place;
                Vector3::new(hip.x, y, z)
            });
            let hip = axis + aside * (hip - axis);
            let in_plane = |at: Planar| aside * Vector3::new(at.x, 0.0, at.y);
            let place = |point: Planar| hip + in_plane(point);
            let [first, second, third] = pose.along.map(in_plane);
            let (knee, ankle) = (place(pose.knee), place(pose.ankle));
            let segments = Segment::of(&mount.leg);
            for ((joint, along), segment) in [(hip, first), (knee, second), (ankle, third)]
                .into_iter()
                .zip(segments)
            {
                let rod = Matrix3::identity() - along * along.transpose();
                all.add(
                    segment.mass,
                    joint + along * segment.centre,
                    rod * segment.moment,
                );
            }
            let offset = mount.leg.l_delta;
            for (part, point) in [
                ("upper", hip),
                ("middle", knee),
                ("lower", ankle),
                ("inner", knee - first * offset),
                ("outer", ankle - third * offset),
                ("foot", place(pose.foot)),
            ] {
                all.points.push((format!("{}_{part}", mount.name), point));
            }
        }
        all
    }

    fn add(&mut self, mass: f64, centre: Vector3<f64>, inertia: Matrix3<f64>) {
        self.mass += mass;
        self.moment += centre * mass;
        self.inertia += inertia + shifted(mass, centre);
    }

    /// Panics where the script's `found` deviates.
    fn compare(&self, found: &Value) {
        let close = |what: &str, found: &Value, ours: f64, tolerance: f64| {
            let found = found.as_f64().unwrap();
            let deviation = (found - ours).abs();
            assert!(
                deviation <= tolerance,
                "{what}: {found} in Pinocchio, ours {ours}"
            );
        };
        let centre = self.moment / self.mass;
        let inertia = self.inertia - shifted(self.mass, centre);
        close("mass", &found["mass"], self.mass, TOLERANCE);
        for i in 0..3 {
            close("centre", &found["centre"][i], centre[i], TOLERANCE);
            for j in 0..3 {
                close(
                    "inertia",
                    &found["inertia"][i][j],
                    inertia[(i, j)],
                    MOMENT_TOLERANCE,
                );
            }
        }
        for (name, point) in &self.points {
            for i in 0..3 {
                close(name, &found["points"][name][i], point[i], TOLERANCE);
            }
        }
    }
}

/// Returns the inertia of a point about the origin.
fn shifted(mass: f64, at: Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * at.norm_squared() - at * at.transpose()) * mass
}

#[test]
fn masses_and_kinematics_are_those_of_pinocchio() {
    let Some(python) = python::python_of_peers("pinocchio") else {
        return;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/urdf_in_pinocchio.py");
    for name in ["cheetah-cub", "oncilla"] {
        let robot = RobotFile::find(name, Path::new(""))
            .unwrap()
            .robot()
            .unwrap();
        let states: Vec<_> = (0..STATES).map(|index| state(&robot, index)).collect();
        let legs: Vec<_> = robot.legs.iter().map(|mount| mount.name.as_str()).collect();
        let joints = |state: &Vec<Angles>| {
            let abducts = robot.legs[0].leg.abduction.is_some();
            let named = legs.iter().zip(state).flat_map(|(leg, angles)| {
                let Angles {
                    abduction,
                    hip,
                    knee,
                    ankle,
                } = *angles;
                let abduction = abducts.then_some(("abduction", abduction));
                let rest = [("hip", hip), ("knee", knee), ("ankle", ankle)];
                let all = abduction.into_iter().chain(rest);
                all.map(move |(joint, angle)| (format!("{leg}_{joint}"), json!(angle)))
            });
            json!({ "joints": named.collect::<serde_json::Map<_, _>>() })
        };
        let request = json!({
            "urdf": urdf(&robot).unwrap(),
            "legs": legs,
            "states": states.iter().map(joints).collect::<Vec<_>>(),
        });
        let found = python::run(&python, &script, &[], &request);
        for (index, state) in states.iter().enumerate() {
            Composite::of(&robot, state).compare(&found["free"][index]);
            // Mimic joints close the pantograph.
            let closed: Vec<_> = state
                .iter()
                .map(|angles| Angles {
                    ankle: -angles.knee,
                    ..*angles
                })
                .collect();
            Composite::of(&robot, &closed).compare(&found["closed"][index]);
        }
    }
}

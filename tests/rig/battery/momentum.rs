//! Momentum of the robot as a sum over rigid segments, computed from state and robot file only,
//! independently of the plant's generalised coordinates.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use twinrig::robot::{Leg, Robot};
use twinrig::runtime::PlantState;
use twinrig_legged::Segment;

/// Momentum in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Momentum {
    /// Σ m v \[N·s\].
    pub linear: Vector3<f64>,
    /// About the robot's centre of mass \[N·m·s\].
    pub angular: Vector3<f64>,
    /// Position of the robot's centre of mass \[m\].
    pub centre: Vector3<f64>,
    /// Σ m |v| and Σ |angular momentum of each body|, the scales of relative changes.
    pub linear_scale: f64,
    pub angular_scale: f64,
}

/// A rigid body: mass, position, velocity and spin (angular momentum about its centre of mass).
struct Body {
    mass: f64,
    position: Vector3<f64>,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
}

/// Segments of a leg; the toe is one of them if `toe` is set and the leg has one.
fn segments(leg: &Leg, toe: bool) -> Vec<Segment> {
    match leg.toe.filter(|_| toe) {
        None => Segment::of(leg).to_vec(),
        Some(toe) => {
            let mut without_toe = leg.clone();
            without_toe.mass.foot = 0.0;
            let mut segments = Segment::of(&without_toe).to_vec();
            let mass = leg.mass.foot;
            segments.push(Segment {
                length: toe.length,
                above: 0.0,
                mass,
                centre: 0.5 * toe.length,
                moment: mass * toe.length * toe.length / 12.0,
            });
            segments
        }
    }
}

/// Computes the momentum of a robot from a state of the plant `lcp`.
///
/// # Panics
/// If the state is not that of such a plant.
pub fn momentum(robot: &Robot, legs: &[&str], toe: bool, state: &PlantState) -> Momentum {
    let get = |name: &str| state.get(name).unwrap_or_else(|| panic!("{name}"));
    let vector = |name: &str| Vector3::from_column_slice(get(name));
    let [w, x, y, z] = get("body/orientation") else {
        panic!("body/orientation")
    };
    let attitude = UnitQuaternion::from_quaternion(Quaternion::new(*w, *x, *y, *z));
    let rate = vector("body/angular_velocity");
    // In trunk axes until the end.
    let velocity = attitude.inverse_transform_vector(&vector("body/velocity"));
    let mut bodies = vec![Body {
        mass: robot.trunk.mass,
        position: Vector3::zeros(),
        velocity,
        spin: Vector3::from(robot.trunk.inertia).component_mul(&rate),
    }];
    let mounts = robot.legs.iter();
    for mount in mounts.filter(|mount| legs.contains(&mount.name.as_str())) {
        let name = &mount.name;
        let mut angles = get(&format!("leg/{name}/angles")).to_vec();
        let mut rates = get(&format!("leg/{name}/rates")).to_vec();
        if let Some([angle, rate]) = state.get(&format!("leg/{name}/toe")) {
            angles.push(*angle);
            rates.push(*rate);
        }
        let mut joint = Vector3::from(mount.hip);
        // Velocity of the joint relative to the trunk.
        let mut joint_velocity = Vector3::zeros();
        for ((segment, angle), joint_rate) in
            segments(&mount.leg, toe).iter().zip(angles).zip(rates)
        {
            let along = Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle));
            let across = Vector3::new(libm::cos(angle), 0.0, libm::sin(angle));
            let position = joint + along * segment.centre;
            let relative = joint_velocity + across * (segment.centre * joint_rate);
            // Angles in the leg plane increase from −z towards x, against the y axis.
            let angular_velocity = rate - Vector3::y() * joint_rate;
            let moment = segment.moment;
            bodies.push(Body {
                mass: segment.mass,
                position,
                velocity: velocity + rate.cross(&position) + relative,
                spin: (angular_velocity - along * along.dot(&angular_velocity)) * moment,
            });
            joint += along * segment.length;
            joint_velocity += across * (segment.length * joint_rate);
        }
    }
    let mut momentum = total(&bodies, &attitude);
    momentum.centre += vector("body/position");
    momentum
}

fn total(bodies: &[Body], attitude: &UnitQuaternion<f64>) -> Momentum {
    let mass: f64 = bodies.iter().map(|body| body.mass).sum();
    let centre: Vector3<f64> = bodies.iter().map(|body| body.position * body.mass).sum();
    let centre = centre / mass;
    let linear: Vector3<f64> = bodies.iter().map(|body| body.velocity * body.mass).sum();
    let centre_velocity = linear / mass;
    let spins = bodies.iter().map(|body| {
        let orbital =
            (body.position - centre).cross(&((body.velocity - centre_velocity) * body.mass));
        orbital + body.spin
    });
    let spins: Vec<Vector3<f64>> = spins.collect();
    Momentum {
        linear: attitude.transform_vector(&linear),
        angular: attitude.transform_vector(&spins.iter().sum()),
        centre: attitude.transform_vector(&centre),
        linear_scale: bodies
            .iter()
            .map(|body| body.mass * body.velocity.norm())
            .sum(),
        angular_scale: spins.iter().map(Vector3::norm).sum(),
    }
}

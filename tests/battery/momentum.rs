//! Momentum of the robot, from its state and its file alone: the segments as rigid bodies, which a plant in generalised
//! coordinates does not know.

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
    /// Σ m |v| and Σ |angular momentum of each body|, by which the change of a sum is measured.
    pub linear_scale: f64,
    pub angular_scale: f64,
}

/// A rigid body: mass, place, velocity, and its own angular momentum.
struct Body {
    mass: f64,
    place: Vector3<f64>,
    velocity: Vector3<f64>,
    spin: Vector3<f64>,
}

/// The segments of a leg with its toe, if that is a segment of its own.
fn segments(leg: &Leg, toe: bool) -> Vec<Segment> {
    match leg.toe.filter(|_| toe) {
        None => Segment::of(leg).to_vec(),
        Some(toe) => {
            let mut bare = leg.clone();
            bare.mass.foot = 0.0;
            let mut segments = Segment::of(&bare).to_vec();
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

/// The momentum of a robot in a state of the plant `lcp`.
///
/// # Panics
/// If the state is not one of such a plant.
pub fn momentum(robot: &Robot, legs: &[&str], toe: bool, state: &PlantState) -> Momentum {
    let get = |name: &str| state.get(name).unwrap_or_else(|| panic!("{name}"));
    let vector = |name: &str| Vector3::from_column_slice(get(name));
    let [w, x, y, z] = get("body/orientation") else {
        panic!("body/orientation")
    };
    let attitude = UnitQuaternion::from_quaternion(Quaternion::new(*w, *x, *y, *z));
    let rate = vector("body/angular_velocity");
    // All in the trunk's axes until the end.
    let velocity = attitude.inverse_transform_vector(&vector("body/velocity"));
    let mut bodies = vec![Body {
        mass: robot.trunk.mass,
        place: Vector3::zeros(),
        velocity,
        spin: Vector3::from(robot.trunk.inertia).component_mul(&rate),
    }];
    let there = robot.legs.iter();
    for mount in there.filter(|mount| legs.contains(&mount.name.as_str())) {
        let name = &mount.name;
        let mut angles = get(&format!("leg/{name}/angles")).to_vec();
        let mut rates = get(&format!("leg/{name}/rates")).to_vec();
        if let Some([angle, rate]) = state.get(&format!("leg/{name}/toe")) {
            angles.push(*angle);
            rates.push(*rate);
        }
        let mut joint = Vector3::from(mount.hip);
        // Relative to the trunk.
        let mut carried = Vector3::zeros();
        for ((segment, angle), own) in segments(&mount.leg, toe).iter().zip(angles).zip(rates) {
            let along = Vector3::new(libm::sin(angle), 0.0, -libm::cos(angle));
            let across = Vector3::new(libm::cos(angle), 0.0, libm::sin(angle));
            let place = joint + along * segment.centre;
            let relative = carried + across * (segment.centre * own);
            // An angle in the leg plane grows from −z to x: against y.
            let turning = rate - Vector3::y() * own;
            let moment = segment.moment;
            bodies.push(Body {
                mass: segment.mass,
                place,
                velocity: velocity + rate.cross(&place) + relative,
                spin: (turning - along * along.dot(&turning)) * moment,
            });
            joint += along * segment.length;
            carried += across * (segment.length * own);
        }
    }
    total(&bodies, &attitude)
}

fn total(bodies: &[Body], attitude: &UnitQuaternion<f64>) -> Momentum {
    let mass: f64 = bodies.iter().map(|body| body.mass).sum();
    let centre: Vector3<f64> = bodies.iter().map(|body| body.place * body.mass).sum();
    let centre = centre / mass;
    let linear: Vector3<f64> = bodies.iter().map(|body| body.velocity * body.mass).sum();
    let drift = linear / mass;
    let spins = bodies.iter().map(|body| {
        let orbital = (body.place - centre).cross(&((body.velocity - drift) * body.mass));
        orbital + body.spin
    });
    let spins: Vec<Vector3<f64>> = spins.collect();
    Momentum {
        linear: attitude.transform_vector(&linear),
        angular: attitude.transform_vector(&spins.iter().sum()),
        linear_scale: bodies
            .iter()
            .map(|body| body.mass * body.velocity.norm())
            .sum(),
        angular_scale: spins.iter().map(Vector3::norm).sum(),
    }
}

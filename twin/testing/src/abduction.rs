//! Legs that abduct: joints, servos and random motions, and comparison of the equations of motion
//! of a plant with point masses and with locked joints.

use nalgebra::Vector3;
use twinrig_kernel::{SimDuration, SimTime, stream};
use twinrig_legged::{Base, Push, PushSchedule, PushShape, PushTarget, Segment};
use twinrig_robot::{Abduction, GRAVITY, LegMount, Robot, Servo};
use twinrig_runtime::{EnergyBalance, Plant, PlantState};

use crate::plant_harness::PlantHarness;
use crate::point_masses::abducted;
use crate::robots::{self, LEGS};

/// Joint about an axis beside and above the hip.
pub const JOINT: Abduction = Abduction {
    offset: 0.013,
    height: 0.021,
    abduction_max: 0.6,
    adduction_max: 0.3,
    friction: 2e-3,
};

/// Returns a servo of abduction, stronger or weaker.
pub fn servo(torque: f64) -> Servo {
    Servo {
        torque,
        speed: 6.0,
        lag: 0.02,
        dead_band: 0.0,
        inertia: 1e-5,
    }
}

/// Motion of a robot in the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tumble {
    /// Attitude of the trunk as a quaternion w, x, y, z of unit length.
    pub attitude: [f64; 4],
    /// Velocity \[m/s\] and angular velocity of the trunk \[rad/s\], trunk axes.
    pub velocity: [f64; 3],
    /// See [`Self::velocity`].
    pub turning: [f64; 3],
    /// Motion within each leg, of a coordinate of the plant, from −1 to 1.
    pub within: [f64; 4],
    /// Angles \[rad\] and rates of abduction \[rad/s\], by leg.
    pub angles: [f64; 4],
    /// See [`Self::angles`].
    pub rates: [f64; 4],
}

impl Tumble {
    /// A level trunk at rest, with legs at rest at zero.
    pub const AT_REST: Self = Self {
        attitude: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        turning: [0.0; 3],
        within: [0.0; 4],
        angles: [0.0; 4],
        rates: [0.0; 4],
    };

    /// Draws a motion in all coordinates, its joints between their stops.
    pub fn drawn(seed: u64) -> Self {
        let mut stream = stream(seed, "tumble");
        let mut drawn = |most: f64| most * (2.0 * stream.unit() - 1.0);
        let attitude: [f64; 4] = [1.0 + drawn(0.5), drawn(0.5), drawn(0.5), drawn(0.5)];
        let size = libm::sqrt(attitude.iter().map(|c| c * c).sum());
        Self {
            attitude: attitude.map(|c| c / size),
            velocity: std::array::from_fn(|_| drawn(1.0)),
            turning: std::array::from_fn(|_| drawn(4.0)),
            within: std::array::from_fn(|_| drawn(1.0)),
            angles: std::array::from_fn(|_| drawn(0.25)),
            rates: std::array::from_fn(|_| drawn(5.0)),
        }
    }

    /// Returns the state of a plant with this motion of trunk and joints.
    #[must_use]
    pub fn of_plant(&self, state: &PlantState) -> PlantState {
        let mut changed = state
            .clone()
            .with("body/orientation", &self.attitude)
            .with("body/velocity", &self.velocity)
            .with("body/angular_velocity", &self.turning);
        for (i, leg) in LEGS.iter().enumerate() {
            let joint = [self.angles[i], self.rates[i]];
            changed = changed.with(format!("leg/{leg}/abduction"), &joint);
        }
        changed
    }

    /// Returns the same with joints at rest at zero.
    #[must_use]
    pub fn upright(self) -> Self {
        Self {
            angles: [0.0; 4],
            rates: [0.0; 4],
            ..self
        }
    }
}

/// Returns pushes on a foot and on the trunk, in all directions, for a second.
pub fn pushes() -> PushSchedule {
    let push = |name: &str, target, peak| Push {
        name: name.to_owned(),
        target,
        at: SimTime::ZERO,
        duration: SimDuration::from_secs(1),
        shape: PushShape::HalfSine,
        peak,
    };
    let pushes = [
        push(
            "foot",
            PushTarget::Foot(LEGS[1].to_owned()),
            [0.4, -0.7, 0.5],
        ),
        push(
            "trunk",
            PushTarget::Trunk([0.05, 0.03, 0.02]),
            [1.0, 2.0, -1.0],
        ),
    ];
    PushSchedule::new(&pushes, Base::Free, &LEGS, &|_| true).expect("valid pushes")
}

/// Compares generalised forces of point masses with the expected ones. They are differences of
/// places known to 1e-16 m over 1e-4 s, and of velocities over 1e-6 s.
pub fn assert_forces(found: &[f64], expected: impl Fn(usize) -> f64) {
    for (i, force) in found.iter().enumerate() {
        let expected = expected(i);
        let size = 1e-5 * (1.0 + expected.abs());
        assert!((force - expected).abs() < size, "{i}: {force} {expected}");
    }
}

/// Checks that an energy balance closes within a share of the energy exchanged.
pub fn assert_closed(balance: &EnergyBalance, share: f64) {
    let most = share * balance.exchanged;
    assert!(balance.residual.abs() < most, "{balance:?}");
}

/// Compares the slope of a robot whose joints rest at zero with that of the robot with locked
/// ones; the numbers of the joints follow the others.
pub fn assert_locked(found: &[f64], locked: &[f64]) {
    assert_eq!(found.len(), locked.len() + 3 * LEGS.len());
    for (i, (found, locked)) in found.iter().zip(locked).enumerate() {
        let size = 1e-9 * (1.0 + locked.abs());
        assert!((found - locked).abs() < size, "{i}: {found} {locked}");
    }
}

/// Returns a robot whose legs move between their stops, as those of `passive-legs-free.toml`.
pub fn without_impacts() -> Robot {
    robots::with_legs(|leg| {
        leg.diagonal.preload = -4e-3;
        leg.parallel.preload = -4e-3;
        leg.abduction = Some(Abduction {
            abduction_max: 1.5,
            adduction_max: 1.5,
            ..JOINT
        });
    })
}

/// Returns the position of the axis of a leg with [`JOINT`], to the left \[m\].
pub fn axis_of(mount: &LegMount) -> f64 {
    mount.hip[1] - JOINT.offset.copysign(mount.hip[1])
}

/// Returns the moment of the weight of a leg about its axis of abduction \[N·m\], at an angle of
/// abduction and the angles of its segments: the sum of m g y, from the axis.
pub fn moment_of_weight(mount: &LegMount, angle: f64, segments: &[f64]) -> f64 {
    let (mut moment, mut joint) = (0.0, Vector3::zeros());
    for (segment, theta) in Segment::of(&mount.leg).iter().zip(segments) {
        let along = Vector3::new(libm::sin(*theta), 0.0, -libm::cos(*theta));
        let place = abducted(mount, angle, joint + along * segment.centre);
        moment += segment.mass * GRAVITY * (place.y - axis_of(mount));
        joint += along * segment.length;
    }
    moment
}

/// Checks that servos which hold hanging legs aside bear the moment of their weight, with errors of
/// angle and torque of at most `most` \[rad\], \[N·m\].
///
/// # Panics
/// If they do not.
pub fn assert_weight_is_borne<P: Plant>(
    plant: &mut PlantHarness<P>,
    robot: &Robot,
    most: [f64; 2],
) {
    let angle = 0.2;
    let hips_and_knees = plant.commands.len() - LEGS.len();
    assert_eq!(hips_and_knees, 2 * LEGS.len());
    plant.commands[hips_and_knees..].fill(angle);
    plant.advance_us(2_000_000);
    let state = plant.plant.state().unwrap();
    for mount in &robot.legs {
        let signal = |name: &str| format!("leg/{}/{name}", mount.name);
        let found = plant.value(&signal("abduction/position"));
        let moment = moment_of_weight(mount, found, state.get(&signal("angles")).unwrap());
        let torque = plant.value(&signal("abduction/torque"));
        let errors = [found - angle, torque - moment].map(f64::abs);
        let is_small = errors.iter().zip(most).all(|(error, most)| *error < most);
        assert!(is_small, "{}: {errors:?}, {moment} N·m", mount.name);
    }
}

/// Checks that legs which servos drive against their stops stay within `most` of these \[rad\].
///
/// # Panics
/// If they do not.
pub fn assert_stops_hold<P: Plant>(plant: &mut PlantHarness<P>, most: f64) {
    let sides = [1.0, -1.0, 1.0, -1.0];
    for (outwards, stop) in [(1.0, JOINT.abduction_max), (-1.0, -JOINT.adduction_max)] {
        for (command, side) in plant.commands.iter_mut().zip(sides) {
            *command = 2.0 * outwards * side;
        }
        plant.advance_us(1_000_000);
        for (leg, side) in LEGS.iter().zip(sides) {
            let angle = plant.value(&format!("leg/{leg}/abduction/position"));
            let beyond = side * angle - stop;
            assert!(beyond.abs() < most, "{leg}: {angle} rad, stop at {stop}");
        }
    }
}

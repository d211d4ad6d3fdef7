//! Comparison with trajectories of `tests/reference/reference.py`, which uses other coordinates,
//! another integrator (DOP853 to 1e-12) and another language.

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_legged::{Abduction, Base, Contacts, Drives, SetPoint, Setup};
use twinrig_robot::Robot;
use twinrig_robot::leg::LegCommand;
use twinrig_runtime::Plant;
use twinrig_testing::robots::robot;

use super::harness::{Harness, massless};

/// A case of the script, with its parameters.
struct Reference {
    golden: &'static str,
    legs: &'static [&'static str],
    base: Base,
    ground: bool,
    preload: f64,
    hips: fn(f64) -> Vec<f64>,
}

const SWING: Reference = Reference {
    golden: include_str!("../../../../ci/golden/massless/swing.csv"),
    legs: &["LF"],
    base: Base::Fixed,
    ground: false,
    preload: -0.004,
    hips: |t| vec![0.1 + 0.25 * (1.0 - libm::cos(15.0 * t))],
};

const FLIGHT: Reference = Reference {
    golden: include_str!("../../../../ci/golden/massless/flight.csv"),
    legs: &["LF", "LH"],
    base: Base::Planar,
    ground: false,
    preload: -0.004,
    hips: |t| {
        vec![
            0.1 + 0.2 * libm::sin(12.0 * t),
            -0.2 - 0.15 * libm::sin(9.0 * t),
        ]
    },
};

const STANCE: Reference = Reference {
    golden: include_str!("../../../../ci/golden/massless/stance.csv"),
    legs: &["LF", "LH"],
    base: Base::Planar,
    ground: true,
    preload: 0.0,
    hips: |t| vec![0.06 * (1.0 - libm::cos(20.0 * t)); 2],
};

impl Reference {
    fn robot(&self) -> Robot {
        let mut robot = robot();
        (robot.trunk.mass, robot.trunk.inertia) = (0.9, [9.375e-4, 3.2176e-3, 3.7801e-3]);
        (robot.actuators.hip.inertia, robot.actuators.knee.inertia) = (1e-3, 1e-3);
        for mount in &mut robot.legs {
            mount.leg = twinrig_robot::Leg::example();
            mount.leg.parallel_travel = 0.014;
            mount.leg.diagonal.preload = self.preload;
            mount.leg.parallel.preload = self.preload;
        }
        robot
    }

    fn setup(&self, step: SimDuration) -> Setup {
        let start = self
            .legs
            .iter()
            .zip((self.hips)(0.0))
            .map(|(leg, hip)| ((*leg).to_owned(), LegCommand { hip, knee: 0.0 }));
        Setup {
            base: self.base,
            legs: self.legs.iter().map(|leg| (*leg).to_owned()).collect(),
            ground: self
                .ground
                .then(|| Ground::new(Terrain::Flat, 1.0, 0.0).unwrap()),
            step,
            drives: Drives::Ideal { period: 5e-3 },
            abduction: Abduction::Locked,
            contacts: Contacts::Feet,
            set_point: SetPoint::Held,
            start: start.collect(),
        }
    }

    /// Greatest errors of positions \[m\], pitch \[rad\], hip torques \[N·m\] and ground forces
    /// \[N\].
    fn errors(&self, step_us: u64) -> [f64; 4] {
        let step = SimDuration::from_micros(step_us);
        let robot = self.robot();
        let mut harness = massless(&robot, &self.setup(step));
        let mut errors = [0.0_f64; 4];
        let mut now = 0;
        for row in self.golden.lines().skip(1) {
            let row: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
            let end = row[0] * 1e6 - 0.5;
            while (now as f64) < end {
                if (now + step_us) as f64 > end {
                    harness.plant.begin_window();
                }
                // Commands are constant during a step: the servo follows the command of its
                // midpoint.
                let middle_s = (now as f64 + 0.5 * step_us as f64) * 1e-6;
                for (pair, hip) in harness.commands.chunks_mut(2).zip((self.hips)(middle_s)) {
                    pair[0] = hip;
                }
                now += step_us;
                let end_of_step = SimTime::ZERO + SimDuration::from_micros(now);
                harness
                    .plant
                    .advance(end_of_step, &harness.commands)
                    .unwrap();
            }
            self.compare(&mut harness, &row, &mut errors);
        }
        errors
    }

    fn compare(&self, harness: &mut Harness, row: &[f64], errors: &mut [f64; 4]) {
        let mut note = |place: usize, found: f64, expected: f64| {
            errors[place] = errors[place].max((found - expected).abs());
        };
        let position = harness.read("body/position");
        note(0, position[0], row[1]);
        note(0, position[2], row[2]);
        note(1, harness.read("body/rpy")[1], row[3]);
        for (leg, expected) in self.legs.iter().zip(row[4..].chunks(5)) {
            let foot = harness.read(&format!("leg/{leg}/foot/position"));
            note(0, foot[0], expected[0]);
            note(0, foot[2], expected[1]);
            // Torques and forces are means over the last step: those of its midpoint, to second
            // order. The script gives the midpoint of a step of 1 ms.
            note(
                2,
                harness.value(&format!("leg/{leg}/hip/torque")),
                expected[2],
            );
            if self.ground {
                let force = harness.read(&format!("leg/{leg}/foot/force"));
                note(3, force[0], expected[3]);
                note(3, force[2], expected[4]);
            }
        }
    }
}

/// Second order: half the step, a quarter of the error. Between 1 ms and 0.5 ms the third order is
/// still noticeable.
fn assert_second_order(reference: &Reference, bounds_at_1_ms: [f64; 4]) {
    let (coarse, fine) = (reference.errors(1000), reference.errors(500));
    for place in 0..4 {
        assert!(
            coarse[place] <= bounds_at_1_ms[place],
            "{coarse:?} against {bounds_at_1_ms:?}"
        );
    }
    for place in 0..2 {
        let ratio = coarse[place] / fine[place];
        assert!(
            coarse[place] == 0.0 || (3.5..4.5).contains(&ratio),
            "halving the step divides the error by {ratio}: {coarse:?}, {fine:?}"
        );
    }
}

// The bounds are slightly above the errors of the midpoint rule at 1 ms. For comparison: the foot
// swings by 20 mm at 15 Hz, where (ωh)²/12 is 7e-4 of the phase a cycle; torques reach 0.4 N·m,
// forces 7.5 N.

#[test]
fn foot_in_the_air_follows_the_reference_to_second_order() {
    assert_second_order(&SWING, [5e-5, 0.0, 7e-4, 0.0]);
}

#[test]
fn robot_in_flight_follows_the_reference_to_second_order() {
    assert_second_order(&FLIGHT, [4e-5, 7e-5, 8e-4, 0.0]);
}

#[test]
fn swaying_robot_follows_the_reference_to_second_order() {
    assert_second_order(&STANCE, [2.5e-6, 3.5e-5, 8e-5, 1.3e-3]);
}

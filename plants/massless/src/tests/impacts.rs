//! Energy of impacts.

use twinrig_contact::{Ground, Terrain};
use twinrig_kernel::SimDuration;
use twinrig_legged::{Drives, Setup, StartPose};
use twinrig_robot::Servo;
use twinrig_runtime::EnergyBalance;
use twinrig_testing::robots::robot;

use super::harness::{massless, setup};

/// Weak servos with light rotors, which a fall saturates.
const WEAK: Servo = Servo {
    torque: 2.0,
    speed: 6.545,
    lag: 20e-3,
    dead_band: 5.236e-3,
    inertia: 1e-4,
};

/// Two legs that move, 91 mm above the ground.
fn fall() -> Setup {
    let terrain = Terrain::step_down(-50.0, 0.090_922_4);
    let start = StartPose {
        q: [27.8464_f64, -5.51783, 5.51783].map(f64::to_radians),
        rates: [4.0595, -7.5171, 10.518],
    };
    Setup {
        legs: ["LF", "RH"].map(str::to_owned).to_vec(),
        ground: Some(Ground::new(terrain, 1.16238, 0.0).unwrap()),
        drives: Drives::Servos {
            hip: WEAK,
            knee: WEAK,
        },
        step: SimDuration::from_micros(2000),
        start: start.into(),
        ..setup()
    }
}

/// Stored energy but for that of the drives: it cannot grow.
fn remaining(energy: &EnergyBalance) -> f64 {
    energy.stored() - energy.actuator
}

/// Asserts that impacts give no energy in a fall; returns the energies at its end.
fn assert_dissipative(setup: &Setup) -> EnergyBalance {
    let mut harness = massless(&robot(), setup);
    let mut before = harness.energy();
    let (mut least, mut error) = (remaining(&before), 0.0_f64);
    for ms in (2..=600).step_by(2) {
        harness.advance_to_ms(ms);
        let energy = harness.energy();
        assert!(energy.impact >= before.impact, "at {ms} ms: {energy:?}");
        // Up to the error of the balance, of either sign. Without a limit to the removal of
        // overlaps, impacts gave 4e-4 J in the first step; impulses of another mobility gave 19 J.
        least = least.min(remaining(&energy));
        error = error.max(energy.residual.abs());
        assert!(
            remaining(&energy) <= least + 2.0 * error + 1e-9 * energy.exchanged,
            "at {ms} ms: {least} J, {energy:?}"
        );
        before = energy;
    }
    before
}

#[test]
fn impacts_of_a_fall_that_saturates_servos_dissipate() {
    // After the landing some servo reaches and leaves its torque limit more often in a step than
    // is followed: the impulses must be those of the mobility with which they act.
    let energy = assert_dissipative(&fall());
    assert!(
        energy.impact > 0.1 && energy.residual.abs() < 1e-3 * energy.exchanged,
        "{energy:?}"
    );
}

#[test]
fn rebounds_have_at_most_the_energy_of_their_approach() {
    // A scenario cannot contain such a restitution; this simulates a defect.
    let mut setup = fall();
    if let Some(ground) = &mut setup.ground {
        ground.restitution = 2.0;
    }
    assert_dissipative(&setup);
}

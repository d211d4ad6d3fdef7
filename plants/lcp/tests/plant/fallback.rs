//! Fallback of the default method: it ends with its cause.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Plant;
use twinrig_testing::robots::robot;
use twinrig_testing::trot::Trot;

use crate::harness::{DEFAULT, lcp, standing_setup};

/// Number of steps of 2 ms.
const TROT: usize = 250;
const STAND: usize = 1000;

/// The events of a trot accumulate, and its steps fall back to the Moreau method. A robot that
/// stands on rigid feet has more contacts than degrees of freedom: the distribution of forces is
/// indeterminate, and the active constraints must be consistent with the signs of the motion.
#[test]
fn standing_after_trot_needs_no_fallbacks() {
    let robot = robot();
    let setup = Trot::START.started(&robot, standing_setup());
    let mut commands = Trot::START.sampled(&robot, &setup, 0, 500);
    let stance = Trot::START.sampled(&robot, &setup, 0, 2);
    commands.resize(commands.len() + STAND, stance[0].clone());
    let mut harness = lcp(&robot, &setup, DEFAULT);
    let mut fallbacks = Vec::new();
    for (tick, commands) in (1..).zip(&commands) {
        let at = SimTime::ZERO + SimDuration::from_millis(2 * tick);
        harness.plant.advance(at, commands).unwrap();
        fallbacks.push(harness.plant.work().fallbacks);
    }
    let between = |from: usize, to: usize| fallbacks[to - 1] - fallbacks[from - 1];
    assert!(
        2 * between(1, TROT) > TROT as u64,
        "{} in a trot",
        between(1, TROT)
    );
    let late = between(TROT + STAND / 2, TROT + STAND);
    assert_eq!(late, 0, "in the last second");
}

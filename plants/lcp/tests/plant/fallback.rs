//! The default method's fallback: it ends when its cause does.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::Plant;

use crate::scene::{DEFAULT, Scene, robot, standing};
use crate::trot;

/// Steps of two milliseconds.
const TROT: usize = 250;
const STAND: usize = 1000;

/// A trot's events crowd, and its steps are left to Moreau's rule. A robot that stands on rigid feet has more contacts than
/// freedoms: forces share as it happens, and the choice of active constraints agrees with the motion on their signs.
#[test]
fn a_robot_that_has_trotted_stands_without_fallbacks() {
    let robot = robot();
    let setup = trot::begun(&robot, standing());
    let mut commands = trot::commands(&robot, &setup, 0, 500);
    let still = trot::commands(&robot, &setup, 0, 2);
    commands.resize(commands.len() + STAND, still[0].clone());
    let mut scene = Scene::new(&robot, &setup, DEFAULT);
    let mut fallbacks = Vec::new();
    for (tick, commands) in (1..).zip(&commands) {
        let at = SimTime::ZERO + SimDuration::from_millis(2 * tick);
        scene.plant.advance(at, commands).unwrap();
        fallbacks.push(scene.plant.work().fallbacks);
    }
    let of = |from: usize, to: usize| fallbacks[to - 1] - fallbacks[from - 1];
    assert!(2 * of(1, TROT) > TROT as u64, "{} in a trot", of(1, TROT));
    let late = of(TROT + STAND / 2, TROT + STAND);
    assert_eq!(late, 0, "in the last second");
}

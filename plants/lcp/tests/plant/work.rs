//! What runs cost, counted: a method that begins to work harder, or a change that was to save work and does not, shows here
//! on every machine alike. Where a method is changed on purpose, what is found now is what it costs from then on.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_lcp::Method;
use twinrig_legged::Setup;
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

use crate::scene::{Scene, Way, below, hanging, hard, passive, robot, standing};
use crate::trot;

/// Steps, evaluations, factorisations, events, iterations of the solver, fallbacks.
type Work = [u64; 6];

fn work(robot: &Robot, setup: &Setup, method: Method, commands: &[Vec<f64>]) -> Work {
    let mut scene = Scene::new(robot, setup, Way::by(method, 2000));
    for (tick, commands) in (1..).zip(commands) {
        let at = SimTime::ZERO + SimDuration::from_millis(2 * tick);
        scene.plant.advance(at, commands).unwrap();
    }
    let work = scene.plant.work();
    [
        work.steps,
        work.evaluations,
        work.factorisations,
        work.events,
        work.solver_iterations,
        work.fallbacks,
    ]
}

/// A scene by RK4, RODAS4, Moreau's rule and the symplectic method, in steps of two milliseconds.
fn works(robot: &Robot, setup: &Setup, commands: &[Vec<f64>]) -> [Work; 4] {
    let methods = [
        Method::Rk4,
        Method::Rodas4,
        Method::Moreau,
        Method::SemiImplicit,
    ];
    methods.map(|method| work(robot, setup, method, commands))
}

#[test]
fn passive_legs_take_as_many_evaluations_as_ever() {
    let found = works(&robot(), &hanging(passive()), &vec![Vec::new(); 250]);
    assert_eq!(
        found,
        [
            [250, 1128, 20, 8, 0, 0],
            [250, 3344, 298, 8, 0, 0],
            [250, 250, 248, 8, 0, 0],
            [250, 250, 247, 8, 0, 0]
        ]
    );
}

#[test]
fn a_hard_hit_takes_as_many_evaluations_as_ever() {
    let found = works(&robot(), &hanging(hard()), &vec![Vec::new(); 250]);
    assert_eq!(
        found,
        [
            [250, 1335, 16, 8, 0, 0],
            [250, 3907, 341, 8, 0, 0],
            [251, 252, 243, 8, 0, 1],
            [250, 250, 482, 8, 0, 0]
        ]
    );
}

#[test]
fn a_robot_that_drops_takes_as_many_evaluations_as_ever() {
    let robot = robot();
    let mut setup = trot::begun(&robot, standing());
    setup.ground = Some(below(0.05, 0.6));
    let still = trot::commands(&robot, &setup, 0, 2);
    let found = works(&robot, &setup, &vec![still[0].clone(); 250]);
    assert_eq!(
        found,
        [
            [250, 1950, 1276, 68, 18_254, 200],
            [250, 26_632, 1938, 103, 18_254, 200],
            [250, 250, 1173, 41, 14_530, 0],
            [250, 500, 1005, 43, 4092, 0]
        ]
    );
}

#[test]
fn a_trot_takes_as_many_evaluations_as_ever() {
    let robot = robot();
    let setup = trot::begun(&robot, standing());
    let commands = trot::commands(&robot, &setup, 0, 1000);
    let found = works(&robot, &setup, &commands);
    assert_eq!(
        found,
        [
            [500, 2712, 1295, 99, 0, 498],
            [500, 47_601, 2499, 177, 0, 498],
            [500, 502, 1073, 46, 0, 0],
            [500, 1000, 2457, 61, 4, 0]
        ]
    );
}

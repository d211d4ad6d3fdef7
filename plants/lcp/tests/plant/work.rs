//! Work counts of runs, pinned: machine-independent detection of cost regressions and of
//! optimisations without effect. After an intentional change of a method, update the counts.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_lcp::Method;
use twinrig_legged::Setup;
use twinrig_robot::Robot;
use twinrig_runtime::Plant;
use twinrig_testing::robots::robot;
use twinrig_testing::trot::Trot;

use crate::harness::{
    Integration, hard_impact, lcp, lowered_ground, passive_start, standing_setup, suspended,
};

/// Steps, evaluations, factorisations, events, solver iterations, fallbacks.
type Work = [u64; 6];

fn work(robot: &Robot, setup: &Setup, method: Method, commands: &[Vec<f64>]) -> Work {
    let mut harness = lcp(robot, setup, Integration::new(method, 2000));
    for (tick, commands) in (1..).zip(commands) {
        let at = SimTime::ZERO + SimDuration::from_millis(2 * tick);
        harness.plant.advance(at, commands).unwrap();
    }
    let work = harness.plant.work();
    [
        work.steps,
        work.evaluations,
        work.factorisations,
        work.events,
        work.solver_iterations,
        work.fallbacks,
    ]
}

/// Returns the work of RK4, RODAS4, the Moreau method and the semi-implicit method, in steps of 2
/// ms.
fn work_by_method(robot: &Robot, setup: &Setup, commands: &[Vec<f64>]) -> [Work; 4] {
    let methods = [
        Method::Rk4,
        Method::Rodas4,
        Method::Moreau,
        Method::SemiImplicit,
    ];
    methods.map(|method| work(robot, setup, method, commands))
}

#[test]
fn work_of_passive_legs_is_pinned() {
    let found = work_by_method(
        &robot(),
        &suspended(passive_start()),
        &vec![Vec::new(); 250],
    );
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
fn work_of_hard_impact_is_pinned() {
    let found = work_by_method(&robot(), &suspended(hard_impact()), &vec![Vec::new(); 250]);
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
fn work_of_drop_is_pinned() {
    let robot = robot();
    let mut setup = Trot::START.started(&robot, standing_setup());
    setup.ground = Some(lowered_ground(0.05, 0.6));
    let stance = Trot::START.sampled(&robot, &setup, 0, 2);
    let found = work_by_method(&robot, &setup, &vec![stance[0].clone(); 250]);
    assert_eq!(
        found,
        [
            [277, 5508, 2013, 74, 44_822, 223],
            [279, 49_286, 3236, 160, 46_534, 218],
            [276, 308, 1959, 50, 44_822, 26],
            [250, 500, 1005, 43, 4092, 0]
        ]
    );
}

#[test]
fn work_of_trot_is_pinned() {
    let robot = robot();
    let setup = Trot::START.started(&robot, standing_setup());
    let commands = Trot::START.sampled(&robot, &setup, 0, 1000);
    let found = work_by_method(&robot, &setup, &commands);
    assert_eq!(
        found,
        [
            [502, 4054, 1321, 101, 0, 495],
            [502, 68_331, 2923, 181, 0, 495],
            [502, 506, 1089, 47, 0, 2],
            [500, 1000, 2457, 61, 4, 0]
        ]
    );
}

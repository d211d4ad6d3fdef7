//! Forces from energy tables against forces in closed form.

use twinrig_legged::Setup;
use twinrig_massless::Force;
use twinrig_robot::leg::{EnergyTable, Pantograph};
use twinrig_testing::robots::{robot, robot_named};
use twinrig_testing::trot::Trot;

use super::harness::{massless, setup, with_force};

/// Default number of cells along each axis.
const CELLS: usize = 64;

#[test]
fn default_tables_have_a_force_error_below_ten_millinewtons() {
    for name in ["cheetah-cub", "oncilla"] {
        let robot = robot_named(name);
        let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
        let error = EnergyTable::new(&leg, CELLS).unwrap().error();
        // Oncilla weighs 4.6 times as much: its forces are larger in proportion.
        let bound = 0.01 * robot.mass() / 1.1;
        assert!(error.force < bound, "{name}: {error:?}");
    }
}

#[test]
fn trot_with_tables_differs_within_the_stated_force_error() {
    let robot = robot();
    let start = Setup {
        start: Trot::START.legs(&robot, &setup(), 0.0).into(),
        ..setup()
    };
    let leg = Pantograph::new(&robot.legs[0].leg).unwrap();
    for cells in [32, CELLS] {
        let force = Force::Lookup { cells };
        let error = EnergyTable::new(&leg, cells).unwrap().error();
        let mut solved = massless(&robot, &start);
        let mut looked_up = with_force(&robot, &start, force);
        for ms in 1..=50 {
            solved.trot(&robot, &start, Trot::START, ms);
            looked_up.trot(&robot, &start, Trot::START, ms);
        }
        // Until the first foot lands again no difference is amplified: a force error of δ on all
        // four feet moves the trunk by ½ · 4δ/m · t² at most.
        let bound = 0.5 * 4.0 * error.force / robot.mass() * 0.05 * 0.05;
        let (a, b) = (
            solved.read("body/position"),
            looked_up.read("body/position"),
        );
        let difference = (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
        assert!(
            difference < bound,
            "{cells} cells: {difference:e} of {bound:e} m"
        );
        assert!(difference > 0.0, "a table was used");
    }
}

//! How far a foot may be off, over 0.3 s at steps of 2 ms.

use twinrig_lcp::Method;
use twinrig_legged::Start;
use twinrig_robot::Robot;
use twinrig_runtime::Plant;

use crate::scene::{
    DEFAULT, Scene, Way, between, hanging, hard, passive, rmse, robot, stiffened, swinging,
};

/// A method that has none of the default's errors.
const EXACT: Way = Way::by(Method::Rodas4, 2000).within(1e-12);

/// Error of the first leg's foot \[m\].
fn error(robot: &Robot, start: &Start, way: Way) -> f64 {
    let setup = hanging(start.clone());
    let right = Scene::new(robot, &setup, EXACT).trace("LF", 300);
    let mut scene = Scene::new(robot, &setup, way);
    let feet = scene.trace("LF", 300);
    assert_eq!(scene.plant.work().fallbacks, 0);
    rmse(&feet, &right)
}

#[test]
fn the_reference_is_what_short_steps_of_another_method_come_to() {
    let short = Way::by(Method::Rk4, 10).within(f64::INFINITY);
    for (robot, start) in [
        (robot(), passive()),
        (robot(), hard()),
        (between(), swinging()),
        (stiffened(100.0), passive()),
        (stiffened(100.0), hard()),
    ] {
        let error = error(&robot, &start, short);
        assert!(error < 1e-9, "{error:e}");
    }
}

#[test]
fn legs_that_swing_between_their_stops_are_right_to_two_micrometres() {
    let error = error(&between(), &swinging(), DEFAULT);
    assert!(error < 2e-6, "{error:e}");
}

#[test]
fn legs_that_reach_their_stops_are_right_to_a_micrometre_however_hard() {
    for start in [passive(), hard()] {
        let error = error(&robot(), &start, DEFAULT);
        assert!(error < 1e-6, "{error:e}");
    }
}

#[test]
fn legs_up_to_a_hundred_times_as_stiff_are_right_to_ten_micrometres() {
    for times in [1.0, 3.0, 10.0, 30.0, 100.0] {
        // As many newtons at the stops, or as many millimetres.
        let mut loaded = stiffened(times);
        for mount in &mut loaded.legs {
            mount.leg.diagonal.preload *= times;
            mount.leg.parallel.preload *= times;
        }
        for robot in [stiffened(times), loaded] {
            for start in [passive(), hard()] {
                let error = error(&robot, &start, DEFAULT);
                assert!(error < 1e-5, "stiffness × {times}: {error:e}");
            }
        }
    }
}

#[test]
fn the_stiff_method_is_right_to_ten_nanometres_where_it_is_told_to() {
    for (robot, start) in [
        (robot(), passive()),
        (robot(), hard()),
        (between(), swinging()),
    ] {
        let error = error(&robot, &start, Way::by(Method::Rodas4, 2000).within(1e-8));
        assert!(error < 1e-8, "{error:e}");
    }
}

#[test]
fn plain_motions_are_not_cut_to_pieces() {
    // Five evaluations a step; a fifth more at most where stops are looked for and reached.
    for (robot, start) in [(robot(), passive()), (robot(), hard())] {
        let mut scene = Scene::new(&robot, &hanging(start), DEFAULT);
        scene.to_ms(300);
        let work = scene.plant.work();
        assert!(work.evaluations < 6 * work.steps + 50, "{work:?}");
    }
}

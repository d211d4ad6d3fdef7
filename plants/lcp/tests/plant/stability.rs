//! Steps that are too long say so, and soon.

use twinrig_lcp::Method;
use twinrig_legged::{Drives, Setup};
use twinrig_robot::Robot;

use crate::scene::{
    Scene, WAYS, Way, below, between, hanging, hard, passive, robot, standing, swinging,
};

fn scenes() -> Vec<(&'static str, Robot, Setup)> {
    let ground = Some(below(0.1, 0.6));
    let drop = Setup {
        ground: ground.clone(),
        ..standing()
    };
    let limp = Setup {
        ground,
        drives: Drives::None,
        ..standing()
    };
    vec![
        ("passive", robot(), hanging(passive())),
        ("hard", robot(), hanging(hard())),
        ("between", between(), hanging(swinging())),
        ("drop", robot(), drop),
        ("limp", robot(), limp),
    ]
}

/// What stopped it, and after how much of the time.
fn stopped(robot: &Robot, setup: &Setup, way: Way, seconds: f64) -> Option<(String, f64)> {
    let mut scene = Scene::new(robot, setup, way);
    let fault = scene.soundly(seconds).err()?;
    assert_eq!(fault.part, "integrator", "{fault}");
    assert!(fault.energy.is_finite());
    Some((fault.why, scene.now_us as f64 * 1e-6))
}

#[test]
fn steps_beyond_the_limit_of_stability_end_in_a_fault_that_says_so() {
    for (name, robot, setup) in scenes() {
        for (method, step_us) in [
            (Method::ExplicitEuler, 2000),
            (Method::ExplicitEuler, 5000),
            (Method::ExplicitEuler, 10_000),
            (Method::SemiImplicit, 10_000),
            (Method::SemiImplicit, 30_000),
            (Method::Thesis, 10_000),
            (Method::Thesis, 30_000),
        ] {
            let way = Way::by(method, step_us);
            let (why, at) = stopped(&robot, &setup, way, 1.0)
                .unwrap_or_else(|| panic!("{name} by {way:?} ran through"));
            assert!(why.contains("unstable"), "{name} by {way:?}: {why}");
            // Before it has made a plausible curve: what falls has to land first.
            let landing = if name == "drop" { 0.25 } else { 0.0 };
            assert!(at < landing + 0.1, "{name} by {way:?}: {at} s");
        }
    }
}

#[test]
fn the_default_with_its_error_control_off_is_stopped_where_it_is_too_long() {
    for (name, robot, setup) in &scenes()[1..3] {
        let way = Way::by(Method::Rk4, 10_000).within(f64::INFINITY);
        let (why, _) = stopped(robot, setup, way, 1.0).unwrap();
        assert!(why.contains("unstable"), "{name}: {why}");
    }
}

#[test]
fn with_its_error_control_on_it_takes_any_step() {
    for (name, robot, setup) in &scenes()[..3] {
        for method in [Method::Rk4, Method::Rodas4] {
            let ends = [2000, 50_000].map(|step_us| {
                let mut scene = Scene::new(robot, setup, Way::by(method, step_us));
                scene.soundly(0.3).unwrap();
                scene.read("leg/LF/foot/position")
            });
            for (a, b) in ends[0].iter().zip(&ends[1]) {
                assert!((a - b).abs() < 1e-5, "{name} by {method:?}: {a} and {b}");
            }
        }
    }
}

#[test]
fn steps_that_methods_are_good_for_are_let_through() {
    let shorter = [
        Way::by(Method::SemiImplicit, 2000),
        Way::by(Method::ExplicitEuler, 100),
        Way::by(Method::Thesis, 20),
    ];
    for (name, robot, setup) in scenes() {
        for way in WAYS.iter().chain(&shorter) {
            let stopped = stopped(&robot, &setup, *way, 0.5);
            assert_eq!(stopped, None, "{name} by {way:?}");
        }
    }
}

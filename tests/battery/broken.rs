//! A law that cannot fail says nothing: each sees a sound run keep it and a broken one break it. The broken plants are the
//! methods that are kept for comparison, passed off as the one that a case names.

use twinrig::Registry;

use crate::case::{Base, Case, Method, Task};
use crate::law::{Finding, Law};
use crate::run::{Run, robot, run, run_text};

/// The first case that is wanted.
fn case(wanted: impl Fn(&Case) -> bool) -> Case {
    let robot = robot();
    let found = (0..10_000)
        .map(|seed| Case::drawn(seed, &robot))
        .find(|case| wanted(case));
    found.expect("there are all kinds of cases")
}

/// A robot that falls on level ground, without anything else about it.
fn falls(case: &Case) -> bool {
    let plain = case.joint_friction.is_none() && case.heights.is_none() && !case.toe;
    plain && case.task == Task::Drop && case.base == Base::Free && case.height > 0.02
}

fn sound(case: &Case) -> Run {
    run(&Registry::standard(), case).unwrap_or_else(|error| panic!("{error}"))
}

/// The case by another integrator of `lcp`, in the steps of its own.
fn passed_off(case: &Case, integrator: &str) -> Run {
    let own = format!("integrator = \"{}\"", case.method.name());
    let other = format!("integrator = \"{integrator}\"");
    let text = case.scenario().replace(&own, &other);
    assert!(text.contains(&other), "{text}");
    run_text(&Registry::standard(), case, &text).unwrap_or_else(|error| panic!("{error}"))
}

/// The law is kept by one run and broken by the other.
fn tells_apart(law: Law, sound: &Run, broken: &Run) {
    let judged = |run: &Run| law.judge(run).as_ref().map(Finding::is_violation);
    assert_eq!(
        judged(sound),
        Some(false),
        "{law:?}, case {}",
        sound.case.seed
    );
    assert_eq!(
        judged(broken),
        Some(true),
        "{law:?}, case {}",
        broken.case.seed
    );
}

#[test]
fn a_plant_that_stops_is_seen() {
    let case = case(|case| case.method == Method::Rk4 && falls(case));
    tells_apart(
        Law::Refusal,
        &sound(&case),
        &passed_off(&case, "explicit-euler"),
    );
}

#[test]
fn feet_in_the_ground_are_seen() {
    let case = case(|case| case.method == Method::Rk4 && falls(case));
    // Its contacts are found at the ends of steps, and corrected by and by.
    tells_apart(
        Law::Penetration,
        &sound(&case),
        &passed_off(&case, "thesis"),
    );
}

/// Every plant refuses to go on with friction that gives energy in all, so the energy balance is altered here.
#[test]
fn friction_that_gives_energy_is_seen() {
    let case = case(|case| case.method == Method::Massless && falls(case));
    let sound = sound(&case);
    let mut broken = sound.clone();
    let [.., before, last] = broken.samples.as_mut_slice() else {
        panic!("it ran");
    };
    last.energy.dissipated = before.energy.dissipated - 2e-9;
    tells_apart(Law::Dissipation, &sound, &broken);
}

#[test]
fn energy_out_of_nothing_is_seen() {
    let wanted = |case: &Case| case.method == Method::Moreau && falls(case) && case.is_passive();
    let case = case(wanted);
    // As published, the thesis' scheme makes energy at every stop.
    tells_apart(Law::Energy, &sound(&case), &passed_off(&case, "thesis"));
}

#[test]
fn momentum_from_nowhere_is_seen() {
    let case = Case {
        tolerance: Some(1e-9),
        ..case(|case| case.method == Method::Rodas4 && falls(case))
    };
    tells_apart(
        Law::Momentum,
        &sound(&case),
        &passed_off(&case, "semi-implicit"),
    );
}

#[test]
fn ground_that_holds_feet_by_more_than_friction_is_seen() {
    let wanted = |case: &Case| case.method == Method::Rk4 && falls(case) && case.friction > 0.1;
    let case = case(wanted);
    // A thousandth more than the case has.
    let own = format!("ground = {{ friction = {}", case.friction);
    let other = format!("ground = {{ friction = {}", 1.001 * case.friction);
    let text = case.scenario().replace(&own, &other);
    assert!(text.contains(&other), "{text}");
    let rough = run_text(&Registry::standard(), &case, &text);
    let rough = rough.unwrap_or_else(|error| panic!("{error}"));
    tells_apart(Law::Friction, &sound(&case), &rough);
}

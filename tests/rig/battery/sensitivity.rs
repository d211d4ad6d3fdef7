//! Sensitivity of the laws: each is satisfied by a valid run and violated by a faulty one. The
//! faulty runs use the integrators kept for comparison in place of that of the case.

use twinrig::Registry;

use crate::battery::case::{Base, Case, Method, Task};
use crate::battery::law::{Finding, Law};
use crate::battery::run::{Run, robot, run, run_text};

/// Returns the first case that satisfies `predicate`.
fn case(predicate: impl Fn(&Case) -> bool) -> Case {
    let robot = robot();
    let found = (0..10_000)
        .map(|seed| Case::random(seed, &robot))
        .find(|case| predicate(case));
    found.expect("cases of every kind are drawn")
}

/// Whether the case is a drop of the unmodified robot on level ground.
fn is_plain_drop(case: &Case) -> bool {
    let unmodified = case.joint_friction.is_none() && case.heights.is_none() && !case.toe;
    unmodified && case.task == Task::Drop && case.base == Base::Free && case.height > 0.02
}

fn valid_run(case: &Case) -> Run {
    run(&Registry::standard(), case).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs the case with another integrator of `lcp`, at an unchanged step.
fn run_with_integrator(case: &Case, integrator: &str) -> Run {
    let original = format!("integrator = \"{}\"", case.method.name());
    let other = format!("integrator = \"{integrator}\"");
    let text = case.scenario().replace(&original, &other);
    assert!(text.contains(&other), "{text}");
    run_text(&Registry::standard(), case, &text).unwrap_or_else(|error| panic!("{error}"))
}

/// Asserts that the valid run satisfies the law and the faulty one violates it.
fn assert_discriminates(law: Law, valid: &Run, faulty: &Run) {
    let judged = |run: &Run| law.judge(run).as_ref().map(Finding::is_violation);
    assert_eq!(
        judged(valid),
        Some(false),
        "{law:?}, case {}",
        valid.case.seed
    );
    assert_eq!(
        judged(faulty),
        Some(true),
        "{law:?}, case {}",
        faulty.case.seed
    );
}

#[test]
fn refusal_is_detected() {
    let case = case(|case| case.method == Method::Rk4 && is_plain_drop(case));
    assert_discriminates(
        Law::Refusal,
        &valid_run(&case),
        &run_with_integrator(&case, "explicit-euler"),
    );
}

#[test]
fn penetration_is_detected() {
    let case = case(|case| case.method == Method::Rk4 && is_plain_drop(case));
    // This integrator detects contacts at the ends of steps and corrects them gradually.
    assert_discriminates(
        Law::Penetration,
        &valid_run(&case),
        &run_with_integrator(&case, "thesis"),
    );
}

/// Every plant ends with an error if friction supplies energy in total; the energy balance is
/// therefore altered here.
#[test]
fn energy_gain_by_friction_is_detected() {
    let case = case(|case| case.method == Method::Massless && is_plain_drop(case));
    let valid = valid_run(&case);
    let mut faulty = valid.clone();
    let [.., before, last] = faulty.samples.as_mut_slice() else {
        panic!("fewer than two samples");
    };
    last.energy.dissipated = before.energy.dissipated - 2e-9;
    assert_discriminates(Law::Dissipation, &valid, &faulty);
}

#[test]
fn energy_gain_of_a_passive_robot_is_detected() {
    let is_suitable =
        |case: &Case| case.method == Method::Moreau && is_plain_drop(case) && case.is_passive();
    let case = case(is_suitable);
    // The published scheme of the thesis generates energy at every joint stop.
    assert_discriminates(
        Law::Energy,
        &valid_run(&case),
        &run_with_integrator(&case, "thesis"),
    );
}

#[test]
fn momentum_change_in_flight_is_detected() {
    let case = Case {
        tolerance: Some(1e-9),
        ..case(|case| case.method == Method::Rodas4 && is_plain_drop(case))
    };
    assert_discriminates(
        Law::Momentum,
        &valid_run(&case),
        &run_with_integrator(&case, "semi-implicit"),
    );
}

#[test]
fn force_outside_the_friction_cone_is_detected() {
    let is_suitable =
        |case: &Case| case.method == Method::Rk4 && is_plain_drop(case) && case.friction > 0.1;
    let case = case(is_suitable);
    // Friction coefficient a thousandth above that of the case.
    let original = format!("ground = {{ friction = {}", case.friction);
    let other = format!("ground = {{ friction = {}", 1.001 * case.friction);
    let text = case.scenario().replace(&original, &other);
    assert!(text.contains(&other), "{text}");
    let rough = run_text(&Registry::standard(), &case, &text);
    let rough = rough.unwrap_or_else(|error| panic!("{error}"));
    assert_discriminates(Law::Friction, &valid_run(&case), &rough);
}

/// Every plant ends with an error if a knee passes the straight leg; an angle is therefore altered
/// here.
#[test]
fn knee_that_bends_the_other_way_is_detected() {
    let case = case(|case| case.method == Method::Massless && is_plain_drop(case));
    let valid = valid_run(&case);
    let mut faulty = valid.clone();
    let last = faulty.samples.last_mut().expect("a run has samples");
    let [first, second, _] = &mut last.angles[0];
    *second = 2.0 * *first - *second;
    assert_discriminates(Law::AssemblyMode, &valid, &faulty);
}

/// Methods that check each impact end with an error if one gives energy; the balance is therefore
/// altered here.
#[test]
fn energy_gain_by_an_impact_is_detected() {
    let case = case(|case| case.method == Method::Rk4 && is_plain_drop(case));
    let valid = valid_run(&case);
    let mut faulty = valid.clone();
    let [.., before, last] = faulty.samples.as_mut_slice() else {
        panic!("fewer than two samples");
    };
    last.energy.impact = before.energy.impact - 2e-9 * last.energy.exchanged.max(1e-3);
    assert_discriminates(Law::Impact, &valid, &faulty);
}

#[test]
fn rise_of_the_energy_is_detected() {
    let is_suitable =
        |case: &Case| case.method == Method::Rk4 && is_plain_drop(case) && case.is_passive();
    let valid = valid_run(&case(is_suitable));
    let mut faulty = valid.clone();
    // A gain that the residual of the balance does not contain.
    let last = faulty.samples.last_mut().expect("a run has samples");
    last.energy.kinetic += 1e-2 * last.energy.exchanged;
    assert_discriminates(Law::Rise, &valid, &faulty);
}

#[test]
fn depth_of_feet_is_detected() {
    let case = case(|case| case.method == Method::Rk4 && is_plain_drop(case));
    assert_discriminates(
        Law::Depth,
        &valid_run(&case),
        &run_with_integrator(&case, "thesis"),
    );
}

//! Study of stability: the largest stable step.

use twinrig_kernel::SimDuration;
use twinrig_study::{Factor, RowKind, StabilityPlan, Status, Study, stability};

use crate::oscillator::{OMEGA, Oscillators, ZETA};
use crate::precision::without_clock;

pub fn study(factory: &Oscillators, factors: &[Factor]) -> Study {
    let plan = StabilityPlan {
        duration: SimDuration::from_secs(4),
        compared: Some(SimDuration::from_millis(100)),
        least: SimDuration::from_micros(20),
        ratio: 1.02,
        factors: factors.into(),
        budget_s: 1e9,
        ..StabilityPlan::default()
    };
    stability(factory, &plan, &mut ()).unwrap()
}

fn limit(study: &Study, method: &str, stiffness: f64) -> f64 {
    let mut rows = study.rows.iter();
    let row = rows.find(|row| row.method == method && row.scales.stiffness == stiffness);
    let row = row.unwrap();
    assert_eq!(
        (row.status, row.kind),
        (Status::Ok, RowKind::Stability),
        "{row:?}"
    );
    row.largest_stable_step_s.unwrap()
}

fn assert_near(found: f64, expected: f64) {
    assert!(
        (found / expected - 1.0).abs() < 0.04,
        "{found} instead of {expected}"
    );
}

#[test]
fn explicit_euler_limit_is_inverse_to_stiffness() {
    let found = study(
        &Oscillators::new(&["rk4", "explicit-euler"], 200),
        &[Factor::Stiffness],
    );
    for stiffness in [1.0, 0.5, 0.25] {
        let expected = 2.0 * ZETA / OMEGA / stiffness;
        assert_near(limit(&found, "explicit-euler", stiffness), expected);
    }
    let above = found
        .rows
        .iter()
        .find(|row| row.method == "explicit-euler")
        .unwrap();
    assert!(above.least_unstable_step_s.unwrap() <= 1.021 * above.largest_stable_step_s.unwrap());
    assert!(above.cost_per_step_s.unwrap() > 0.0);
}

#[test]
fn semi_implicit_and_runge_kutta_are_limited_by_the_frequency() {
    let found = study(
        &Oscillators::new(&["rk4", "semi-implicit"], 200).undamped(),
        &[],
    );
    assert_near(limit(&found, "semi-implicit", 1.0), 2.0 / OMEGA);
    assert_near(limit(&found, "rk4", 1.0), 8.0_f64.sqrt() / OMEGA);
}

#[test]
fn missing_decay_is_unstable() {
    let found = study(&Oscillators::new(&["rk4", "undecaying"], 200), &[]);
    let row = &found.rows[1];
    assert_eq!(
        (row.status, row.largest_stable_step_s),
        (Status::Unstable, None)
    );
    assert!(row.why.as_ref().unwrap().contains("stays"), "{row:?}");
    let free = study(
        &Oscillators::new(&["rk4", "undecaying"], 200).undamped(),
        &[],
    );
    assert_eq!(free.rows[1].status, Status::Ok, "{:?}", free.rows[1]);
}

#[test]
fn stable_but_inaccurate_step_is_marked() {
    let found = study(&Oscillators::new(&["rk4", "semi-implicit"], 200), &[]);
    let row = &found.rows[1];
    assert!(row.wrong && row.status == Status::Ok, "{row:?}");
    assert!(row.error_rms_m.unwrap() > 1e-3);
}

#[test]
fn unstable_and_unbuildable_variants_are_rows() {
    let found = study(
        &Oscillators::new(&["rk4", "brittle", "unbuildable"], 200),
        &[],
    );
    let [_, brittle, unbuildable] = &found.rows[..] else {
        panic!("{:?}", found.rows);
    };
    assert_eq!(
        (brittle.status, brittle.largest_stable_step_s),
        (Status::Unstable, None)
    );
    assert!(
        brittle.why.as_ref().unwrap().contains("it snapped"),
        "{brittle:?}"
    );
    assert_eq!(unbuildable.status, Status::Failed);
    assert!(
        unbuildable
            .why
            .as_ref()
            .unwrap()
            .contains("no such oscillator")
    );
}

#[test]
fn adaptive_method_has_a_mean_step_and_no_limit() {
    let found = study(&Oscillators::new(&["rk4", "tolerant"], 200), &[]);
    let row = &found.rows[1];
    assert_eq!(
        (row.status, row.tolerance, row.step_s),
        (Status::Ok, Some(1e-6), None)
    );
    assert!(row.mean_step_s.unwrap() > 0.0 && row.largest_stable_step_s.is_none());
}

#[test]
fn ineffective_factors_are_left_out_with_reason() {
    let found = study(&Oscillators::new(&["rk4"], 200), &Factor::ALL);
    assert_eq!(
        found.left_out,
        [
            "gain of the position loop: nothing drives the legs",
            "friction of the ground: there is no ground",
            "restitution of the ground: there is no ground",
        ]
    );
    // Ten values of stiffness, five more of mass, four more of damping.
    assert_eq!(found.rows.len(), 19);
}

#[test]
fn studies_are_reproducible_except_for_run_times() {
    let factory = Oscillators::new(&["rk4", "semi-implicit", "tolerant"], 200);
    let found = || without_clock(&study(&factory, &[Factor::Damping]));
    assert_eq!(found(), found());
}

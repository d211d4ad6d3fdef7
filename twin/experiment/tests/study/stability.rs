//! Study of stability: the largest stable step.

use twinrig_experiment::{Factor, Machine, Row, RowKind, StabilityPlan, Status, Study, stability};
use twinrig_kernel::SimDuration;

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
            "gain of the position loop: the legs have no position servos",
            "friction of the ground: there is no ground",
            "restitution of the ground: there is no ground",
        ]
    );
    // Ten values of stiffness, five more of mass, four more of damping.
    assert_eq!(found.rows.len(), 19);
}

/// Rows of the plant with error control, by the values of a factor.
fn compliant_rows(study: &Study, factor: Factor) -> Vec<(f64, &Row)> {
    let rows = study.rows.iter().filter(|row| row.plant.is_compliant());
    rows.filter_map(|row| Some((factor.of(&row.scales)?, row)))
        .collect()
}

#[test]
fn compliant_plant_completes_or_refuses_over_its_factors() {
    let found = study(
        &Oscillators::new(&["rk4"], 200).with_error_control(),
        &Factor::ALL,
    );
    let of_compliance = |row: &&Row| {
        row.scales.compliance != 1.0
            || row.scales.compliance_damping != 1.0
            || row.scales.longest_step_s.is_some()
    };
    let varied = found.rows.iter().filter(of_compliance);
    assert!(varied.clone().all(|row| row.plant.is_compliant()));
    assert_eq!(varied.count(), 6 + 6 + 3);
    // How a sole rebounds follows from its damping; nothing drives the legs.
    assert!(compliant_rows(&found, Factor::Restitution).is_empty());
    assert_eq!(compliant_rows(&found, Factor::Speed).len(), 1);
    assert_eq!(compliant_rows(&found, Factor::Friction).len(), 5);
    for (value, row) in compliant_rows(&found, Factor::ComplianceDamping) {
        let refused = value == 1e4;
        let expected = if refused { Status::Refused } else { Status::Ok };
        assert_eq!(
            (row.status, row.why.is_some()),
            (expected, refused),
            "{row:?}"
        );
        assert_eq!(row.least_substep_s.is_some(), !refused);
    }
}

#[test]
fn trend_of_error_control_has_the_work_and_every_failure() {
    let found = study(
        &Oscillators::new(&["rk4", "tolerant"], 200).with_error_control(),
        &[Factor::ComplianceDamping],
    );
    let trends = found.error_control_trends();
    let [trend] = &trends[..] else {
        panic!("rigid plants have none: {trends:?}");
    };
    assert_eq!(trend.plant, "full, compliant");
    assert_eq!((trend.runs, trend.completed), ([6, 7], Some([0.0, 1e3])));
    assert_eq!(trend.least_substep_s, Some(1e-3));
    let [least, greatest] = trend.evaluations_per_s.unwrap();
    assert!(least > 0.0 && greatest > least, "{trend:?}");
    assert!(trend.error_rms_m.unwrap() < 1e-4, "{trend:?}");
    let [(value, why)] = &trend.failures[..] else {
        panic!("{trend:?}");
    };
    assert_eq!(*value, 1e4);
    assert!(
        why.starts_with("refused: ") && why.contains("too stiff"),
        "{why}"
    );
    let page = found
        .page(&Machine::here("test", "release"), "twin study stability")
        .html();
    for part in [
        "Compliant constraints",
        "refused",
        "damping of the compliance",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let json = found.json(&Machine::here("test", "release"), "");
    assert_eq!(json["error_control"][0]["failures"][0][0], 1e4);
    assert!(
        found
            .csv()
            .lines()
            .next()
            .unwrap()
            .contains("least_substep_s")
    );
}

#[test]
fn studies_are_reproducible_except_for_run_times() {
    let factory = Oscillators::new(&["rk4", "semi-implicit", "tolerant"], 200);
    let found = || without_clock(&study(&factory, &[Factor::Damping]));
    assert_eq!(found(), found());
}

use twinrig_campaign::sweep::ExpectationVerdict;
use twinrig_rig::registry::Registry;
use twinrig_rig::report::ErrorSource;
use twinrig_scenario::Setting;

use super::*;
use crate::runs::scene::tests::trot;

/// A run of an expectation with an upper limit of 1 and this margin; none: not observed.
fn ran(margin: Option<f64>) -> RowExpectation {
    let verdict = match margin {
        Some(margin) if margin >= 0.0 => ExpectationVerdict::Pass,
        Some(_) => ExpectationVerdict::Fail,
        None => ExpectationVerdict::Unobserved,
    };
    RowExpectation {
        name: "it".to_owned(),
        verdict,
        holds: verdict == ExpectationVerdict::Pass,
        measured: margin.map(|margin| 1.0 - margin),
        bound: Some(1.0),
        margin,
        unit: "m".to_owned(),
        detail: String::new(),
    }
}

fn setting(key: &str, value: &str) -> Setting {
    Setting {
        origin: "--set".to_owned(),
        key: key.to_owned(),
        value: value.to_owned(),
    }
}

/// A footstep, a speed, a count, a residual and missed deadlines.
fn expectations() -> [Expectation; 5] {
    let claims = [
        "footstep = { slip = { max = \"1 m\" } }",
        "body = { speed = { min = \"0.1 m/s\" } }",
        "footstep = { count = { min = 1 } }",
        "energy = { residual = { max = 1e-5 } }",
        "timing = { of = \"control\", deadline_misses = { max = 0 } }",
    ];
    let claims: Vec<String> = claims
        .iter()
        .map(|claim| format!("{{ {claim} }}"))
        .collect();
    let registry = Registry::standard();
    let scene = trot(&registry, "'1 s'", None);
    let settings = [setting("expect", &format!("[{}]", claims.join(", ")))];
    let assembly = scene.assembly(&registry, &settings).unwrap();
    assembly.scenario().expectations.clone().try_into().unwrap()
}

/// Bar of an expectation with these margins at finer settings and from perturbed starts.
fn bar_of(
    of: &Expectation,
    ratio: f64,
    finer: &[Option<f64>],
    perturbed: &[Option<f64>],
    beyond: bool,
) -> (ErrorBar, bool) {
    let rows = |margins: &[Option<f64>]| margins.iter().map(|&margin| Some(ran(margin))).collect();
    let runs = Runs {
        kind: of.value_kind(),
        beyond,
        finer: rows(finer),
        perturbed: rows(perturbed),
        ratio,
    };
    (runs.bar(), runs.are_open())
}

fn refined(of: &Expectation, margins: [f64; 3]) -> ErrorBar {
    bar_of(of, 0.1, &margins.map(Some), &[], false).0
}

#[test]
fn error_covers_the_limit_of_a_geometric_sequence() {
    let [slip, speed, ..] = &expectations();
    for (ratio, sign) in [(0.01, 1.0), (0.1, -1.0), (0.5, 1.0)] {
        for of in [slip, speed] {
            let error = |n: i32| sign * 1e-3 * libm::pow(ratio, f64::from(n));
            let margins = [0, 1, 2].map(|n| Some(0.1 + error(n)));
            let (bar, is_open) = bar_of(of, ratio, &margins, &[], false);
            let expected = 1e-3 * (1.0 - ratio) * (1.5 * (1.0 + ratio) + 10.0 * ratio);
            assert!((bar.error.unwrap() - expected).abs() < 1e-15, "{bar:?}");
            assert!(bar.error.unwrap() > 1e-3 && !is_open && bar.decided);
            // As if the first difference had vanished by chance.
            let [_, second, third] = margins;
            let (bar, is_open) = bar_of(of, ratio, &[second, second, third], &[], false);
            assert!(bar.error.unwrap() > 1e-3 * ratio && is_open);
            // A plant that cannot be perturbed leaves it open.
            assert!(!bar.decided && bar.error_by == Some(ErrorSource::Refinement));
        }
    }
}

#[test]
fn margin_of_less_than_three_errors_is_undecided() {
    let [slip, ..] = &expectations();
    // 1.5 × 0.02.
    let near = refined(slip, [0.08, 0.06, 0.06]);
    assert!((near.error.unwrap() - 0.03).abs() < 1e-12 && !near.decided);
    let far = refined(slip, [0.1, 0.08, 0.08]);
    assert!(far.decided && far.error_by == Some(ErrorSource::Refinement));
    // A violation is as decided as a margin; without error so is a margin of zero.
    assert!(refined(slip, [-0.1, -0.12, -0.12]).decided);
    assert!(!refined(slip, [-0.08, -0.06, -0.06]).decided);
    assert!(refined(slip, [0.0; 3]).decided);
    // Another verdict at a finer setting is no error alone.
    assert!(!refined(slip, [0.001, -1e-9, -1e-9]).decided);
}

#[test]
fn counts_have_no_error_but_verdicts() {
    let [_, _, count, energy, misses] = &expectations();
    for of in [count, misses] {
        let same = refined(of, [2.0, 1.0, 1.0]);
        assert_eq!(
            (same.error, same.error_by, same.decided),
            (None, None, true)
        );
        assert!(!refined(of, [0.0, -1.0, 0.0]).decided);
    }
    // The residual of a finer run is less: that says nothing about the one of this run.
    let residual = refined(energy, [1e-9, 1e-5, 1e-5]);
    assert_eq!((residual.error, residual.decided), (None, true));
    assert!(refined(energy, [-1e-6, 1e-5, 1e-5]).decided);
}

#[test]
fn unobserved_values_have_no_error() {
    let [slip, speed, ..] = &expectations();
    for of in [slip, speed] {
        let (never, is_open) = bar_of(of, 0.1, &[None; 3], &[], false);
        assert_eq!((never.error, never.decided, is_open), (None, true, false));
        let now_and_then = bar_of(of, 0.1, &[Some(0.5), None, None], &[], false).0;
        assert_eq!((now_and_then.error, now_and_then.decided), (None, false));
    }
}

/// The margin of a number in the middle of its limits is the same on both sides.
#[test]
fn number_of_a_run_is_compared_by_its_value() {
    let [slip, speed, ..] = &expectations();
    let middle = |measured: f64| RowExpectation {
        measured: Some(measured),
        margin: Some(0.5 - (measured - 0.5).abs()),
        ..ran(Some(0.0))
    };
    let rows = [0.51, 0.49, 0.49].map(|measured| Some(middle(measured)));
    let error = |of: &Expectation| {
        let runs = Runs {
            kind: of.value_kind(),
            beyond: false,
            finer: rows.to_vec(),
            perturbed: Vec::new(),
            ratio: 0.1,
        };
        runs.bar().error.unwrap()
    };
    assert!((error(speed) - 0.03).abs() < 1e-12);
    assert!(error(slip) < 1e-12);
}

#[test]
fn third_refinement_tells_chance_from_chaos() {
    let [slip, ..] = &expectations();
    let of = |margins: &[f64]| {
        let margins: Vec<Option<f64>> = margins.iter().copied().map(Some).collect();
        bar_of(slip, 0.1, &margins, &[Some(0.6), Some(0.4)], false).0
    };
    // The first difference is small by chance: the second is the error.
    let chance = of(&[0.5, 0.5001, 0.49, 0.491]);
    assert_eq!(chance.error_by, Some(ErrorSource::Refinement));
    assert!((chance.error.unwrap() - (1.5 * 0.009 + 10.0 * 0.001)).abs() < 1e-12);
    let chaos = of(&[0.5, 0.5001, 0.49, 0.5]);
    assert_eq!(chaos.error_by, Some(ErrorSource::Ensemble));
    // What converges has no need of it.
    let few = of(&[0.5, 0.501, 0.5011, 0.6]);
    assert!((few.error.unwrap() - (1.5 * 0.0011 + 10.0 * 0.0001)).abs() < 1e-12);
}

#[test]
fn unpredictable_value_has_the_deviation_of_other_runs() {
    let [slip, ..] = &expectations();
    let bar = |finer: [f64; 3], perturbed: &[Option<f64>], beyond: bool| {
        bar_of(slip, 0.1, &finer.map(Some), perturbed, beyond).0
    };
    let found = bar([0.1, 0.11, 0.1], &[Some(0.13), Some(0.06)], false);
    // 2 √((0.03² + 0.04²)/2)
    assert!((found.error.unwrap() - 2.0 * 0.025 * f64::sqrt(2.0)).abs() < 1e-12);
    assert_eq!(found.error_by, Some(ErrorSource::Ensemble));
    assert!(!found.decided);
    // A finer run is one of them.
    let found = bar([0.1, 0.15, 0.1], &[Some(0.13), Some(0.06)], false);
    assert!((found.error.unwrap() - 2.0 * 0.05).abs() < 1e-12);
    // Past the horizon values may seem to converge.
    let same = [Some(0.11), Some(0.11)];
    assert!(bar([0.1, 0.1, 0.1], &same, false).error < Some(1e-12));
    assert!((bar([0.1, 0.1, 0.1], &same, true).error.unwrap() - 0.02).abs() < 1e-12);
    // Another verdict decides.
    let found = bar([0.1, 0.1, 0.1], &[Some(0.1), Some(-1e-3)], true);
    assert!(!found.decided);
    let found = bar([0.1, 0.1, 0.1], &[Some(0.1), None], true);
    assert_eq!((found.error, found.decided), (None, false));
}

#[test]
fn horizon_of_the_scenario_is_compared_with_the_window() {
    let registry = Registry::standard();
    let claims = "[{ name = \"early\", body = { pitch = { max = \"1 rad\" } }, before = \"0.5 s\" }, \
                   { name = \"late\", body = { pitch = { max = \"1 rad\" } } }]";
    let beyond = ["\"0.6 s\"", "\"2 s\""].map(|horizon| {
        let settings = [setting("expect", claims), setting("horizon", horizon)];
        let scene = trot(&registry, "'1 s'", None);
        let assembly = scene.assembly(&registry, &settings).unwrap();
        let expectations = assembly.scenario().expectations.iter();
        let beyond = expectations.map(|of| is_beyond_horizon(&assembly, of));
        beyond.collect::<Vec<bool>>()
    });
    assert_eq!(beyond, [vec![false, true], vec![false, false]]);
}

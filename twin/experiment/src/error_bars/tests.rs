use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use super::*;
use crate::runs::scene::tests::trot;

/// A run of an expectation with this margin; none: not observed.
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

/// The first expectation of a trot whose key `claim` has this claim.
fn claims(claims: [&str; 4]) -> Vec<Expectation> {
    let text = claims.map(|claim| format!("{{ name = \"it {claim:.9}\", {claim} }}"));
    let setting = |key: &str, value: String| Setting {
        origin: "--set".to_owned(),
        key: key.to_owned(),
        value,
    };
    let registry = Registry::standard();
    let scene = trot(&registry, "'1 s'", None);
    let settings = [setting("expect", format!("[{}]", text.join(", ")))];
    let assembly = scene.assembly(&registry, &settings).unwrap();
    assembly.scenario().expectations.clone()
}

fn expectations() -> Vec<Expectation> {
    claims([
        "body = { speed = { min = \"0.1 m/s\" } }",
        "footstep = { count = { min = 1 } }",
        "energy = { residual = { max = 1e-5 } }",
        "timing = { of = \"control\", deadline_misses = { max = 0 } }",
    ])
}

fn estimate(margins: [Option<f64>; 3], ratio: f64, of: &Expectation) -> Estimate {
    let runs = margins.map(ran);
    let runs: Vec<Option<&RowExpectation>> = runs.iter().map(Some).collect();
    Estimate::of(&runs, ratio, of)
}

fn of_margins(margins: [f64; 3], of: &Expectation) -> Estimate {
    estimate(margins.map(Some), 0.1, of)
}

#[test]
fn bound_covers_the_limit_of_a_geometric_sequence() {
    let [speed, ..] = &expectations()[..] else {
        panic!()
    };
    for ratio in [0.01, 0.1, 0.5] {
        for sign in [1.0, -1.0] {
            let error = |n: i32| sign * 1e-3 * libm::pow(ratio, f64::from(n));
            let margins = [0, 1, 2].map(|n| Some(0.1 + error(n)));
            let found = estimate(margins, ratio, speed);
            let bound = found.bound.unwrap();
            assert!((bound / 1e-3 - SAFETY).abs() < 1e-9, "{bound}");
            assert!(found.converges && found.same_verdict);
            // As if the first difference had vanished by chance.
            let [_, second, third] = margins;
            let found = estimate([second, second, third], ratio, speed);
            assert!(found.bound.unwrap() > 1e-3 * ratio && !found.converges);
        }
    }
}

#[test]
fn margin_of_less_than_three_errors_is_undecided() {
    let all = expectations();
    let bar = |margins, of: &Expectation| of_margins(margins, of).bar(None, of);
    let speed = &all[0];
    // The bound is 3 × 0.009/0.9.
    let near = bar([0.08, 0.071, 0.071], speed);
    assert!(
        (near.error.unwrap() - 0.03).abs() < 1e-12 && !near.decided,
        "{near:?}"
    );
    let far = bar([0.1, 0.091, 0.091], speed);
    assert!(far.decided && far.error_by == Some(ErrorSource::Refinement));
    // A violation is as decided as a margin; without error so is a margin of zero.
    assert!(bar([-0.1, -0.109, -0.109], speed).decided);
    assert!(bar([0.0; 3], speed).decided);
    // Another verdict at a finer setting is no error alone.
    assert!(!bar([0.001, -1e-9, -1e-9], speed).decided);
}

#[test]
fn counts_have_no_error_but_verdicts() {
    let all = expectations();
    let [_, count, energy, misses] = &all[..] else {
        panic!()
    };
    let bar = |margins, of: &Expectation| of_margins(margins, of).bar(None, of);
    for of in [count, misses] {
        let same = bar([2.0, 1.0, 1.0], of);
        assert_eq!(
            (same.error, same.error_by, same.decided),
            (None, None, true)
        );
        assert!(!bar([0.0, -1.0, 0.0], of).decided);
    }
    // The residual of a finer run is less: that says nothing about the one of this run.
    let residual = bar([1e-9, 1e-5, 1e-5], energy);
    assert_eq!((residual.error, residual.decided), (None, true));
    assert!(bar([-1e-6, 1e-5, 1e-5], energy).decided);
}

#[test]
fn unobserved_values_have_no_error() {
    let speed = &expectations()[0];
    let never = estimate([None; 3], 0.1, speed).bar(None, speed);
    assert_eq!((never.error, never.decided), (None, true));
    let now_and_then = estimate([Some(0.5), None, None], 0.1, speed).bar(None, speed);
    assert_eq!((now_and_then.error, now_and_then.decided), (None, false));
}

#[test]
fn deviation_of_an_ensemble_counts_where_it_is_greater() {
    let speed = &expectations()[0];
    let estimate = of_margins([0.1, 0.0991, 0.0991], speed);
    let bar = |value, same_verdict| {
        let value = Some(value);
        estimate.bar(
            Some(Deviation {
                value,
                same_verdict,
            }),
            speed,
        )
    };
    let greater = bar(0.02, true);
    assert_eq!(greater.error, Some(0.02));
    assert_eq!(greater.error_by, Some(ErrorSource::Ensemble));
    assert!(greater.decided && !bar(0.04, true).decided && !bar(0.02, false).decided);
    let less = bar(1e-4, true);
    assert_eq!(less.error_by, Some(ErrorSource::Refinement));
}

/// Past the horizon that a scenario names, a value that seems to converge has the error of an
/// ensemble; up to it the ensemble is not run.
#[test]
fn horizon_of_the_scenario_makes_an_ensemble() {
    let registry = Registry::standard();
    let setting = |key: &str, value: &str| Setting {
        origin: "--set".to_owned(),
        key: key.to_owned(),
        value: value.to_owned(),
    };
    let claims = "[{ name = \"early\", body = { pitch = { max = \"1 rad\" } }, before = \"0.5 s\" }, \
                   { name = \"late\", body = { pitch = { max = \"1 rad\" } } }]";
    let mut bars = Vec::new();
    for horizon in ["\"0.6 s\"", "\"2 s\""] {
        let settings = [setting("expect", claims), setting("horizon", horizon)];
        let scene = trot(&registry, "'1 s'", None);
        let assembly = scene.assembly(&registry, &settings).unwrap();
        let expectations = &assembly.scenario().expectations;
        bars.push(
            expectations
                .iter()
                .map(|of| is_beyond_horizon(&assembly, of))
                .collect::<Vec<_>>(),
        );
    }
    assert_eq!(bars, [vec![false, true], vec![false, false]]);
}

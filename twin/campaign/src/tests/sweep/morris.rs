//! Elementary effects against closed forms.

use twinrig_campaign::sweep::{
    CompleteRow, ElementaryEffect, FAILED_EXPECTATIONS, ResultRow, RowVerdict, effects_csv,
};
use twinrig_document::AssumedValue;
use twinrig_kernel::Unit;

use super::results::result;
use super::{row, spec};

fn text(trajectories: usize, dimensions: &str) -> String {
    format!("design = 'morris'\ntrajectories = {trajectories}\ndimension = [{dimensions}]")
}

/// Effects of a function of the point as the measured value of the only expectation.
fn effects(text: &str, function: &dyn Fn(&[f64]) -> f64) -> Vec<ElementaryEffect> {
    let result = result(text, &|_, point, one| {
        let numbers = point.iter().map(|value| value.number.unwrap());
        one.expectations[0].measured = Some(function(&numbers.collect::<Vec<_>>()));
    });
    let effects = result.elementary_effects().into_iter();
    effects
        .filter(|one| one.measure != FAILED_EXPECTATIONS)
        .collect()
}

fn of<'e>(effects: &'e [ElementaryEffect], dimension: &str) -> &'e ElementaryEffect {
    effects
        .iter()
        .find(|one| one.dimension == dimension)
        .unwrap()
}

/// Slope times length of the interval, without scatter.
#[test]
fn effects_of_a_linear_function_are_its_slopes() {
    let dimensions = "{ key = 'a', also = ['a2'], from = '1 m', to = '3 m' }, \
                      { key = 'b', from = 0, to = 10 }, { key = 'c', from = -1, to = 1 }";
    for levels in [2, 4, 6] {
        let text = format!("levels = {levels}\n{}", text(5, dimensions));
        let found = effects(&text, &|x| 7.0 + 2.0 * x[0] + x[1] - 2.0 * x[2]);
        let order: Vec<&str> = found.iter().map(|one| one.dimension.as_str()).collect();
        assert_eq!(order, ["b", "a", "c"]);
        for (key, slope) in [("a", 6.0), ("b", -20.0), ("c", 0.0)] {
            let one = of(&found, key);
            assert!((one.mu - slope).abs() < 1e-9, "{one:?}");
            assert!((one.mu_star - slope.abs()).abs() < 1e-9, "{one:?}");
            assert!(one.sigma.unwrap() < 1e-9, "{one:?}");
            assert_eq!((one.effects, one.unit.as_str()), (5, "m/s²"));
        }
    }
}

/// Of a b, the effect of a is the value of b, one of 0, 1/3, 2/3, 1 with equal probability. Of
/// (c − 1/2)², the effect is −1/3 from 0 to 2/3 and 1/3 from 1/3 to 1.
#[test]
fn interactions_and_curvature_scatter() {
    let unit = |key: &str| format!("{{ key = '{key}', from = 0, to = 1 }}, ");
    let text = text(4000, &["a", "b", "c"].map(unit).concat());
    let found = effects(&text, &|x| x[0] * x[1] + (x[2] - 0.5) * (x[2] - 0.5));
    let variance: f64 = 14.0 / 36.0 - 0.25;
    for key in ["a", "b"] {
        let one = of(&found, key);
        assert!((one.mu - 0.5).abs() < 0.02, "{one:?}");
        assert!((one.mu - one.mu_star).abs() < 1e-12, "{one:?}");
        assert!(
            (one.sigma.unwrap() - variance.sqrt()).abs() < 0.01,
            "{one:?}"
        );
    }
    let one = of(&found, "c");
    assert!(one.mu.abs() < 0.02, "{one:?}");
    assert!((one.mu_star - 1.0 / 3.0).abs() < 1e-12, "{one:?}");
    assert!((one.sigma.unwrap() - 1.0 / 3.0).abs() < 1e-3, "{one:?}");
}

/// A run without the value takes the effects of both neighbours with it, and no others.
#[test]
fn missing_values_have_no_effects() {
    let text = text(
        3,
        "{ key = 'a', from = 0, to = 1 }, { key = 'b', from = 0, to = 1 }",
    );
    let result = result(&text, &|index, _, one| {
        one.verdict = RowVerdict::Fail;
        one.expectations[0].holds = index >= 3;
        one.expectations[0].measured = (index != 4).then_some(1.0);
    });
    let found = result.elementary_effects();
    let count = |measure: &str| -> Vec<usize> {
        let of = found.iter().filter(|one| one.measure == measure);
        of.map(|one| one.effects).collect()
    };
    assert_eq!(count("µ, stays").iter().sum::<usize>(), 4);
    // From the first trajectory to the second there is no step.
    assert_eq!(count(FAILED_EXPECTATIONS), [3, 3]);
    assert!(found.iter().all(|one| one.mu_star == 0.0));
    assert_eq!(effects_csv(&found).lines().count(), found.len() + 1);
    let mut read = |_: &ResultRow| {
        let (command, row) = (String::new(), row(0));
        Ok::<_, ()>(CompleteRow { command, row })
    };
    let json = serde_json::to_value(result.json(&mut read)).unwrap();
    assert_eq!(json["effects"].as_array().unwrap().len(), found.len());
}

#[test]
fn points_are_a_function_of_the_seed() {
    let points = |seed: u64| {
        let text = text(
            6,
            "{ key = 'a', from = 0, to = 1 }, { key = 'b', from = 0, to = 1 }",
        );
        spec(&format!("seed = {seed}\n{text}")).unwrap().points()
    };
    assert_eq!(points(3), points(3));
    assert_ne!(points(3), points(4));
    assert_eq!(points(3).len(), 18);
}

fn assumed(key: &str, to: f64) -> AssumedValue {
    AssumedValue {
        key: key.to_owned(),
        value: 0.5,
        from: 0.25,
        to,
        unit: Unit::Meter,
    }
}

#[test]
fn assumed_values_are_dimensions_by_their_intervals() {
    let known = [
        assumed("leg.l1", 1.0),
        assumed("leg.l2", 2.0),
        assumed("legs", 1.0),
    ];
    let design = "design = 'morris'\ntrajectories = 2\nlevels = 2\n";
    let mut read = spec(&format!(
        "{design}assumed = ['leg']\n[[dimension]]\nkey = 'override.leg.l1'\nfrom = 0\nto = 1"
    ))
    .unwrap();
    read.add_assumed(&known).unwrap();
    let keys: Vec<&str> = read.keys().map(|key| key.value.as_str()).collect();
    assert_eq!(keys, ["override.leg.l1", "override.leg.l2"]);
    assert_eq!((read.design.points, read.points().len()), (6, 6));
    let points = read.points();
    let ends = points.iter().filter(|point| point[1].toml == "\"2 m\"");
    assert!((1..6).contains(&ends.count()), "{points:?}");
    let mut wrong = spec(&format!("{design}assumed = ['leg.l3']")).unwrap();
    let error = wrong.add_assumed(&known).unwrap_err().to_string();
    assert!(
        error.contains("no assumed value `leg.l3`") && error.contains("leg.l1"),
        "{error}"
    );
}

#[test]
fn keys_of_other_designs_are_refused() {
    let dimension = "[[dimension]]\nkey = 'a'\nfrom = 0\nto = 1\n";
    for (head, message) in [
        ("levels = 4", "a grid has no `levels`"),
        ("assumed = ['leg']", "a grid has no `assumed`"),
        ("design = 'morris'", "`trajectories` is missing"),
        (
            "design = 'morris'\npoints = 3",
            "the design `morris` has no `points`",
        ),
        (
            "design = 'morris'\ntrajectories = 3\nlevels = 5",
            "`levels` is 5, which is odd",
        ),
        (
            "design = 'morris'\ntrajectories = 3\nlevels = 3",
            "`levels` is 3, which is odd",
        ),
        (
            "design = 'random'\npoints = 3\nmeasures = []",
            "the design `random` has no `measures`",
        ),
    ] {
        let error = spec(&format!("{head}\n{dimension}")).unwrap_err();
        assert!(error.contains(message), "{head}: {error}");
    }
    let listed = "design = 'morris'\ntrajectories = 2\n[[dimension]]\nkey = 'a'\nvalues = [1, 2]";
    let error = spec(listed).unwrap_err();
    assert!(
        error.contains("the values of `a` are no interval"),
        "{error}"
    );
}

use twinrig_campaign::sweep::{
    Partition, ResultDimension, ResultRow, RowVerdict, SweepCounts, SweepResult, SweepVerdict,
};
use twinrig_kernel::Unit;

use crate::{key, row, spec};

/// Result of all points of a specification, which `change` has changed.
pub fn result(text: &str, change: &dyn Fn(usize, &mut ResultRow)) -> SweepResult {
    let spec = spec(text).unwrap();
    let points = spec.points().into_iter().enumerate();
    let rows = points.map(|(index, point)| {
        let mut one = ResultRow {
            index,
            name: format!("run {index}"),
            point,
            key: key(index),
            command: String::new(),
            row: row(index),
        };
        one.row.error = None;
        change(index, &mut one);
        one
    });
    let dimensions = spec.keys().map(|key| ResultDimension {
        key: key.value.clone(),
        unit: Some(Unit::One),
    });
    SweepResult {
        name: String::new(),
        spec: String::new(),
        scenario: String::new(),
        file: String::new(),
        build: String::new(),
        settings: Vec::new(),
        design: spec.design,
        trajectory_points: spec.trajectory_points(),
        measures: Vec::new(),
        partition: Partition::WHOLE,
        dimensions: dimensions.collect(),
        verdict: SweepVerdict::Partial,
        counts: SweepCounts::default(),
        shares: Vec::new(),
        hash: None,
        share_warning: None,
        rows: rows.collect(),
    }
    .judged(&spec, false)
}

const GRID: &str = "[[dimension]]\nkey = 'a'\nvalues = [1, 2]\n\
                    [[dimension]]\nkey = 'b'\nvalues = [1, 2]\n";

/// Draws may coincide: equal points are no evidence about a dimension.
#[test]
fn dimension_without_effect_is_noted_only_if_its_value_differs() {
    let draws = "design = 'random'\npoints = 40\n[[dimension]]\nkey = 'a'\nvalues = [1, 2]\n";
    let print = |print: &dyn Fn(&str) -> String, value: &str| -> Vec<String> {
        let result = result(&format!("{draws}{value}"), &|_, one| {
            one.row.fingerprint = Some(print(&one.point[0].toml));
        });
        let keys = result.without_effect();
        keys.into_iter().map(str::to_owned).collect()
    };
    let constant = "[[dimension]]\nkey = 'b'\nvalues = [7]\n";
    assert_eq!(print(&str::to_owned, constant), [""; 0]);
    assert_eq!(print(&|_| String::new(), constant), ["a"]);
    let idle = "[[dimension]]\nkey = 'b'\nvalues = [7, 8]\n";
    assert_eq!(print(&str::to_owned, idle), ["b"]);
}

#[test]
fn hash_depends_on_runs_and_not_on_texts_of_errors() {
    let hash = |error: Option<&'static str>, print: &'static str| {
        let result = result(GRID, &|index, one| {
            if index == 2 {
                one.row.verdict = RowVerdict::Error;
                one.row.error = error.map(str::to_owned);
                one.row.fingerprint = Some(print.to_owned());
            }
        });
        result.hash.unwrap()
    };
    let first = hash(Some("cannot read /home/a/robot.toml"), "");
    assert_eq!(first, hash(Some("cannot read robot.toml"), ""));
    assert_ne!(first, hash(None, ""));
    assert_ne!(first, hash(Some(""), "print"));
}

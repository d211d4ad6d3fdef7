use std::sync::Arc;

use twinrig_campaign::sweep::{
    CompleteRow, Partition, ResultDimension, ResultRow, RowPlace, RowSummaries, RowVerdict,
    SweepCounts, SweepResult, SweepRow, SweepValue, SweepVerdict,
};
use twinrig_kernel::Unit;

use super::{key, row, spec};

/// Result of all points of a specification, which `change` has changed.
pub fn result(text: &str, change: &dyn Fn(usize, &[SweepValue], &mut SweepRow)) -> SweepResult {
    let spec = spec(text).unwrap();
    let points = spec.points().into_iter().enumerate();
    let mut summaries = RowSummaries::default();
    let rows = points.map(|(index, point)| {
        let mut one = row(index);
        one.error = None;
        change(index, &point, &mut one);
        ResultRow {
            index,
            point,
            key: key(index),
            place: RowPlace::default(),
            summary: Arc::new(summaries.summary(one)),
        }
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
        failures: Vec::new(),
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
        let result = result(&format!("{draws}{value}"), &|_, point, one| {
            one.fingerprint = Some(print(&point[0].toml));
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
        let result = result(GRID, &|index, _, one| {
            if index == 2 {
                one.verdict = RowVerdict::Error;
                one.error = error.map(str::to_owned);
                one.fingerprint = Some(print.to_owned());
            }
        });
        result.hash.unwrap()
    };
    let first = hash(Some("cannot read /home/a/robot.toml"), "");
    assert_eq!(first, hash(Some("cannot read robot.toml"), ""));
    assert_ne!(first, hash(None, ""));
    assert_ne!(first, hash(Some(""), "print"));
}

#[test]
fn json_and_table_have_the_rows_that_are_read() {
    let result = result(GRID, &|_, _, one| one.fingerprint = None);
    let mut read = |of: &ResultRow| {
        let command = format!("run {}", of.index);
        let row = row(of.index);
        Ok::<_, ()>(CompleteRow { command, row })
    };
    let json = serde_json::to_value(result.json(&mut read)).unwrap();
    let rows = json["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 4);
    let of_second = serde_json::json!({
        "index": 1,
        "point": { "a": 1, "b": 2 },
        "verdict": "fail",
        "seed": u64::MAX,
        "simulated_s": 1e-300,
        "fell_at_s": null,
        "fingerprint": format!("{:064x}", 1),
        "error": "a \"quoted\" word\nand a line",
        "expectations": row(1).expectations,
        "key": key(1),
        "command": "run 1",
    });
    // With the order of the keys.
    assert_eq!(rows[1].to_string(), of_second.to_string());
    let last: Vec<&String> = json.as_object().unwrap().keys().collect();
    assert_eq!(last[last.len() - 2..], ["error", "rows"]);
    let table = result.table();
    assert!(table.header().starts_with("index,a,b,run seed,verdict,"));
    let line = table.line(&result.rows[1], &row(1));
    assert!(
        line.starts_with("1,1,2,18446744073709551615,fail,,unobserved,0.1,"),
        "{line}"
    );
}

#[test]
fn row_that_cannot_be_read_ends_the_json() {
    let result = result(GRID, &|_, _, _| {});
    let mut read = |of: &ResultRow| Err::<CompleteRow, usize>(of.index);
    let json = result.json(&mut read);
    assert!(serde_json::to_string(&json).is_err());
    assert_eq!(json.failed(), Some(0));
}

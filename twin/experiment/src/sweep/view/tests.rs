//! Pages of synthetic sweeps.

use std::sync::Arc;

use twinrig_campaign::sweep::{
    CompleteRow, Design, DesignKind, ExpectationVerdict, Partition, ResultDimension, ResultRow,
    RowExpectation, RowKey, RowPlace, RowSummaries, RowVerdict, ShareInterval, SweepCounts,
    SweepRow, SweepValue,
};
use twinrig_kernel::Unit;

use super::plots::DRAWN;
use super::*;
use crate::page_parts::{assert_cards, rows, tables};
use crate::sweep::rows::FAILURES_MOST;

fn row(index: usize, margin: Option<f64>, unit: &str) -> (usize, SweepRow) {
    let verdict = match margin {
        Some(margin) if margin >= 0.0 => ExpectationVerdict::Pass,
        Some(_) => ExpectationVerdict::Fail,
        None => ExpectationVerdict::Unobserved,
    };
    let mut row = SweepRow::of_error("");
    row.error = None;
    row.verdict = if verdict == ExpectationVerdict::Pass {
        RowVerdict::Pass
    } else {
        RowVerdict::Fail
    };
    row.expectations = vec![RowExpectation {
        name: "stays <up>".to_owned(),
        verdict,
        holds: verdict == ExpectationVerdict::Pass,
        measured: margin,
        bound: Some(0.0),
        margin,
        unit: unit.to_owned(),
        detail: String::new(),
    }];
    (index, row)
}

fn result(of_points: Vec<(usize, SweepRow)>) -> SweepResult {
    let mut summaries = RowSummaries::default();
    let rows = of_points.iter().map(|(index, row)| ResultRow {
        index: *index,
        point: vec![SweepValue::whole(*index as u64)],
        key: RowKey::of([]),
        place: RowPlace::default(),
        summary: Arc::new(summaries.summary(row.clone())),
    });
    let rows: Vec<ResultRow> = rows.collect();
    let failed = of_points.into_iter();
    let failed = failed.filter(|(_, row)| row.verdict != RowVerdict::Pass);
    let failures = failed.map(|(index, row)| FailedRun {
        name: format!("trot@seed-{index}"),
        run: CompleteRow {
            command: format!("twin run --set 'name=\"<{index}>\"'"),
            row,
        },
    });
    SweepResult {
        failures: failures.take(FAILURES_MOST).collect(),
        name: "a & b".to_owned(),
        spec: "spec.toml".to_owned(),
        scenario: "trot".to_owned(),
        file: "trot.toml".to_owned(),
        build: String::new(),
        settings: Vec::new(),
        design: Design {
            kind: DesignKind::Grid,
            points: rows.len(),
            seed: 1,
            levels: None,
        },
        trajectory_points: None,
        measures: Vec::new(),
        partition: Partition::WHOLE,
        dimensions: vec![ResultDimension {
            key: "seed".to_owned(),
            unit: Some(Unit::One),
        }],
        verdict: SweepVerdict::Fail,
        counts: SweepCounts::default(),
        shares: vec![Share {
            of: "stays <up>".to_owned(),
            held: 1,
            runs: 2,
            share: Some(0.5),
            interval: ShareInterval::wilson(1, 2, 0.95),
            confidence: 0.95,
            min: Some(0.9),
            max: None,
            verdict: ShareVerdict::Undecided,
        }],
        hash: None,
        share_warning: None,
        rows,
    }
}

/// Returns the SVG of a plot.
fn plot<'p>(page: &'p str, title: &str) -> &'p str {
    let (_, plot) = page.split_once(&format!("aria-label=\"{title}\"")).unwrap();
    plot.split_once("</svg>").unwrap().0
}

fn circles(page: &str, title: &str) -> usize {
    plot(page, title).matches("<circle").count()
}

#[test]
fn every_run_with_a_margin_is_drawn_and_every_failure_listed() {
    let margins = [Some(0.1), Some(-0.2), None, Some(0.3)];
    let rows = margins.into_iter().enumerate();
    let page = sweep_page(&result(rows.map(|(n, it)| row(n, it, "m")).collect())).html();
    assert_eq!(circles(&page, "margin of stays &lt;up&gt; over seed"), 3);
    assert_eq!(page.matches("<b>trot@seed-").count(), 2);
    assert!(page.contains("name=&quot;&lt;1&gt;&quot;"));
    assert!(!page.contains("<up>") && page.contains("a &amp; b"));
}

/// The margins of one expectation in two units have two plots.
#[test]
fn units_are_not_mixed() {
    let page = sweep_page(&result(vec![
        row(0, Some(0.1), "m"),
        row(1, Some(0.2), "m"),
        row(2, Some(-2.0), "rad"),
        row(3, Some(-1.0), "rad"),
    ]))
    .html();
    assert!(page.contains("margin  [mm]") && page.contains("margin  [rad]"));
}

#[test]
fn page_of_many_runs_is_bounded() {
    let rows = |count| (0..count).map(|n| row(n, Some(n as f64), "m")).collect();
    let page = sweep_page(&result(rows(10 * DRAWN))).html();
    assert_eq!(
        circles(&page, "margin of stays &lt;up&gt; over seed"),
        DRAWN
    );
    assert!(page.contains("9000 runs are not drawn"));
}

/// A range without runs has no share, and its neighbours are as wide as all bars.
#[test]
fn histogram_has_no_bar_without_runs() {
    let widths = |indices: &[usize]| -> Vec<f64> {
        let rows = indices.iter().map(|&index| row(index, Some(0.1), "m"));
        let page = sweep_page(&result(rows.collect())).html();
        let plot = plot(&page, "share of runs that pass over seed");
        let bars = plot.split("<rect fill-opacity").skip(1);
        let width = bars.map(|bar| bar.split_once("width=\"").unwrap().1);
        let width = width.map(|width| width.split_once('"').unwrap().0.parse().unwrap());
        width.collect()
    };
    // Three ranges, the second of which is empty.
    let all = widths(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
    let some = widths(&[0, 1, 2, 3, 3, 3, 2, 1, 9, 10, 11, 12]);
    assert_eq!((all.len(), some.len()), (3, 2));
    assert!((all[0] - some[0]).abs() < 0.2, "{all:?} {some:?}");
    // One value has one bar, with a width.
    assert!(matches!(widths(&[5, 5, 5, 5, 5, 5, 5, 5])[..], [width] if width > 10.0));
}

#[test]
fn shares_have_their_values_below_their_heads() {
    let mut result = result(vec![row(0, Some(-0.2), "m")]);
    result.counts = SweepCounts {
        points: 9,
        pass: 5,
        fail: 3,
        error: 1,
        missing: 0,
    };
    result.shares[0] = Share {
        of: "upright".to_owned(),
        held: 3,
        runs: 7,
        share: Some(0.43),
        interval: ShareInterval {
            low: 0.16,
            high: 0.75,
        },
        confidence: 0.95,
        min: Some(0.4),
        max: Some(0.8),
        verdict: ShareVerdict::Pass,
    };
    let page = sweep_page(&result);
    let [shares, failures] = &tables(&page.blocks)[..] else {
        panic!("{page:?}");
    };
    assert_eq!(
        shares[..],
        [
            "share | verdict | held | share | interval | confidence | least | greatest",
            "upright | pass | 3 of 7 | 43.0 % | 16.0 … 75.0 % | 95.0 % | 40.0 % | 80.0 %",
        ]
    );
    let command = &result.failures[0].run.command;
    let failure = format!("trot@seed-0 | **fail** | `{command}` | stays <up>");
    assert_eq!(failures[1], failure);
    assert_eq!(
        page.headline,
        "Fail: 1 of 1 shares hold; 5 of 9 runs pass, 1 have an error."
    );
    assert_cards(
        &cards(&result),
        [
            ["verdict", "fail", "of the sweep"],
            ["points", "9", "grid design"],
            ["pass", "5", "all expectations hold"],
            ["fail", "3", "an expectation fails"],
            ["error", "1", "the run did not complete"],
        ],
    );
}

#[test]
fn effects_have_their_values_below_their_heads() {
    let effect = ElementaryEffect {
        measure: "speed".to_owned(),
        unit: "m/s".to_owned(),
        dimension: "mass".to_owned(),
        mu: 1e-3,
        mu_star: 2e-3,
        sigma: Some(3e-3),
        effects: 4,
    };
    assert_eq!(
        rows(&effect_table(&[effect], 1)),
        [
            "effect on | of | μ\\* | μ | σ | number",
            "speed | `mass` | 2 mm/s | 1 mm/s | 3 mm/s | 4",
        ]
    );
}

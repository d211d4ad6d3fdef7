//! Pages of synthetic optimisations.

use twinrig_campaign::optimization::{
    BestPoint, CaseEvaluation, Direction, Evaluation, EvaluationCounts, OptimizationVerdict,
    SearchMethod,
};
use twinrig_campaign::sweep::{ExpectationVerdict, RowExpectation, RowKey, SweepRow, SweepValue};
use twinrig_kernel::Unit;

use super::*;
use crate::page_parts::{assert_cards, tables};

fn empty(logarithmic: bool) -> OptimizationResult {
    OptimizationResult {
        name: "a & b".to_owned(),
        verdict: OptimizationVerdict::Interrupted,
        space: "space.toml".to_owned(),
        scenario: "walk".to_owned(),
        file: "walk.toml".to_owned(),
        build: String::new(),
        settings: Vec::new(),
        method: SearchMethod::Pso,
        particles: 10,
        iterations: 1,
        restarts: 0,
        seed: 1,
        objective: "<speed>".to_owned(),
        unit: "m/s".to_owned(),
        direction: Direction::Maximize,
        constraints: vec!["stays up".to_owned()],
        dimensions: vec![OptimizedDimension {
            key: "length".to_owned(),
            unit: Unit::Meter,
            from: 1.0,
            to: 100.0,
            logarithmic,
        }],
        cases: Vec::new(),
        counts: EvaluationCounts::default(),
        duration_s: Some(10.0),
        saved: None,
        best: None,
        error: None,
        unobserved: None,
        history: Vec::new(),
        hash: String::new(),
        points: Vec::new(),
    }
}

/// A run at `number`, which is also its objective; none at odd numbers.
fn point(generation: usize, number: u32) -> EvaluatedPoint {
    let objective = number.is_multiple_of(2).then_some(f64::from(number));
    EvaluatedPoint {
        generation,
        numbers: vec![f64::from(number)],
        case: 0,
        key: RowKey::of([]),
        evaluation: Evaluation {
            cost: objective.map_or(4.5, |value| -value / (1.0 + value)),
            class: objective.map_or(RunClass::Unobserved, |_| RunClass::Feasible),
            objective,
            violations: 0,
            fell_at_s: objective.map_or(Some(1.0), |_| None),
            simulated_s: objective.map_or(1.0, |_| 10.0),
        },
    }
}

fn plot<'p>(page: &'p str, title: &str) -> &'p str {
    let (_, plot) = page.split_once(&format!("aria-label=\"{title}\"")).unwrap();
    plot.split_once("</svg>").unwrap().0
}

#[test]
fn page_shows_generations_and_points() {
    for logarithmic in [false, true] {
        let mut result = empty(logarithmic);
        for generation in 0..3 {
            let points = (1..=10)
                .map(|number| point(generation, 10 * u32::try_from(generation).unwrap() + number));
            let best = result.add_generation(points.collect());
            assert_eq!(best, Some(9));
            let value = SweepValue::quantity(30.0, Unit::Meter);
            result.set_best(vec![value], 9, "twin run 'it'".to_owned(), Vec::new());
        }
        let result = result.judged(false);
        // Half of the runs end after a tenth of their time.
        assert_eq!(result.saved, Some(0.45));
        assert_eq!(result.verdict, OptimizationVerdict::Found);
        let page = optimization_page(&result).html();
        let dots = plot(&page, "objective over length")
            .matches("<circle")
            .count();
        assert_eq!(dots, 15);
        let lines = plot(&page, "objective over the evaluations")
            .matches("<polyline")
            .count();
        assert_eq!(lines, 2);
        assert!(page.contains("&lt;speed&gt;") && !page.contains("<speed>"));
        assert!(page.contains("30 m/s") && page.contains("twin run"));
    }
}

/// Nothing has been evaluated, or only a single point.
#[test]
fn page_of_few_points_is_complete() {
    let page = optimization_page(&empty(false).judged(true)).html();
    assert!(page.contains("There is none.") && page.contains("interrupted"));
    let mut one = empty(true);
    one.add_generation(vec![point(0, 7)]);
    let page = optimization_page(&one.judged(false)).html();
    assert!(page.ends_with("</html>\n") && !page.contains("NaN") && !page.contains("inf "));
}

#[test]
fn best_point_has_its_values_below_their_heads() {
    let mut result = empty(false);
    result.counts = EvaluationCounts {
        evaluations: 20,
        feasible: 11,
        infeasible: 4,
        unobserved: 3,
        error: 2,
        fell: 5,
    };
    result.saved = Some(0.25);
    let mut evaluation = point(0, 2).evaluation;
    (evaluation.objective, evaluation.cost) = (Some(0.31), 0.32);
    let mut row = SweepRow::of_error("");
    row.expectations = vec![RowExpectation {
        name: "stays up".to_owned(),
        verdict: ExpectationVerdict::Fail,
        holds: false,
        measured: Some(0.41),
        bound: Some(0.42),
        margin: Some(0.43),
        unit: "m".to_owned(),
        detail: String::new(),
    }];
    result.best = Some(BestPoint {
        point: vec![SweepValue::quantity(30.0, Unit::Meter)],
        number: 6,
        generation: 1,
        evaluation,
        cases: vec![CaseEvaluation {
            name: "uphill".to_owned(),
            evaluation,
            key: RowKey::of([]),
            command: "twin run uphill".to_owned(),
        }],
        at_bounds: vec![("length".to_owned(), "its end".to_owned())],
        key: RowKey::of([]),
        command: "twin run".to_owned(),
        row: Some(row),
    });
    let page = optimization_page(&result);
    assert_eq!(
        tables(&page.blocks),
        [
            [
                "dimension | best | from | to | ",
                "length | 30 m | 1 m | 100 m | at its bound",
            ],
            [
                "case | objective |  | command",
                "uphill | 0.31 m/s | feasible | `twin run uphill`",
            ],
            [
                "expectation | verdict | measured | bound | unit",
                "stays up | **fail** | 0.41 | 0.42 | m",
            ],
        ]
    );
    assert_cards(
        &cards(&result),
        [
            ["verdict", "interrupted", "pso"],
            ["best", "0.31 m/s", "<speed>"],
            ["evaluations", "20", "in 0 generations"],
            ["feasible", "11", "all constraints hold"],
            ["falls", "5", "25.0 % of the simulated time saved"],
            ["error", "2", "the run did not complete"],
        ],
    );
}

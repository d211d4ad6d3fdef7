//! Page of an optimisation: convergence, the best point, and the values of each dimension. It
//! contains neither times nor the machine, so that equal optimisations have equal pages.

mod best;
#[cfg(test)]
mod tests;

use twinrig_campaign::optimization::{
    EvaluatedPoint, Generation, OptimizationResult, OptimizedDimension, RunClass,
};
use twinrig_report::html::element::in_unit;
use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::number::{percent, precise};
use twinrig_report::page::{Block, Card, Figure, Page, Swatch, Term};

pub use best::{best_cases, best_point, evaluation_class};

/// Greatest number of points of one kind in a plot.
const DRAWN: usize = 1000;
/// Bars of a histogram.
const BARS: usize = 20;
/// One point of so many is among the best.
const BEST_OF: usize = 10;

/// Colours.
const BEST: usize = 0;
const OTHER: usize = 1;
const MEDIAN: usize = 2;
const MARK: usize = 7;

/// Returns the page of an optimisation.
pub fn optimization_page(result: &OptimizationResult) -> Page {
    let mut blocks = vec![Block::Cards(cards(result))];
    blocks.extend(result.warning().map(Block::Text));
    blocks.push(Block::heading("Convergence"));
    blocks.push(Block::Figures(convergence(result).into()));
    blocks.push(Block::heading("Best point"));
    if let Some(best) = &result.best {
        blocks.push(Block::Table(best_point(result, best)));
        if !best.cases.is_empty() {
            blocks.push(Block::Table(best_cases(result, best)));
            let text = "The worst case counts; its expectations are:";
            blocks.push(Block::text(text));
        }
        blocks.push(Block::Table(best::expectations(best)));
    } else {
        blocks.push(Block::text("There is none."));
    }
    blocks.push(Block::heading("Dimensions"));
    blocks.push(Block::Text(format!(
        "Left the objective of the runs that have one, the dashed line at the best point. Right \
         the share of the points of all generations, and of the best of {BEST_OF} of them, in each \
         part of the range: a search that has converged has its best points in one place."
    )));
    let order = by_cost(result);
    let dimensions = result.dimensions.iter().enumerate();
    blocks.extend(dimensions.map(|(index, dimension)| {
        Block::Figures(vec![
            objective_over(result, index, dimension),
            distribution(result, &order, index, dimension),
        ])
    }));
    Page {
        kind: "Optimisation".to_owned(),
        title: format!("{}: {}", result.name, result.scenario),
        headline: headline(result),
        blocks,
        terms: terms(result),
    }
}

fn objective_text(result: &OptimizationResult) -> String {
    let best = result.best.as_ref();
    let value = best.and_then(|best| best.evaluation.objective);
    value.map_or("none".to_owned(), |value| precise(value, &result.unit))
}

fn headline(result: &OptimizationResult) -> String {
    let constraints = match result.constraints.len() {
        0 => String::new(),
        1 => ", with 1 constraint".to_owned(),
        count => format!(", with {count} constraints"),
    };
    format!(
        "{} {}: {}{constraints}; {} evaluations.",
        result.direction.word(),
        result.objective,
        objective_text(result),
        result.counts.evaluations
    )
}

fn cards(result: &OptimizationResult) -> Vec<Card> {
    let counts = &result.counts;
    let generations = format!("in {} generations", result.history.len());
    let saved = result.saved.map_or(String::new(), |saved| {
        format!("{} of the simulated time saved", percent(saved))
    });
    let verdict = result.verdict.word().to_owned();
    let mut cards = vec![
        Card::new("verdict", verdict, result.method.word()),
        Card::new("best", objective_text(result), result.objective.as_str()),
        Card::new("evaluations", counts.evaluations.to_string(), generations),
        Card::new(
            "feasible",
            counts.feasible.to_string(),
            "all constraints hold",
        ),
        Card::new("falls", counts.fell.to_string(), &saved),
    ];
    if counts.error > 0 {
        let more = "the run did not complete";
        cards.push(Card::new("error", counts.error.to_string(), more));
    }
    cards
}

/// Returns the plots of the objective and of the share of feasible points over the evaluations.
fn convergence(result: &OptimizationResult) -> [Figure; 2] {
    let history = result.history.iter();
    let line = |value: &dyn Fn(usize) -> Option<f64>| -> Vec<[f64; 2]> {
        let points = history.clone().enumerate();
        let point =
            |(index, it): (usize, &Generation)| Some([it.evaluations as f64, value(index)?]);
        points.filter_map(point).collect()
    };
    let plot = |title: &str, y: AxisLabel, series| LinePlot {
        title: title.to_owned(),
        width: 540.0,
        height: 300.0,
        x: AxisLabel::number("evaluations"),
        y,
        series,
    };
    let objective = plot(
        "objective over the evaluations",
        AxisLabel::in_unit(&result.objective, &result.unit),
        vec![
            Series {
                number: MEDIAN,
                shape: Shape::Line(line(&|index| result.history[index].median)),
            },
            Series {
                number: BEST,
                shape: Shape::Line(line(&|index| result.history[index].best)),
            },
        ],
    );
    let feasible = plot(
        "share of feasible points over the evaluations",
        AxisLabel::number("feasible"),
        vec![
            // Both ends of the scale of shares.
            Series {
                number: MARK,
                shape: Shape::Line(vec![[0.0, 0.0], [0.0, 1.0]]),
            },
            Series {
                number: BEST,
                shape: Shape::Line(line(&|index| Some(result.history[index].feasible))),
            },
        ],
    );
    let caption = "The best point is the one of least cost: feasible points come first, whatever \
                   their objective.";
    [
        Figure {
            heading: String::new(),
            legend: vec![
                (Swatch::Curve(BEST), "best point so far".to_owned()),
                (Swatch::Curve(MEDIAN), "median of a generation".to_owned()),
            ],
            drawing: objective.drawing(),
            caption: caption.to_owned(),
        },
        Figure {
            drawing: feasible.drawing(),
            ..Figure::default()
        },
    ]
}

/// Returns the indices of the points, the best first.
fn by_cost(result: &OptimizationResult) -> Vec<usize> {
    let mut order: Vec<usize> = (0..result.points.len()).collect();
    let cost = |index: &usize| result.points[*index].evaluation.cost;
    order.sort_by(|one, other| cost(one).total_cmp(&cost(other)));
    order
}

/// Returns the place of a value on an axis.
fn place(dimension: &OptimizedDimension, value: f64) -> f64 {
    if dimension.logarithmic {
        libm::log10(value)
    } else {
        value
    }
}

fn label(dimension: &OptimizedDimension) -> AxisLabel {
    let (key, unit) = (&dimension.key, dimension.unit.symbol());
    if dimension.logarithmic {
        AxisLabel::number(format!("decimal logarithm of {key}{}", in_unit(unit)))
    } else {
        AxisLabel::in_unit(key, unit)
    }
}

/// Returns the plot of the objective over a dimension.
fn objective_over(
    result: &OptimizationResult,
    index: usize,
    dimension: &OptimizedDimension,
) -> Figure {
    let dots = |is_feasible: bool| {
        let of = |point: &EvaluatedPoint| {
            let feasible = point.evaluation.class == RunClass::Feasible;
            let value = point
                .evaluation
                .objective
                .filter(|_| feasible == is_feasible)?;
            Some([place(dimension, point.numbers[index]), value])
        };
        let all: Vec<[f64; 2]> = result.points.iter().filter_map(of).collect();
        // Evenly over the points.
        let every = all.len().div_ceil(DRAWN).max(1);
        all.into_iter().step_by(every).collect::<Vec<_>>()
    };
    let (feasible, other) = (dots(true), dots(false));
    let values = feasible.iter().chain(&other).map(|point| point[1]);
    let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(value), high.max(value)]
    });
    let best = result
        .best
        .as_ref()
        .and_then(|best| best.point[index].number);
    let marked = best.filter(|_| low <= high).map(|value| {
        let at = place(dimension, value);
        Series {
            number: MARK,
            shape: Shape::Dashed(vec![[at, low], [at, high]]),
        }
    });
    let mut series = vec![
        Series {
            number: OTHER,
            shape: Shape::dots(other),
        },
        Series {
            number: BEST,
            shape: Shape::dots(feasible),
        },
    ];
    series.extend(marked);
    let plot = LinePlot {
        title: format!("objective over {}", dimension.key),
        width: 540.0,
        height: 260.0,
        x: label(dimension),
        y: AxisLabel::in_unit("objective", &result.unit),
        series,
    };
    Figure {
        legend: vec![
            (Swatch::Curve(BEST), "feasible".to_owned()),
            (Swatch::Curve(OTHER), "infeasible".to_owned()),
        ],
        drawing: plot.drawing(),
        ..Figure::default()
    }
}

/// Returns the histogram of the values of a dimension.
fn distribution(
    result: &OptimizationResult,
    order: &[usize],
    index: usize,
    dimension: &OptimizedDimension,
) -> Figure {
    let [from, to] = [dimension.from, dimension.to].map(|end| place(dimension, end));
    let width = (to - from) / BARS as f64;
    let shares = |points: &[usize]| -> Vec<[f64; 2]> {
        let mut counts = [0_usize; BARS];
        for &point in points {
            let share = dimension.share_of(result.points[point].numbers[index]);
            let bar = (1..BARS)
                .filter(|&bar| share * BARS as f64 >= bar as f64)
                .count();
            counts[bar] += 1;
        }
        let bars = counts.iter().enumerate();
        bars.map(|(bar, &count)| {
            let share = count as f64 / points.len().max(1) as f64;
            [from + width * (bar as f64 + 0.5), share]
        })
        .collect()
    };
    let best = &order[..order.len().div_ceil(BEST_OF)];
    let bars = |width: f64, points| Shape::Bars { width, points };
    let plot = LinePlot {
        title: format!("points over {}", dimension.key),
        width: 540.0,
        height: 260.0,
        x: label(dimension),
        y: AxisLabel::number("share of the points"),
        series: vec![
            Series {
                number: BEST,
                shape: bars(width, shares(best)),
            },
            Series {
                number: OTHER,
                shape: bars(0.4 * width, shares(order)),
            },
        ],
    };
    Figure {
        legend: vec![
            (Swatch::Curve(BEST), format!("the best of {BEST_OF}")),
            (Swatch::Curve(OTHER), "all".to_owned()),
        ],
        drawing: plot.drawing(),
        ..Figure::default()
    }
}

fn terms(result: &OptimizationResult) -> Vec<Term> {
    let mut terms = vec![
        Term::code("scenario", &result.file),
        Term::code("search space", &result.space),
    ];
    let settings = result.settings.iter();
    terms.extend(
        settings.map(|(key, value)| Term::code("set in all runs", format!("{key} = {value}"))),
    );
    let constraints = result.constraints.iter();
    terms.extend(constraints.map(|name| Term::code("constraint", name)));
    let search = format!(
        "{}, {} particles, {} iterations, {} restarts, seed {}",
        result.method.word(),
        result.particles,
        result.iterations,
        result.restarts,
        result.seed
    );
    terms.push(Term::code("search", search));
    let command = result.best.as_ref().map(|best| &best.command);
    terms.extend(command.map(|command| Term::code("run of the best point", command)));
    terms.push(Term::code("hash of points and costs", &result.hash));
    terms.push(Term::code("hash of the program", &result.build));
    terms
}

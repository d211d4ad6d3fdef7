//! Summary, page and Markdown of a study of robustness.

#[cfg(test)]
mod tests;

use std::fmt::Write as _;

use twinrig_campaign::spread::{EnsembleKind, ExpectationSpread, Magnitude};
use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::number::percent;
use twinrig_report::page::{Block, Figure, Page, Swatch, Term};
use twinrig_report::summary::Summary;
use twinrig_report::table::{Cell, Column, Table, Tone};

use super::divergence::Growth;
use super::margin_text;
use super::results::{EnsembleRun, RobustnessResult, RobustnessStudy};
use crate::differing::is_visible;
use crate::machine::Machine;
use crate::reproduction::reproduction;

/// Greatest number of points of a curve.
const DRAWN: usize = 300;
/// Place of a perturbation of one unit in the last place on a logarithmic scale.
const LAST_PLACE: f64 = -16.0;
/// Colours of the smallest perturbation, of the others and of bounds.
const LEAST: usize = 0;
const OTHERS: usize = 2;
const BOUND: usize = 7;

impl RobustnessStudy {
    /// Returns the summary, without the parts that are left out.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new(&self.title(), "study of robustness", String::new());
        for result in &self.results {
            let (scenario, plant) = (&result.case.scenario, &result.case.plant);
            summary.table(&format!("{scenario} on {plant}"), &expectations(result));
            summary.block(
                facts(self, result)
                    .into_iter()
                    .map(|fact| format!("  {fact}")),
            );
        }
        if self.results.len() > 1 {
            summary.table("all scenarios", &cases(self));
        }
        summary
    }

    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn page(&self, machine: &Machine, command: &str) -> Page {
        let mut blocks = vec![Block::Table(cases(self))];
        for result in &self.results {
            let case = &result.case;
            blocks.push(Block::Heading(format!(
                "{} on {}",
                case.scenario, case.plant
            )));
            blocks.extend(case.why_seeds.as_ref().map(|why| {
                Block::Text(format!(
                    "The runs differ by their seed, as the start cannot be perturbed: {why}."
                ))
            }));
            blocks.push(Block::Table(expectations(result)));
            blocks.push(distances(self, result));
            blocks.extend(margins(result));
        }
        let files: Vec<String> = self.results.iter().map(|it| it.case.file.clone()).collect();
        let headline = match &*self.results {
            [_] => self.headline(),
            _ => String::new(),
        };
        Page {
            kind: "Study of robustness".to_owned(),
            title: format!("Expectations over perturbed runs: {}", self.title()),
            headline,
            blocks,
            terms: reproduction(machine, command, &files, definitions(), &self.left_out),
        }
    }

    /// Returns a table with a line for each scenario, and one of the expectations of each, in
    /// Markdown.
    pub fn markdown(&self) -> String {
        let mut text = cases(self).markdown();
        for result in &self.results {
            let (scenario, plant) = (&result.case.scenario, &result.case.plant);
            // Writing to a string cannot fail.
            let _ = write!(text, "\n## {scenario}, on {plant}\n\n");
            text += &expectations(result).markdown();
        }
        text
    }

    fn title(&self) -> String {
        match &*self.results {
            [only] => only.case.scenario.clone(),
            all => format!("{} scenarios", all.len()),
        }
    }
}

fn definitions() -> Vec<Term> {
    let definitions = [
        (
            "perturbation",
            "change of every coordinate of the plant's start, up to this magnitude in m and \
             rad, or by one unit in its last place (1 ulp)",
        ),
        (
            "distance",
            "greatest distance of trunk and feet from those of the unperturbed run; of a \
             plant without them, of its lengths and angles",
        ),
        (
            "horizon",
            "first time at which a run that began 1 ulp away is beyond the tolerance",
        ),
        (
            "growth rate",
            "slope of the logarithm of the distance over time, up to the tolerance; median of \
             the runs in which a line fits it better than over the logarithm of time, if \
             these are at least half of all",
        ),
        (
            "share",
            "of the runs in which the expectation holds, with its 95 % interval after Wilson",
        ),
    ];
    let terms = definitions.map(|(name, text)| Term::text(name, text));
    terms.into()
}

/// Returns the table of the scenarios.
fn cases(study: &RobustnessStudy) -> Table {
    let mut table = Table::new([
        Column::label("scenario"),
        Column::text("plant"),
        Column::text("runs differ by").only_on_pages(),
        Column::number(format!("hold in all {} runs", study.plan.runs)),
        Column::number("horizon"),
        Column::text("growth rate"),
        Column::text("changed by 1 ulp"),
    ]);
    for result in &study.results {
        let all = &result.expectations;
        let always = all.iter().filter(|it| it.held == it.runs).count();
        let undetermined: Vec<&str> = result.undetermined().map(|it| &*it.name).collect();
        table.row([
            result.case.scenario.clone().into(),
            result.case.plant.clone().into(),
            match result.case.kind {
                EnsembleKind::Starts => "start".into(),
                EnsembleKind::Seeds => "seed".into(),
                EnsembleKind::Parameters => "values".into(),
            },
            format!("{always} of {}", all.len()).into(),
            result.horizon_text().into(),
            result.growth_text().into(),
            undetermined.join(", ").into(),
        ]);
    }
    table
}

/// Returns the table of the expectations of a scenario.
fn expectations(result: &RobustnessResult) -> Table {
    let mut table = Table::new([
        Column::label("expectation"),
        Column::number("holds"),
        Column::number("95 % interval"),
        Column::number("least margin"),
        Column::number("5 %").only_on_pages(),
        Column::number("median"),
        Column::number("95 %").only_on_pages(),
        Column::number("greatest"),
        Column::number("not observed"),
        Column::text("changes at"),
    ]);
    for one in &result.expectations {
        let tone = if one.held < one.runs {
            Tone::Bad
        } else {
            Tone::Plain
        };
        let interval = [one.interval.low, one.interval.high].map(percent);
        let margins = one
            .margins
            .map(|it| [it.min, it.p5, it.median, it.p95, it.max]);
        let margins = margins.map_or([const { None }; 5], |it| it.map(Some));
        let [least, p5, median, p95, greatest] =
            margins.map(|margin| Cell::from(margin.map(|it| margin_text(one, it))));
        table.row([
            one.name.clone().into(),
            Cell::from(format!("{} of {}", one.held, one.runs)).with_tone(tone),
            interval.join(" … ").into(),
            least,
            p5,
            median,
            p95,
            greatest,
            Some(one.unobserved).filter(|count| *count > 0).into(),
            one.changes_at.map(|at| at.to_string()).into(),
        ]);
    }
    table
}

/// Returns horizon, growth and crossing times of a case.
fn facts(study: &RobustnessStudy, result: &RobustnessResult) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(why) = &result.case.why_seeds {
        lines.push(format!("the runs differ by their seed: {why}"));
    }
    let undetermined: Vec<&str> = result.undetermined().map(|it| &*it.name).collect();
    if !undetermined.is_empty() {
        let names = undetermined.join(", ");
        lines.push(format!("changes with a perturbation of 1 ulp: {names}"));
    }
    if result.case.unit.is_none() {
        lines.push("predictability horizon: no positions are observed".to_owned());
        return lines;
    }
    let by = match result.case.kind {
        EnsembleKind::Starts => "of runs 1 ulp apart",
        EnsembleKind::Seeds => "of runs with other seeds",
        EnsembleKind::Parameters => "of runs with other values",
    };
    lines.push(format!(
        "predictability horizon {by}, tolerance {}: {}",
        study.tolerance_text(result),
        result.horizon_text()
    ));
    lines.push(format!("growth of distances: {}", result.growth_text()));
    lines
}

/// Returns the place of a run on the axis of perturbations: the logarithm of its magnitude, or its
/// number in an ensemble of seeds.
fn place(number: usize, run: &EnsembleRun) -> f64 {
    match run.member.magnitude {
        Some(Magnitude::LastPlace) => LAST_PLACE,
        Some(Magnitude::UpTo(most)) => libm::log10(most),
        None => (number + 1) as f64,
    }
}

/// Returns the plot of distances over time, with the line of the fitted growth.
fn distances(study: &RobustnessStudy, result: &RobustnessResult) -> Block {
    let Some(unit) = &result.case.unit else {
        let text = "No position is observed, and so no distance of trajectories.";
        return Block::text(text);
    };
    let mut series: Vec<Series> = result
        .perturbed
        .iter()
        .rev()
        .map(|run| Series {
            number: match run.member.magnitude {
                Some(Magnitude::LastPlace) => LEAST,
                _ => OTHERS,
            },
            shape: Shape::Line(logarithms(&run.divergence.distances)),
        })
        .collect();
    let end_s = result.case.duration_s;
    let fitted = result.perturbed.iter().find_map(|run| {
        let Growth::Exponential { rate, start } = run.divergence.growth else {
            return None;
        };
        let until_s = run.divergence.crossed_s.unwrap_or(end_s);
        let line = [0.0, until_s].map(|at_s| {
            let log = libm::log10(start) + rate * at_s * std::f64::consts::LOG10_E;
            [at_s, log]
        });
        Some(Series {
            number: BOUND,
            shape: Shape::Dashed(line.into()),
        })
    });
    series.extend(fitted);
    let tolerance = libm::log10(study.plan.tolerance);
    series.push(Series {
        number: BOUND,
        shape: Shape::Dashed(vec![[0.0, tolerance], [end_s, tolerance]]),
    });
    let plot = LinePlot {
        title: format!(
            "distance from the unperturbed run of {}",
            result.case.scenario
        ),
        width: 1080.0,
        height: 340.0,
        x: AxisLabel::in_unit("time", "s"),
        y: AxisLabel::number(format!("log₁₀ of the distance  [{unit}]")),
        series,
    };
    let tolerance = format!("tolerance of {}, and growth", study.tolerance_text(result));
    Block::Figure(Figure {
        heading: "Distance from the unperturbed run".to_owned(),
        legend: vec![
            (Swatch::Curve(LEAST), "1 ulp".to_owned()),
            (Swatch::Curve(OTHERS), "greater perturbations".to_owned()),
            (Swatch::Dashed(BOUND), tolerance),
        ],
        drawing: plot.drawing(),
        caption: String::new(),
    })
}

/// Returns points evenly taken from a curve, with the logarithms of its positive distances.
fn logarithms(distances: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let every = distances.len().div_ceil(DRAWN).max(1);
    let drawn = distances.iter().step_by(every);
    let positive = drawn.filter(|[_, distance]| *distance > 0.0);
    positive
        .map(|[at_s, distance]| [*at_s, libm::log10(*distance)])
        .collect()
}

/// Returns the plots of the margins that differ between runs, and a sentence on the others.
fn margins(result: &RobustnessResult) -> Vec<Block> {
    let all = result.expectations.iter().enumerate();
    let (varied, same): (Vec<_>, Vec<_>) =
        all.partition(|(_, one)| one.margins.is_some_and(|it| is_visible([it.min, it.max])));
    let figures = varied.iter();
    let figures = figures.filter_map(|(index, one)| margin(result, *index, one));
    let figures: Vec<Figure> = figures.collect();
    let mut blocks = Vec::new();
    if !figures.is_empty() {
        blocks.push(Block::Text(
            "Margins over the runs. Dots: runs. Line: the unperturbed run. Band: from 5 % to 95 % \
             of the runs."
                .to_owned(),
        ));
        blocks.push(Block::Figures(figures));
    }
    let names: Vec<&str> = same.iter().map(|(_, one)| &*one.name).collect();
    if !names.is_empty() {
        let names = names.join(", ");
        blocks.push(Block::Text(format!(
            "Margins that are the same in all runs within 1 %: {names}."
        )));
    }
    blocks
}

/// Returns the plot of the margins of an expectation over the perturbations.
fn margin(result: &RobustnessResult, index: usize, one: &ExpectationSpread) -> Option<Figure> {
    let runs = result.perturbed.iter().enumerate();
    let points: Vec<[f64; 2]> = runs
        .filter_map(|(number, run)| {
            let outcome = run.member.row.expectations.get(index)?;
            Some([place(number, run), outcome.margin?])
        })
        .collect();
    let (first, last, spread) = (points.first()?, points.last()?, one.margins?);
    let ends = [first[0], last[0]];
    let level = |at: f64| ends.map(|x| [x, at]).to_vec();
    let mut series = vec![
        Series {
            number: OTHERS,
            shape: Shape::Band(ends.map(|x| [x, spread.p5, spread.p95]).to_vec()),
        },
        Series {
            number: BOUND,
            shape: Shape::Dashed(level(0.0)),
        },
    ];
    series.extend(one.margin.map(|margin| Series {
        number: LEAST,
        shape: Shape::Line(level(margin)),
    }));
    series.push(Series {
        number: LEAST,
        shape: Shape::dots(points),
    });
    let plot = LinePlot {
        title: format!("margin of {}", one.name),
        width: 540.0,
        height: 220.0,
        x: match result.case.kind {
            EnsembleKind::Starts => {
                let name = format!("log₁₀ of the perturbation, 1 ulp at {LAST_PLACE}");
                AxisLabel::number(name)
            }
            EnsembleKind::Seeds | EnsembleKind::Parameters => {
                AxisLabel::number("number of the run")
            }
        },
        y: AxisLabel::in_unit("margin", &one.unit),
        series,
    };
    Some(Figure {
        heading: one.name.clone(),
        drawing: plot.drawing(),
        ..Figure::default()
    })
}

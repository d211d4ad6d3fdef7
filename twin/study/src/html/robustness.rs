//! Page of a study of robustness.

use twinrig_campaign::sweep::percent;

use crate::machine::Machine;
use crate::robustness::{EnsembleRun, Growth, RobustnessResult, RobustnessStudy};
use twinrig_campaign::spread::Magnitude;
use twinrig_campaign::spread::{EnsembleKind, ExpectationSpread};
use twinrig_report::number::plain;

use super::{document, drawing, reproduction};
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::line_plot::{LinePlot, Series, Shape};
use twinrig_report::html::marker::swatch;
use twinrig_report::html::table::Table;

/// Greatest number of points of a curve.
const DRAWN: usize = 300;
/// Place of a perturbation of one unit in the last place on a logarithmic scale.
const LAST_PLACE: f64 = -16.0;
/// Colours of the smallest perturbation, of the others and of bounds.
const LEAST: usize = 0;
const OTHERS: usize = 2;
const BOUND: usize = 7;

impl RobustnessStudy {
    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn html(&self, machine: &Machine, command: &str) -> String {
        let mut body = summary(self);
        for result in &self.results {
            let case = &result.case;
            let title = format!("{} on {}", case.scenario, case.plant);
            body += &element("h2", "", &escaped(&title));
            body += &case.why_seeds.as_ref().map_or(String::new(), |why| {
                paragraph(&format!(
                    "The runs differ by their seed, as the start cannot be perturbed: {why}."
                ))
            });
            body += &expectations(result);
            body += &distances(self, result);
            let plots = result.expectations.iter().enumerate();
            let plots = plots.map(|(index, one)| margins(result, index, one));
            body += &element("div", "pair", &plots.collect::<String>());
        }
        let files: Vec<String> = self.results.iter().map(|it| it.case.file.clone()).collect();
        let title = match &*self.results {
            [only] => only.case.scenario.clone(),
            all => format!("{} scenarios", all.len()),
        };
        let headline = match &*self.results {
            [_] => self.headline(),
            _ => String::new(),
        };
        document(
            "Study of robustness",
            &format!("Expectations over perturbed runs: {title}"),
            &headline,
            &(body + &reproduction(machine, command, &files, &self.definitions())),
        )
    }

    fn definitions(&self) -> Vec<(String, String)> {
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
        let definitions = definitions.map(|(name, text)| (name.to_owned(), text.to_owned()));
        let left_out = self.left_out.iter();
        let left_out = left_out.map(|left| ("left out".to_owned(), left.clone()));
        definitions.into_iter().chain(left_out).collect()
    }
}

fn summary(study: &RobustnessStudy) -> String {
    let mut table = Table::new(
        "scenario | plant | runs differ by | hold in all runs | horizon | growth rate | \
         changed by 1 ulp",
        3,
    );
    for result in &study.results {
        let all = &result.expectations;
        let always = all.iter().filter(|it| it.held == it.runs).count();
        let undetermined: Vec<&str> = result.undetermined().map(|it| &*it.name).collect();
        table.row(
            "",
            vec![
                element("b", "", &escaped(&result.case.scenario)),
                escaped(&result.case.plant),
                match result.case.kind {
                    EnsembleKind::Starts => "start".to_owned(),
                    EnsembleKind::Seeds => "seed".to_owned(),
                },
                format!("{always} of {}", all.len()),
                result.horizon_text(),
                result.growth_text(),
                escaped(&undetermined.join(", ")),
            ],
        );
    }
    table.html()
}

fn expectations(result: &RobustnessResult) -> String {
    let mut table = Table::new(
        "expectation | changes at | share | from | to | unobserved | least margin | 5 % | median \
         | 95 % | greatest | unit",
        2,
    );
    for one in &result.expectations {
        let margins = one.margins.map_or([const { String::new() }; 5], |it| {
            [it.min, it.p5, it.median, it.p95, it.max].map(plain)
        });
        let mut cells = vec![
            element("b", "", &escaped(&one.name)),
            one.changes_at.map_or(String::new(), |at| at.to_string()),
            percent(one.share),
            percent(one.interval.low),
            percent(one.interval.high),
            one.unobserved.to_string(),
        ];
        cells.extend(margins);
        cells.push(one.unit.clone());
        table.row(if one.held == one.runs { "" } else { "bad" }, cells);
    }
    table.html()
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
fn distances(study: &RobustnessStudy, result: &RobustnessResult) -> String {
    let Some(unit) = &result.case.unit else {
        return paragraph("No position is observed, and so no distance of trajectories.");
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
        x_label: "time  [s]".to_owned(),
        y_label: format!("log₁₀ of the distance  [{unit}]"),
        series,
    };
    let legend = [
        (swatch(LEAST, false), "1 ulp".to_owned()),
        (swatch(OTHERS, false), "greater perturbations".to_owned()),
        (
            swatch(BOUND, true),
            format!("tolerance of {}, and growth", study.tolerance_text(result)),
        ),
    ];
    drawing(
        "Distance from the unperturbed run",
        &legend,
        &plot.svg(),
        "",
    )
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

/// Returns the plot of the margins of an expectation over the perturbations.
fn margins(result: &RobustnessResult, index: usize, one: &ExpectationSpread) -> String {
    let runs = result.perturbed.iter().enumerate();
    let points: Vec<[f64; 2]> = runs
        .filter_map(|(number, run)| {
            let outcome = run.member.row.expectations.get(index)?;
            Some([place(number, run), outcome.margin?])
        })
        .collect();
    let (Some(first), Some(last), Some(spread)) = (points.first(), points.last(), one.margins)
    else {
        return String::new();
    };
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
        shape: Shape::Dots(points),
    });
    let plot = LinePlot {
        title: format!("margin of {}", one.name),
        width: 540.0,
        height: 220.0,
        x_label: match result.case.kind {
            EnsembleKind::Starts => format!("log₁₀ of the perturbation, 1 ulp at {LAST_PLACE}"),
            EnsembleKind::Seeds => "number of the run".to_owned(),
        },
        y_label: match &*one.unit {
            "1" => "margin".to_owned(),
            unit => format!("margin  [{unit}]"),
        },
        series,
    };
    let caption = "Dots: runs. Line: the unperturbed run. Band: from 5 % to 95 % of the runs.";
    drawing(&one.name, &[], &plot.svg(), caption)
}

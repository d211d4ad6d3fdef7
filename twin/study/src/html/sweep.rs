//! Page of a sweep: shares with intervals, margins over the dimensions, failures with commands. It
//! contains neither times nor the machine, so that equal sweeps have equal pages.

use twinrig_campaign::sweep::{
    ExpectationVerdict, ResultDimension, ResultRow, RowVerdict, Share, ShareVerdict, SweepResult,
    SweepVerdict,
};
use twinrig_kernel::Unit;

use super::line_plot::{LinePlot, Series, Shape};
use super::marker::swatch;
use super::table::Table;
use super::text::{element, escaped, paragraph};
use super::{card, document, drawing};

/// Greatest number of points of one kind in a plot.
const DRAWN: usize = 1000;
/// Greatest number of failures in the table.
const LISTED: usize = 200;
/// Bars of a histogram, and least number of runs in one of them on average.
const BARS: usize = 12;
const RUNS_OF_BAR: usize = 4;

/// Colours of pass, fail and of what is required.
const PASS: usize = 0;
const FAIL: usize = 1;
const BOUND: usize = 7;

/// Returns the page of a sweep.
pub fn sweep_page(result: &SweepResult) -> String {
    let axes: Vec<SweepAxis<'_>> = (0..result.dimensions.len())
        .map(|index| SweepAxis::of(result, index))
        .collect();
    let mut body = cards(result);
    body += &result
        .warning()
        .map_or(String::new(), |warning| paragraph(&warning));
    if !result.shares.is_empty() {
        body += "<h2>Shares</h2>\n";
        body += &shares(result);
    }
    body += "<h2>Runs that pass</h2>\n";
    let passing: String = axes.iter().map(|axis| passing(result, axis)).collect();
    body += &element("div", "pair", &passing);
    let pairs = axes.iter().enumerate();
    let pairs: String = pairs
        .flat_map(|(index, x)| axes[index + 1..].iter().map(move |y| (x, y)))
        .map(|(x, y)| plane(result, x, y))
        .collect();
    body += &element("div", "pair", &pairs);
    body += "<h2>Margins</h2>\n";
    body += &paragraph(
        "The margin of an expectation is the distance to its bound; below 0 the expectation fails.",
    );
    for (name, unit) in result.expectations() {
        let plots = axes.iter().map(|axis| margins(result, axis, name, unit));
        body += &element("h3", "", &escaped(name));
        body += &element("div", "pair", &plots.collect::<String>());
    }
    body += "<h2>Failures</h2>\n";
    body += &failures(result);
    body += &reproduction(result);
    let title = format!("{}: {}", result.name, result.scenario);
    document("Sweep", &title, &headline(result), &body)
}

fn headline(result: &SweepResult) -> String {
    let counts = &result.counts;
    let runs = format!("{} of {} runs pass", counts.pass, counts.points);
    match result.verdict {
        SweepVerdict::Undecided => {
            format!("Undecided: {runs}, and an interval contains its bound.")
        }
        SweepVerdict::Error => format!("Error: {runs}, and {} have an error.", counts.error),
        SweepVerdict::Pass => format!("Pass: {runs}."),
        _ => format!("Fail: {runs}."),
    }
}

fn cards(result: &SweepResult) -> String {
    let counts = &result.counts;
    let mut cards = card("verdict", result.verdict.word(), "of the sweep");
    let design = format!("{} design", result.design.kind.word());
    cards += &card("points", &counts.points.to_string(), &design);
    cards += &card("pass", &counts.pass.to_string(), "all expectations hold");
    cards += &card("fail", &counts.fail.to_string(), "an expectation fails");
    if counts.error > 0 {
        cards += &card(
            "error",
            &counts.error.to_string(),
            "the run did not complete",
        );
    }
    element("div", "cards", &cards)
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn shares(result: &SweepResult) -> String {
    let mut table = Table::new(
        "number | share | verdict | held | runs | share | from | to | confidence | least | greatest",
        3,
    );
    let mut series = Vec::new();
    for (index, share) in result.shares.iter().enumerate() {
        let Share { interval, .. } = share;
        let number = (index + 1) as f64;
        let class = match share.verdict {
            ShareVerdict::Pass => "tag ok",
            ShareVerdict::Fail => "tag bad",
            ShareVerdict::Undecided => "tag",
        };
        let optional = |value: Option<f64>| value.map_or(String::new(), percent);
        table.row(
            "",
            vec![
                (index + 1).to_string(),
                element("b", "", &escaped(&share.of)),
                element("span", class, share.verdict.word()),
                share.held.to_string(),
                share.runs.to_string(),
                optional(share.share),
                percent(interval.low),
                percent(interval.high),
                percent(share.confidence),
                optional(share.min),
                optional(share.max),
            ],
        );
        let line = |value: f64| Shape::Dashed(vec![[value, number - 0.4], [value, number + 0.4]]);
        let bounds = [share.min, share.max].into_iter().flatten();
        series.extend(bounds.map(|bound| Series {
            number: BOUND,
            shape: line(bound),
        }));
        series.push(Series {
            number: PASS,
            shape: Shape::Line(vec![[interval.low, number], [interval.high, number]]),
        });
        let dot = share.share.map(|share| [share, number]);
        series.push(Series {
            number: PASS,
            shape: Shape::Dots(dot.into_iter().collect()),
        });
    }
    let plot = LinePlot {
        title: "shares with their confidence intervals".to_owned(),
        width: 1080.0,
        height: 130.0 + 30.0 * result.shares.len() as f64,
        x_label: "share of the runs".to_owned(),
        y_label: "number".to_owned(),
        series,
    };
    let legend = [
        (swatch(PASS, false), "confidence interval".to_owned()),
        (swatch(BOUND, true), "bound".to_owned()),
    ];
    let caption = "Score intervals of Wilson, for independent draws: the points of a grid are \
                   none, and those of a Latin hypercube scatter less.";
    table.html() + &drawing("", &legend, &plot.svg(), caption)
}

/// A dimension as an axis of plots: numbers as they are, texts by their number in a list.
struct SweepAxis<'a> {
    dimension: &'a ResultDimension,
    index: usize,
    /// Texts of a dimension without numbers.
    texts: Vec<&'a str>,
}

impl<'a> SweepAxis<'a> {
    fn of(result: &'a SweepResult, index: usize) -> Self {
        let dimension = &result.dimensions[index];
        let mut texts: Vec<&str> = Vec::new();
        if dimension.unit.is_none() {
            for row in &result.rows {
                let text = row.point[index].shown();
                if !texts.contains(&text) {
                    texts.push(text);
                }
            }
        }
        Self {
            dimension,
            index,
            texts,
        }
    }

    fn at(&self, row: &ResultRow) -> f64 {
        let value = &row.point[self.index];
        if let (Some(_), Some(number)) = (self.dimension.unit, value.number) {
            return number;
        }
        let text = value.shown();
        let place = self.texts.iter().position(|known| *known == text);
        place.map_or(0.0, |place| (place + 1) as f64)
    }

    fn label(&self) -> String {
        match self.dimension.unit {
            Some(Unit::One) => self.dimension.key.clone(),
            Some(unit) => format!("{}  [{}]", self.dimension.key, unit.symbol()),
            None => {
                let texts = self.texts.iter().take(BARS).enumerate();
                let texts = texts.map(|(number, text)| format!("{} {text}", number + 1));
                let texts: Vec<String> = texts.collect();
                format!("{}  ({})", self.dimension.key, texts.join(", "))
            }
        }
    }
}

/// Returns a histogram of the share of runs that pass.
fn passing(result: &SweepResult, axis: &SweepAxis<'_>) -> String {
    let values = result.rows.iter().map(|row| axis.at(row));
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    let bars = (result.rows.len() / RUNS_OF_BAR).clamp(1, BARS);
    let width = if high > low {
        (high - low) / bars as f64
    } else {
        1.0
    };
    // Runs in each bar, and those among them that pass.
    let mut counts = vec![(0_usize, 0_usize); bars];
    for row in &result.rows {
        let place = (axis.at(row) - low) / width;
        let bar = (1..bars).filter(|&bar| place >= bar as f64).count();
        counts[bar].0 += 1;
        counts[bar].1 += usize::from(row.row.verdict == RowVerdict::Pass);
    }
    let points = counts.iter().enumerate().map(|(bar, &(runs, pass))| {
        let share = pass as f64 / runs.max(1) as f64;
        [low + width * (bar as f64 + 0.5), share]
    });
    // Both ends of the scale of shares.
    let scale = Shape::Line(vec![[low, 0.0], [low, 1.0]]);
    let plot = LinePlot {
        title: format!("share of runs that pass over {}", axis.dimension.key),
        width: 540.0,
        height: 260.0,
        x_label: axis.label(),
        y_label: "share that passes".to_owned(),
        series: vec![
            Series {
                number: BOUND,
                shape: scale,
            },
            Series {
                number: PASS,
                shape: Shape::Bars(points.collect()),
            },
        ],
    };
    drawing("", &[], &plot.svg(), "")
}

/// Returns legend and dots of the runs that pass and fail, and the number left out.
fn dots(points: &[(bool, [f64; 2])]) -> ([(String, String); 2], Vec<Series>, usize) {
    let mut left_out = 0;
    let mut series = |passes: bool, number: usize| {
        let of: Vec<[f64; 2]> = points
            .iter()
            .filter(|(pass, _)| *pass == passes)
            .map(|(_, point)| *point)
            .collect();
        // Evenly over the points, so that the same ones are drawn in every plot.
        let every = of.len().div_ceil(DRAWN).max(1);
        let drawn: Vec<[f64; 2]> = of.iter().step_by(every).copied().collect();
        left_out += of.len() - drawn.len();
        Series {
            number,
            shape: Shape::Dots(drawn),
        }
    };
    let series = vec![series(true, PASS), series(false, FAIL)];
    let legend = [
        (swatch(PASS, false), "pass".to_owned()),
        (swatch(FAIL, false), "fail".to_owned()),
    ];
    (legend, series, left_out)
}

fn caption(left_out: usize) -> String {
    match left_out {
        0 => String::new(),
        count => format!("{count} runs are not drawn; all are in rows.csv."),
    }
}

/// Returns a plot of passing and failing runs over two dimensions.
fn plane(result: &SweepResult, x: &SweepAxis<'_>, y: &SweepAxis<'_>) -> String {
    let rows = result.rows.iter();
    let points: Vec<_> = rows
        .map(|row| {
            let pass = row.row.verdict == RowVerdict::Pass;
            (pass, [x.at(row), y.at(row)])
        })
        .collect();
    let (legend, series, left_out) = dots(&points);
    let plot = LinePlot {
        title: format!("runs over {} and {}", x.dimension.key, y.dimension.key),
        width: 540.0,
        height: 320.0,
        x_label: x.label(),
        y_label: y.label(),
        series,
    };
    drawing("", &legend, &plot.svg(), &caption(left_out))
}

/// Returns a plot of the margin of an expectation over a dimension.
fn margins(result: &SweepResult, axis: &SweepAxis<'_>, name: &str, unit: &str) -> String {
    let points: Vec<_> = result
        .rows
        .iter()
        .filter_map(|row| {
            let one = row.row.expectation(name)?;
            let pass = one.verdict == ExpectationVerdict::Pass;
            Some((pass, [axis.at(row), one.margin?]))
        })
        .collect();
    if points.is_empty() {
        return paragraph("It has no margin in any run.");
    }
    let (legend, mut series, left_out) = dots(&points);
    let ends = points.iter().map(|(_, [x, _])| *x);
    let ends = ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    });
    series.push(Series {
        number: BOUND,
        shape: Shape::Dashed(ends.map(|x| [x, 0.0]).into()),
    });
    let plot = LinePlot {
        title: format!("margin of {name} over {}", axis.dimension.key),
        width: 540.0,
        height: 260.0,
        x_label: axis.label(),
        y_label: match unit {
            "1" => "margin".to_owned(),
            unit => format!("margin  [{unit}]"),
        },
        series,
    };
    drawing("", &legend, &plot.svg(), &caption(left_out))
}

fn failures(result: &SweepResult) -> String {
    let of = |verdict: RowVerdict| {
        let rows = result.rows.iter();
        rows.filter(move |row| row.row.verdict == verdict)
    };
    let rows: Vec<&ResultRow> = of(RowVerdict::Error).chain(of(RowVerdict::Fail)).collect();
    if rows.is_empty() {
        return paragraph("All runs pass.");
    }
    let mut table = Table::new("point | verdict | why and command", 2);
    for row in rows.iter().take(LISTED) {
        let failed = row.row.expectations.iter();
        let failed = failed.filter(|one| one.verdict != ExpectationVerdict::Pass);
        let failed: Vec<&str> = failed.map(|one| one.name.as_str()).collect();
        let why = row.row.error.clone().unwrap_or_else(|| failed.join(", "));
        let command = element("code", "", &escaped(&row.command));
        table.row(
            "",
            vec![
                element("span", "wrap", &escaped(&row.name)),
                element("span", "tag bad", row.row.verdict.word()),
                element("span", "why", &escaped(&why)) + "<br/>" + &command,
            ],
        );
    }
    let more = match rows.len().saturating_sub(LISTED) {
        0 => String::new(),
        more => paragraph(&format!("{more} more are in rows.csv.")),
    };
    table.html() + &more
}

fn reproduction(result: &SweepResult) -> String {
    let mut terms = String::new();
    let mut term = |name: &str, text: &str| {
        terms += &element("dt", "", &escaped(name));
        terms += &element("dd", "", &element("code", "", &escaped(text)));
        terms.push('\n');
    };
    term("scenario", &result.file);
    term("specification", &result.spec);
    for (key, value) in &result.settings {
        term("set in all runs", &format!("{key} = {value}"));
    }
    let design = &result.design;
    term(
        "design",
        &format!("{}, seed {}", design.kind.word(), design.seed),
    );
    term(
        "hash of points and runs",
        result.hash.as_deref().unwrap_or("incomplete"),
    );
    term("hash of the program", &result.build);
    format!("<h2>Reproduction</h2>\n{}", element("dl", "", &terms))
}

//! Page of a sweep: shares with intervals, margins over the dimensions, failures with commands. It
//! contains neither times nor the machine, so that equal sweeps have equal pages.

mod plots;
#[cfg(test)]
mod tests;

use twinrig_campaign::sweep::{
    ElementaryEffect, Share, ShareVerdict, SweepResult, SweepVerdict, percent,
};

use plots::{BOUND, PASS, SweepAxis, margins, passing, plane};

use super::reproduction::Reproduction;
use super::{card, document, drawing};
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::line_plot::{LinePlot, Series, Shape};
use twinrig_report::html::marker::swatch;
use twinrig_report::html::table::HtmlTable;
use twinrig_report::number::quantity;

/// Greatest number of failures in the table.
const LISTED: usize = 200;
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
    let effects = result.elementary_effects();
    if !effects.is_empty() {
        // Plots of all pairs of so many dimensions would be no overview.
        body += "<h2>Elementary effects</h2>\n";
        body += &paragraph(
            "Changes of a measured value per whole interval of a dimension: their mean μ, the mean \
             μ* of their magnitudes, and their standard deviation σ.",
        );
        body += &effect_table(&effects);
        body += "<h2>Failures</h2>\n";
        body += &failures(result);
        return page(result, body);
    }
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
    for (name, units) in result.expectations() {
        let plots = units.iter();
        let plots = plots.flat_map(|unit| axes.iter().map(move |axis| (axis, *unit)));
        let plots = plots.map(|(axis, unit)| margins(result, axis, name, unit));
        body += &element("h3", "", &escaped(name));
        body += &element("div", "pair", &plots.collect::<String>());
    }
    body += "<h2>Failures</h2>\n";
    body += &failures(result);
    page(result, body)
}

fn page(result: &SweepResult, mut body: String) -> String {
    body += &reproduction(result);
    let title = format!("{}: {}", result.name, result.scenario);
    document("Sweep", &title, &headline(result), &body)
}

fn effect_table(effects: &[ElementaryEffect]) -> String {
    let mut table = HtmlTable::new("effect on | of | μ* | μ | σ | number", 2);
    for one in effects {
        let shown = |value: f64| quantity(value, &one.unit);
        table.row(
            "",
            vec![
                escaped(&one.measure),
                element("code", "", &escaped(&one.dimension)),
                shown(one.mu_star),
                shown(one.mu),
                one.sigma.map_or_else(String::new, shown),
                one.effects.to_string(),
            ],
        );
    }
    table.html()
}

fn headline(result: &SweepResult) -> String {
    let counts = &result.counts;
    let runs = format!("{} of {} runs pass", counts.pass, counts.points);
    let passed = |share: &&Share| share.verdict == ShareVerdict::Pass;
    let all = result.shares.len();
    let shares = match result.shares.iter().filter(passed).count() {
        _ if all == 0 => String::new(),
        held => format!("{held} of {all} shares hold; "),
    };
    let word = match result.verdict {
        SweepVerdict::Pass => "Pass",
        SweepVerdict::Undecided => "Undecided",
        SweepVerdict::Error => "Error",
        _ => "Fail",
    };
    let errors = match counts.error {
        0 => String::new(),
        errors => format!(", {errors} have an error"),
    };
    format!("{word}: {shares}{runs}{errors}.")
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

fn shares(result: &SweepResult) -> String {
    let mut table = HtmlTable::new(
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

fn failures(result: &SweepResult) -> String {
    let rows = result.failures();
    if rows.is_empty() {
        return paragraph("All runs pass.");
    }
    let mut table = HtmlTable::new("point | verdict | why and command", 2);
    for row in rows.iter().take(LISTED) {
        let why = row.row.reason();
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
    let mut terms = Reproduction::default();
    terms.code("scenario", &result.file);
    terms.code("specification", &result.spec);
    for (key, value) in &result.settings {
        terms.code("set in all runs", &format!("{key} = {value}"));
    }
    let design = &result.design;
    terms.code(
        "design",
        &format!("{}, seed {}", design.kind.word(), design.seed),
    );
    terms.code(
        "hash of points and runs",
        result.hash.as_deref().unwrap_or("incomplete"),
    );
    terms.code("hash of the program", &result.build);
    terms.section()
}

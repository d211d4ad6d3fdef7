//! Tables of a study of load filters for the terminal.

use std::path::PathBuf;

use twinrig_report::number::si;
use twinrig_study::{EstimateStudy, FilterRow, Verdict};

use twinrig_report::summary::Summary;
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_report::text::style::{DIM, GREEN, YELLOW};

/// Formats the results of a study and the names of its files.
pub fn text(study: &EstimateStudy, files: &[PathBuf]) -> String {
    let mut text = Summary::new(&study.scenario, "study of load filters", study.headline());
    text.grid("the thesis and here", &thesis(study));
    text.grid("piezoelectric cell", &coefficients(study));
    text.grid("validation", &validation(study));
    text.grid("tuning", &tuning(study));
    let settings = study.settings();
    text.section("tuned filters", settings.lines().map(str::to_owned));
    let cut: Vec<&str> = study.cut().collect();
    if !cut.is_empty() {
        let searches = format!(
            "searches of {} by a budget of {} s",
            cut.join(", "),
            study.budget_s
        );
        text.fact("truncated", searches);
    }
    text.left_out(&study.left_out);
    text.finish(files)
}

fn thesis(study: &EstimateStudy) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left, Left]);
    grid.header("quantity | printed | | ours");
    for figure in study.printed() {
        let style = match figure.verdict {
            Verdict::Holds => GREEN,
            Verdict::Differs => YELLOW,
            Verdict::Unknown => DIM,
        };
        grid.row([
            figure.what.into(),
            figure.printed.into(),
            Cell::new(figure.verdict.word(), style),
            figure.ours.into(),
        ]);
    }
    grid
}

fn coefficients(study: &EstimateStudy) -> Grid {
    let found = &study.identification;
    let mut grid = Grid::new(&[Right, Right, Right, Right]);
    grid.header("frequency | a [V·s/N] | b [V·s²/N] | R²");
    for (hz, plane) in found.frequencies.iter().zip(&found.coefficients.runs) {
        let [a, b, _] = plane.model;
        grid.row([
            format!("{hz} Hz").into(),
            format!("{a:.6}").into(),
            format!("{b:.7}").into(),
            format!("{:.6}", plane.r_squared).into(),
        ]);
    }
    let amplifier = &found.amplifier.model.amplifier;
    grid.row([
        "amplifier".into(),
        format!("k {:.6}", amplifier.sensitivity).into(),
        format!(
            "{}, {}",
            si(amplifier.feedback_s, "s"),
            si(amplifier.lag_s, "s")
        )
        .into(),
        format!("{:.6}", found.amplifier.r_squared).into(),
    ]);
    grid
}

fn validation(study: &EstimateStudy) -> Grid {
    let mut sides = [Right; 10];
    sides[0] = Left;
    let mut grid = Grid::new(&sides);
    grid.header(
        "filter | | force: RMS | rate: RMS | maxima | minima | σ at maxima | at minima | NIS | NEES",
    );
    let mut before = "";
    for row in &study.rows {
        let name = if row.filter == before { "" } else { row.filter };
        before = row.filter;
        grid.row(cells(name, row));
    }
    grid
}

fn cells(name: &str, row: &FilterRow) -> [Cell; 10] {
    // Means outside of their band are marked.
    let marked = |value: f64, band: [f64; 2]| {
        let inside = (band[0]..=band[1]).contains(&value);
        Cell::new(format!("{value:.3}"), if inside { GREEN } else { YELLOW })
    };
    let hz = row
        .hz
        .map_or_else(|| "all".to_owned(), |hz| format!("{hz} Hz"));
    [
        name.into(),
        hz.into(),
        si(row.force_rmse_n, "N").into(),
        si(row.rate_rmse_n_s, "N/s").into(),
        format!("{:.3}", row.maxima).into(),
        si(row.minima_n, "N").into(),
        si(row.deviation_at_maxima_n, "N").into(),
        si(row.deviation_at_minima_n, "N").into(),
        marked(row.nis, row.nis_band),
        marked(row.nees, row.nees_band),
    ]
}

fn tuning(study: &EstimateStudy) -> Grid {
    let mut grid = Grid::new(&[Left, Right, Right, Right, Left]);
    grid.header("filter | −ln O before | tuned | evaluations | ");
    for filter in &study.filters {
        let kind = filter.kind;
        let [before, tuned] = filter.cost.map(|cost| format!("{cost:.3}"));
        grid.row([
            kind.name().into(),
            before.into(),
            tuned.into(),
            filter.evaluations.to_string().into(),
            Cell::new(kind.about(), DIM),
        ]);
    }
    grid
}

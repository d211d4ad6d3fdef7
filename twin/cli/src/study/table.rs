//! Tables of a study for the terminal.

use std::path::PathBuf;

use anstyle::Style;
use twinrig_report::number::si;
use twinrig_rig::Scales;
use twinrig_study::{
    ErrorControlTrend, Factor, Row, RowKind, Series, Status, StiffnessTrend, Study, StudyKind,
};

use crate::study::lines::{contact, difference, differing, ensemble, tolerance_slope, walking};
use twinrig_report::summary::Summary;
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_report::text::style::{DIM, RED, YELLOW};

/// Step at which methods are compared.
const USUAL_STEP_S: f64 = 2e-3;

/// Formats the results of a study and the names of its files.
pub fn text(study: &Study, files: &[PathBuf]) -> String {
    let kind = format!("study of {}", study.kind.name());
    let mut text = Summary::new(&study.scenario, &kind, study.headline());
    let grid = match study.kind {
        StudyKind::Precision => precision(study),
        StudyKind::Stability => stability(study),
    };
    text.block(grid.lines(2));
    for note in &study.references {
        text.fact("reference", reference(note));
    }
    let models = || study.rows.iter().filter(|row| row.kind == RowKind::Model);
    let base = models().find_map(|row| row.against.as_ref());
    // The page has the differences of all pairs.
    for row in models().filter(|row| row.against.as_ref() == base || row.varies_compliance()) {
        text.fact("model", difference(row));
    }
    for slope in study.tolerance_slopes() {
        text.fact("slope", tolerance_slope(&slope));
    }
    for one in &study.transports {
        text.fact("walking", walking(one));
    }
    for one in &study.contacts {
        text.fact("contact", contact(one));
    }
    for one in &study.ensembles {
        text.fact("ensemble", ensemble(one));
    }
    for [first, second, quantities] in differing(study) {
        text.fact("differ", format!("{first} and {second} in {quantities}"));
    }
    for trend in study.stiffnesses() {
        text.fact("stiffness", stiffness(&trend));
    }
    for line in limits(study) {
        text.fact("limits", line);
    }
    for trend in study.error_control_trends() {
        text.fact("compliant", error_control(&trend));
    }
    let cut = study.cut().count();
    if cut > 0 {
        let plural = if cut == 1 { "row was" } else { "rows were" };
        text.fact(
            "truncated",
            format!(
                "{cut} {plural} too slow for a budget of {} s",
                study.budget_s
            ),
        );
    }
    for row in study.rows.iter().filter(|row| row.contradicts) {
        text.fact("doubtful", doubtful(row));
    }
    text.left_out(&study.left_out);
    text.finish(files)
}

/// Returns a number to three digits: a multiple of a tolerance has others.
fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Formats what a factor does to a method with error control.
fn error_control(trend: &ErrorControlTrend) -> String {
    let times = if trend.is_multiple { "× " } else { "" };
    let [completed, of] = trend.runs;
    let values = trend
        .completed
        .map_or(String::new(), |[from, to]| format!(" {times}{from} … {to}"));
    let mut parts = vec![
        format!("{} {}: {}{values}", trend.plant, trend.method, trend.factor),
        format!("{completed} of {of} completed"),
    ];
    let rates = trend.evaluations_per_s;
    parts.extend(rates.map(|[least, most]| format!("{least:.0} … {most:.0} evaluations a second")));
    let substep = trend.least_substep_s;
    parts.extend(substep.map(|substep| format!("substeps ≥ {}", si(substep, "s"))));
    let error = trend.error_rms_m;
    parts.extend(error.map(|error| format!("RMS ≤ {}", si(error, "m"))));
    let failures = trend.failures.iter();
    let failures = failures.map(|(value, why)| format!("; {times}{value} {why}"));
    parts.join(", ") + &failures.collect::<String>()
}

/// Row that contradicts its neighbours.
fn doubtful(row: &Row) -> String {
    let what = match row.kind {
        RowKind::Limit => format!("{} with segments × {:e}", row.plant, row.scales.mass),
        RowKind::Stability => {
            let changed = Factor::ALL.iter().find_map(|factor| {
                let value = factor
                    .of(&row.scales)
                    .filter(|_| row.scales != Scales::AS_IS)?;
                Some(format!(" with {}", factor.label(value)))
            });
            format!("{}{}", row.series().name(), changed.unwrap_or_default())
        }
        _ => format!("{} {}", row.series().name(), setting(row)),
    };
    let result = match row.kind {
        RowKind::Stability => row
            .largest_stable_step_s
            .map(|step| format!(": stable to {}", si(step, "s")))
            .or_else(|| {
                row.evaluations
                    .map(|count| format!(": {count} evaluations"))
            }),
        _ => row.error_rms_m.map(|error| format!(": {}", si(error, "m"))),
    };
    format!(
        "{what}{}, {}",
        result.unwrap_or_default(),
        row.why.as_deref().unwrap_or_default()
    )
}

/// Whether the springs set a limit.
fn stiffness(trend: &StiffnessTrend) -> String {
    let way = format!("{} {}", trend.plant, trend.method);
    if let Some([from, to]) = trend.same_over {
        return format!("{way}: the limit is the same from {from} to {to} × the stiffness");
    }
    match (trend.depends, trend.exponent, trend.unlimited) {
        (Some(true), ..) if trend.is_power == Some(false) => {
            format!("{way}: the limit depends on stiffness, by no single power")
        }
        (Some(true), Some(exponent), _) => {
            format!("{way}: the limit goes as stiffness to the power {exponent:.2}")
        }
        (Some(false), Some(exponent), _) => {
            format!("{way}: the limit does not depend on stiffness (power {exponent:.2})")
        }
        (_, _, 0) => format!("{way}: too few limits to compare"),
        (_, _, unlimited) => {
            format!(
                "{way}: stable to the longest step at {unlimited} stiffnesses, too few limits to compare"
            )
        }
    }
}

/// Formats the largest stable steps of each method in a study of one factor.
fn limits(study: &Study) -> Vec<String> {
    let varied = |factor: &Factor| {
        let changed = |row: &Row| row.scales != Scales::AS_IS && factor.of(&row.scales).is_some();
        study.rows.iter().any(changed)
    };
    let mut factors = Factor::ALL.into_iter().filter(varied);
    let (StudyKind::Stability, Some(factor), None) = (study.kind, factors.next(), factors.next())
    else {
        return Vec::new();
    };
    let series = study.series().into_iter().filter(|key| !key.is_adaptive());
    let line = |key: Series<'_>| {
        let rows = study.rows.iter().filter(|row| row.series() == key);
        let limits = rows.filter_map(|row| {
            let value = factor.of(&row.scales)?;
            let bound = row.least_unstable_step_s.map_or("≥ ", |_| "");
            let limit = row.largest_stable_step_s.map_or_else(
                || "none".to_owned(),
                |step| format!("{bound}{}", si(step, "s")),
            );
            Some(format!("{value}: {limit}"))
        });
        let limits: Vec<String> = limits.collect();
        (!limits.is_empty())
            .then(|| format!("{}: {}, {}", key.name(), factor.name(), limits.join(", ")))
    };
    series.filter_map(line).collect()
}

fn reference(note: &twinrig_study::ReferenceNote) -> String {
    let setting = |step: Option<f64>, tolerance: Option<f64>| match (step, tolerance) {
        (Some(step), _) => si(step, "s"),
        (None, Some(tolerance)) => format!("at {:e}", rounded(tolerance)),
        (None, None) => String::new(),
    };
    let own = match (&note.method, &note.why) {
        (Some(method), _) => format!("{method} {}", setting(note.step_s, note.tolerance)),
        (None, Some(why)) => format!("none: {why}"),
        (None, None) => "none".to_owned(),
    };
    let check = note.check.as_ref().map_or(String::new(), |check| {
        format!(
            ", {} from {} {}",
            si(check.disagreement_rms_m, "m"),
            check.method,
            setting(check.step_s, check.tolerance)
        )
    });
    let of = note
        .of_plant
        .as_ref()
        .map_or(String::new(), |plant| format!("{plant} "));
    format!("{}: {of}{own}{check}", note.plant)
}

fn precision(study: &Study) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Right, Right, Right, Right, Left, Left]);
    grid.header(
        "plant | method | order | RMS at 2 ms | × real time | best RMS | step / tolerance |",
    );
    let orders = study.orders();
    for line in study.series() {
        let rows: Vec<&Row> = study
            .rows
            .iter()
            .filter(|row| row.kind == RowKind::Integration && row.series() == line)
            .collect();
        let sound = || rows.iter().filter(|row| row.status == Status::Ok);
        let usual = sound().find(|row| row.step_s == Some(USUAL_STEP_S));
        let best = sound()
            .filter(|row| row.error_rms_m.is_some())
            .min_by(|a, b| {
                a.error_rms_m
                    .unwrap_or(f64::INFINITY)
                    .total_cmp(&b.error_rms_m.unwrap_or(f64::INFINITY))
            });
        let order = orders
            .iter()
            .find(|order| order.plant == *line.plant && order.method == line.method)
            .filter(|_| !line.is_adaptive());
        let metres = |row: &Row| {
            let error = row.error_rms_m.map(|error| {
                if row.at_floor {
                    format!("≤ {}", si(study.floor_of(&row.plant), "m"))
                } else {
                    si(error, "m")
                }
            });
            error.unwrap_or_default()
        };
        let cut = rows.iter().filter(|row| row.cut).count();
        let failed = rows.len() - sound().count() - cut;
        grid.row([
            line.plant.label().into(),
            line.method_label().into(),
            order
                .map_or(String::new(), |order| format!("{:.1}", order.order))
                .into(),
            usual.map_or(String::new(), |row| metres(row)).into(),
            usual
                .and_then(|row| row.real_time_factor)
                .map_or(String::new(), |factor| format!("{factor:.0}"))
                .into(),
            best.map_or(String::new(), |row| metres(row)).into(),
            best.map_or(String::new(), |row| setting(row)).into(),
            match (failed, cut) {
                (0, 0) => "".into(),
                // What was cut for the budget did nothing wrong.
                (0, cut) => Cell::new(format!("{cut} of {} truncated", rows.len()), DIM),
                (failed, 0) => Cell::new(format!("{failed} of {} failed", rows.len()), RED),
                (failed, cut) => Cell::new(
                    format!("{failed} of {} failed, {cut} truncated", rows.len()),
                    RED,
                ),
            },
        ]);
    }
    grid
}

fn setting(row: &Row) -> String {
    match (row.step_s, row.tolerance) {
        (Some(step), _) => si(step, "s"),
        (None, Some(tolerance)) => format!("{tolerance:e}"),
        (None, None) => String::new(),
    }
}

fn stability(study: &Study) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Right, Right, Right, Left]);
    grid.header("plant | method | largest stable step | RMS there | time per step |");
    for row in study.rows.iter().filter(|row| row.scales == Scales::AS_IS) {
        let bound = if row.least_unstable_step_s.is_none() {
            "≥ "
        } else {
            ""
        };
        let limit = match (row.largest_stable_step_s, row.tolerance) {
            (Some(step), _) => format!("{bound}{}", si(step, "s")),
            (None, Some(_)) => "adaptive".to_owned(),
            (None, None) => String::new(),
        };
        let (word, style) = match row.status {
            Status::Ok if row.wrong => ("stable, but wrong", YELLOW),
            Status::Ok => ("", Style::new()),
            _ if row.cut => (row.word(), DIM),
            _ => (row.word(), RED),
        };
        grid.row([
            row.plant.label().into(),
            row.series().method_label().into(),
            limit.into(),
            row.error_rms_m
                .map_or(String::new(), |error| si(error, "m"))
                .into(),
            row.cost_per_step_s
                .map_or(String::new(), |cost| si(cost, "s"))
                .into(),
            Cell::new(word, style),
        ]);
    }
    grid
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use twinrig_kernel::SimDuration;
    use twinrig_rig::PlantId;
    use twinrig_study::{PrecisionPlan, precision};

    use super::*;
    use crate::study::builder::StudyBuilder;
    use twinrig_rig::registry::Registry;

    #[test]
    fn error_at_the_floor_is_shown_as_the_floor() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/passive-legs.toml");
        let registry = Registry::standard();
        let duration = Some(SimDuration::from_millis(10));
        let builder = StudyBuilder::new(&registry, &path, &[], &[], duration).unwrap();
        let plan = PrecisionPlan {
            duration,
            steps: vec![SimDuration::from_millis(2)],
            tolerances: Vec::new(),
            masses: Vec::new(),
            ensemble: 0,
            repetitions: 1,
            budget_s: 1e9,
        };
        let mut study = precision(&builder, &plan, &mut ()).unwrap();
        assert!(!text(&study, &[]).contains('≤'));
        for row in &mut study.rows {
            row.at_floor = true;
        }
        let floor = si(
            study.floor_of(&PlantId::new("lcp").with_constraints("rigid")),
            "m",
        );
        assert!(text(&study, &[]).contains(&format!("≤ {floor}")));
    }
}

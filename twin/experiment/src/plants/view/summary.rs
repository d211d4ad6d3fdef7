//! Summary of a study of precision or stability.

use twinrig_report::number::si;
use twinrig_report::summary::Summary;
use twinrig_rig::Scales;

use super::lines::{contact, difference, differing, ensemble, tolerance_slope, walking};
use super::{precision, stability};
use crate::plants::error_control::ErrorControlTrend;
use crate::plants::factor::Factor;
use crate::plants::reference_note::ReferenceNote;
use crate::plants::row::{Row, RowKind, Series};
use crate::plants::stiffness::StiffnessTrend;
use crate::plants::study::{Study, StudyKind};

impl Study {
    /// Returns the summary.
    pub fn summary(&self) -> Summary {
        let kind = format!("study of {}", self.kind.name());
        let mut summary = Summary::new(&self.scenario, &kind, self.headline());
        let table = match self.kind {
            StudyKind::Precision => precision::summary(self),
            StudyKind::Stability => stability::as_it_is(self),
        };
        summary.block(table.grid().lines(2));
        for (name, text) in facts(self) {
            summary.fact(name, text);
        }
        self.starts.note(&mut summary);
        summary.left_out(&self.left_out);
        summary
    }
}

/// Returns the facts after the table, each with its name.
fn facts(study: &Study) -> Vec<(&'static str, String)> {
    let mut facts = Vec::new();
    let references = study.references.iter().map(reference);
    facts.extend(references.map(|text| ("reference", text)));
    let models = || study.rows.iter().filter(|row| row.kind == RowKind::Model);
    let base = models().find_map(|row| row.against.as_ref());
    // The page has the differences of all pairs.
    let shown = models().filter(|row| row.against.as_ref() == base || row.varies_compliance());
    facts.extend(shown.map(|row| ("model", difference(row))));
    let slopes = study.tolerance_slopes();
    facts.extend(slopes.iter().map(|one| ("slope", tolerance_slope(one))));
    facts.extend(study.transports.iter().map(|one| ("walking", walking(one))));
    facts.extend(study.contacts.iter().map(|one| ("contact", contact(one))));
    facts.extend(
        study
            .ensembles
            .iter()
            .map(|one| ("ensemble", ensemble(one))),
    );
    for [first, second, quantities] in differing(study) {
        facts.push(("differ", format!("{first} and {second} in {quantities}")));
    }
    let trends = study.stiffnesses();
    facts.extend(trends.iter().map(|trend| ("stiffness", stiffness(trend))));
    facts.extend(limits(study).into_iter().map(|line| ("limits", line)));
    let trends = study.error_control_trends();
    facts.extend(
        trends
            .iter()
            .map(|trend| ("compliant", error_control(trend))),
    );
    let cut = study.cut().count();
    if cut > 0 {
        let plural = if cut == 1 { "row was" } else { "rows were" };
        let budget_s = study.budget_s;
        let text = format!("{cut} {plural} too slow for a budget of {budget_s} s");
        facts.push(("truncated", text));
    }
    let contradicting = study.rows.iter().filter(|row| row.contradicts);
    facts.extend(contradicting.map(|row| ("doubtful", doubtful(row))));
    facts
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

fn reference(note: &ReferenceNote) -> String {
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

fn setting(row: &Row) -> String {
    match (row.step_s, row.tolerance) {
        (Some(step), _) => si(step, "s"),
        (None, Some(tolerance)) => format!("{tolerance:e}"),
        (None, None) => String::new(),
    }
}

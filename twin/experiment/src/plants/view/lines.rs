//! Lines of a study of precision on models, tolerances and walks.

use twinrig_report::number::si;

use crate::plants::contact::ContactResiduals;
use crate::plants::ensemble::Ensemble;
use crate::plants::row::{Row, Status};
use crate::plants::study::Study;
use crate::plants::tolerance::ToleranceSlope;
use crate::plants::transport::Transport;

/// Formats the difference between two models.
pub(super) fn difference(row: &Row) -> String {
    let models = format!(
        "{} against {}",
        row.model(),
        row.against.as_deref().unwrap_or_default()
    );
    let length = |name, value: Option<f64>| {
        value.map_or(String::new(), |value| {
            format!(", {name} {}", si(value, "m"))
        })
    };
    match (row.status, row.compared_s) {
        (Status::Ok, Some(until_s)) => format!(
            "{models}: feet {}{}{}, RMS over {}",
            si(row.error_rms_m.unwrap_or_default(), "m"),
            length("trunk", row.trunk_error_rms_m),
            length("worst foot to hip", row.foot_to_hip_error_rms_m),
            si(until_s, "s")
        ),
        _ => format!("{models}: {}", row.why.as_deref().unwrap_or_default()),
    }
}

/// Formats the slope of log error over log tolerance.
pub(super) fn tolerance_slope(slope: &ToleranceSlope) -> String {
    let part = |name, slope: Option<f64>| {
        slope.map_or(String::new(), |slope| format!(", {name} {slope:.2}"))
    };
    let [from, to] = slope.range;
    format!(
        "{} {}: log error over log tolerance from {to:e} to {from:e}: feet {:.2}{}{}",
        slope.plant,
        slope.method,
        slope.feet,
        part("trunk", slope.trunk),
        part("worst foot to hip", slope.foot_to_hip),
    )
}

/// Formats the means of an ensemble with their intervals.
pub(super) fn ensemble(one: &Ensemble) -> String {
    let setting = match (one.key.step_s, one.key.tolerance) {
        (Some(step), _) => si(step, "s"),
        (None, tolerance) => format!("at {:e}", tolerance.unwrap_or_default()),
    };
    let walks = format!(
        "{} {} {setting}: {} walks",
        one.key.plant, one.key.method, one.completed
    );
    let mut parts = vec![walks];
    if one.fell + one.failed > 0 {
        parts.push(format!("{} fell, {} failed", one.fell, one.failed));
    }
    parts.extend(one.quantities.iter().map(|quantity| {
        let (mean, half) = quantity.rounded();
        format!("{} {mean} ± {half}", quantity.quantity)
    }));
    parts.extend(one.why.clone());
    parts.join(", ")
}

/// Returns the pairs of models that differ, each with the quantities.
pub(super) fn differing(study: &Study) -> Vec<[String; 3]> {
    let mut pairs: Vec<[String; 3]> = Vec::new();
    for one in study.ensemble_differences() {
        let [first, second] = one.models;
        match pairs
            .iter_mut()
            .find(|[a, b, _]| *a == first && *b == second)
        {
            Some([_, _, quantities]) => quantities.extend([", ", &one.quantity]),
            None => pairs.push([first, second, one.quantity]),
        }
    }
    pairs
}

/// Formats the contact of a plant's feet at rest and in the gait.
pub(super) fn contact(one: &ContactResiduals) -> String {
    let setting = match (one.key.step_s, one.key.tolerance) {
        (Some(step), _) => si(step, "s"),
        (None, tolerance) => format!("at {:e}", tolerance.unwrap_or_default()),
    };
    let mut parts = Vec::new();
    if let Some(rest) = &one.rest {
        let expected = rest.expected_m.map_or(String::new(), |expected| {
            format!(" (load/k {})", si(expected, "m"))
        });
        parts.push(format!(
            "{} deep at rest{expected}",
            si(rest.penetration_m, "m")
        ));
    }
    if let Some(gait) = &one.gait {
        parts.push(format!("gap × load {}", si(gait.signorini_j, "J")));
        parts.extend(
            gait.coulomb_n
                .map(|excess| format!("{} beyond the cone", si(excess, "N"))),
        );
        parts.push(format!(
            "{} created, {} dissipated",
            si(gait.created_j, "J"),
            si(gait.dissipated_j, "J")
        ));
    }
    parts.extend(one.why.clone());
    format!(
        "{} {} {setting}: {}",
        one.key.plant,
        one.key.method,
        parts.join(", ")
    )
}

/// Formats the cost of a walk, or the reason of its absence.
pub(super) fn walking(one: &Transport) -> String {
    let setting = match (one.key.step_s, one.key.tolerance) {
        (Some(step), _) => si(step, "s"),
        (None, tolerance) => format!("at {:e}", tolerance.unwrap_or_default()),
    };
    let way = format!("{} {} {setting}", one.key.plant, one.key.method);
    let way = match one.converged {
        Some(true) => format!("{way}, converged"),
        Some(false) => format!("{way}, not converged"),
        None => way,
    };
    let why = one
        .why
        .as_ref()
        .map_or(String::new(), |why| format!(", {why}"));
    let Some(cost) = &one.cost else {
        return format!("{way}{why}");
    };
    let transport = cost.cost_of_transport.map_or(String::new(), |cost| {
        format!(", cost of transport {cost:.3}")
    });
    let open = if cost.residual_j < 0.0 {
        "lost"
    } else {
        "created"
    };
    format!(
        "{way}: {:.3} m/s{transport}, {} of {} {open}{why}",
        cost.speed_m_s,
        si(cost.residual_j.abs(), "J"),
        si(cost.work_j, "J"),
    )
}

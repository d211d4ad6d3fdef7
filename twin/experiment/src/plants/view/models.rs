//! Page section on modelling errors.

use twinrig_report::html::plot::{Curve, EndedRun, Look, Plot, Point, Setting};
use twinrig_report::number::{plain, power, si};
use twinrig_report::page::Block;

use super::error_axis::LEAST_M;
use super::{differences, figure};
use crate::plants::row::{Row, RowKind, Status};
use crate::plants::study::Study;

/// Returns the section: differences between models, apart from the errors of methods.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    let of = |kind| study.rows.iter().filter(move |row| row.kind == kind);
    if of(RowKind::Model).next().is_none() && of(RowKind::Limit).next().is_none() {
        return Vec::new();
    }
    let introduction = "Different models have different motions, however accurately both are integrated. The \
         difference is that between the references of two plants; it does not decrease with the \
         step and is not part of the curves above.";
    let mut out = vec![
        Block::heading("Modelling errors"),
        Block::text(introduction),
    ];
    out.extend(differences::tables(study));
    let limits: Vec<&Row> = of(RowKind::Limit).collect();
    if limits.is_empty() {
        return out;
    }
    let point = |row: &&Row| {
        let error = row.error_rms_m.filter(|_| row.status == Status::Ok)?;
        Some(Point {
            x: row.scales.mass,
            y: error.max(LEAST_M),
            title: format!("segments × {}: {}", row.scales.mass, si(error, "m")),
            look: match (row.contradicts, row.at_floor) {
                (true, _) => Look::Doubtful,
                (false, true) => Look::Hollow,
                (false, false) => Look::Plain,
            },
        })
    };
    let ended = |row: &&Row| {
        let why = row.why.clone().unwrap_or_default();
        EndedRun {
            x: row.scales.mass,
            title: format!("segments × {}: {why}", power(row.scales.mass, 2)),
            cut: row.cut,
        }
    };
    let settings = limits
        .iter()
        .map(|row| Setting::of(point(row), || Some(ended(row))));
    let plot = Plot {
        title: "difference of the models over mass of the segments".to_owned(),
        width: 1080.0,
        height: 380.0,
        x_label: "mass of the legs' segments, as a share of the robot's".to_owned(),
        y_label: "feet, RMS  [m]".to_owned(),
        curves: vec![Curve::through(0, false, settings)],
        marks: Vec::new(),
        shared_y: Vec::new(),
        strip: "failed".to_owned(),
    };
    let mut reasons: Vec<String> = Vec::new();
    for row in limits.iter().filter(|row| row.status != Status::Ok) {
        let why = row.why.clone().unwrap_or_default();
        reasons.push(format!("× {}: {why}.", plain(row.scales.mass)));
    }
    let failed = if reasons.is_empty() {
        String::new()
    } else {
        format!(" Failed: {}", reasons.join(" "))
    };
    let caption = "As the masses of the segments vanish, feet excepted, the two models become \
                   identical: the difference is the effect of the segment masses. In both \
                   models, a foot has its own mass here. Hollow: within the uncertainty of the \
                   references.";
    let caption = format!("{caption}{failed}");
    let heading = "Limit of vanishing segment masses";
    out.push(Block::Figure(figure(heading, Vec::new(), &plot, caption)));
    out
}

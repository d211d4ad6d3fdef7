//! Tables of a study of coupling for the terminal.

use std::path::PathBuf;

use twinrig_report::number::si;
use twinrig_study::{CouplingKind, CouplingMethod, CouplingRow, CouplingStudy, Status};

use twinrig_report::summary::Summary;
use twinrig_report::text::grid::{Cell, Grid, Left, Right};
use twinrig_report::text::style::{DIM, RED, YELLOW};

/// Row that contradicts its neighbours.
fn doubtful(row: &CouplingRow) -> String {
    let (method, step) = (row.method.word(), si(row.step_s, "s"));
    let error = row.error_rms_m;
    let error = error.map_or(String::new(), |error| format!(": {}", si(error, "m")));
    let why = row.why.as_deref().unwrap_or_default();
    format!("{} {method} {step}{error}, {why}", row.plant)
}

/// Formats the results of a study and the names of its files.
pub fn text(study: &CouplingStudy, files: &[PathBuf]) -> String {
    let mut text = Summary::new(&study.scenario, "study of coupling", study.headline());
    for plant in study.plants() {
        text.grid(plant, &table(study, plant));
    }
    for order in study.orders() {
        let (plant, method) = (&order.plant, order.method.word());
        let points = order.points;
        text.fact(
            "order",
            format!(
                "{plant} {method}: {:.1}, coupling alone, of {points} steps",
                order.order
            ),
        );
    }
    for note in &study.references {
        let why = note.why.clone().unwrap_or_default();
        let apart = note.check.as_ref().map_or_else(String::new, |check| {
            format!("{} from its check; ", si(check.disagreement_rms_m, "m"))
        });
        let step = note
            .step_s
            .map_or_else(String::new, |step| format!("exact at {}, ", si(step, "s")));
        text.fact("reference", format!("{}: {step}{apart}{why}", note.plant));
    }
    let cut = study.cut().count();
    if cut > 0 {
        text.fact(
            "truncated",
            format!(
                "{cut} runs were too slow for a budget of {} s",
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

/// Formats a line per step: exact coupling and grids.
fn table(study: &CouplingStudy, plant: &str) -> Grid {
    let mut sides = [Right; 11];
    sides[10] = Left;
    let mut grid = Grid::new(&sides);
    let columns = CouplingMethod::ALL.map(|method| {
        let method = method.word();
        format!("| {method}: RMS | steps/s | × real time ")
    });
    grid.header(&format!("step {}|", columns.concat()));
    let of = |method| study.series(CouplingKind::Together, plant, method);
    for first in of(CouplingMethod::Exact) {
        let mut changed = 0;
        let [exact, mean, held] = CouplingMethod::ALL.map(|method| {
            let row = of(method).find(|row| row.step_s == first.step_s);
            changed += row
                .and_then(|row| row.counters_changed.as_ref())
                .map_or(0, Vec::len);
            row.map_or_else(|| [(); 3].map(|()| "".into()), three)
        });
        let ([a, b, c], [d, e, f], [g, h, i]) = (exact, mean, held);
        let note = match changed {
            0 => "".into(),
            count => Cell::new(format!("{count} counters differ"), YELLOW),
        };
        let step = si(first.step_s, "s").into();
        grid.row([step, a, b, c, d, e, f, g, h, i, note]);
    }
    grid
}

fn three(row: &CouplingRow) -> [Cell; 3] {
    let error = match (row.status, row.error_rms_m) {
        (Status::Ok, Some(error)) => si(error, "m").into(),
        (Status::Ok, None) => "".into(),
        _ if row.cut => Cell::new(row.word(), DIM),
        _ => Cell::new(row.word(), RED),
    };
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.0}"));
    let speed = row
        .real_time_factor
        .map_or_else(String::new, |factor| format!("{factor:.1}"));
    [
        error,
        number(row.steps_per_simulated_s).into(),
        speed.into(),
    ]
}

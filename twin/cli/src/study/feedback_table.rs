//! Tables of a study of load feedback for the terminal.

use std::path::PathBuf;

use twinrig_study::{FeedbackResult, FeedbackStudy};

use twinrig_report::summary::Summary;
use twinrig_report::text::grid::{Cell, Grid, Left, Right, Side};

/// Formats the results of a study and the names of its files.
pub fn text(study: &FeedbackStudy, files: &[PathBuf]) -> String {
    let mut text = Summary::new(
        &study.input.name,
        "study of load feedback",
        study.headline(),
    );
    text.grid("gaits", &gaits(study));
    text.grid("load that the controller takes", &loads(study));
    let name = format!(
        "displacement of footsteps per change of {} (R²)",
        study.variable
    );
    text.grid(&name, &displacements(study));
    for result in &study.cases {
        if let Some(why) = &result.why {
            text.fact("no result", format!("{}: {why}", result.label()));
        }
        if let Some(why) = &result.undisplaced {
            text.fact("undisplaced", format!("{}: {why}", result.label()));
        }
    }
    text.left_out(&study.input.left_out);
    text.finish(files)
}

fn number(value: Option<f64>, digits: usize) -> Cell {
    let text = value.map_or(String::new(), |value| format!("{value:.digits$}"));
    text.replace('-', "−").into()
}

fn words(result: &FeedbackResult) -> [Cell; 2] {
    [&*result.case.plant, &*result.case.source].map(Cell::from)
}

fn gaits(study: &FeedbackStudy) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Right, Right, Right, Right, Right, Left]);
    grid.header("plant | loads | m/s | duty, fore | hind | phases off | commands differ after | ");
    for (index, result) in study.cases.iter().enumerate() {
        let reference = study.is_reference(index);
        let other = |text: Option<String>| -> Cell {
            let text = text.filter(|_| !reference);
            text.map_or_else(Cell::default, Cell::from)
        };
        let differs = match result.differs_after_s {
            Some(at_s) => format!("{at_s:.3} s"),
            None if result.why.is_some() => String::new(),
            None => "never: void".to_owned(),
        };
        let fell = result.fell_at_s.map(|at_s| format!("fell at {at_s:.1} s"));
        let rest = [
            number(result.speed_m_s, 3),
            number(result.duty[0], 3),
            number(result.duty[1], 3),
            other(result.phases_rad.map(|it| format!("{it:.3} rad"))),
            other(Some(differs)),
            fell.unwrap_or_default().into(),
        ];
        grid.row(words(result).into_iter().chain(rest));
    }
    grid
}

fn loads(study: &FeedbackStudy) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left, Right, Right, Right]);
    grid.header("plant | loads | signal | error | delay | error without it");
    for result in &study.cases {
        let with = |value: Option<f64>, digits: usize, unit: &str| -> Cell {
            let text = value.map_or(String::new(), |value| format!("{value:.digits$} {unit}"));
            text.replace('-', "−").into()
        };
        let rest = [
            result.case.signal.clone().into(),
            with(result.error_n(), 2, "N"),
            with(result.delay_s().map(|it| 1e3 * it), 1, "ms"),
            with(result.rest_n(), 2, "N"),
        ];
        grid.row(words(result).into_iter().chain(rest));
    }
    grid
}

fn displacements(study: &FeedbackStudy) -> Grid {
    let steps = study.plan.modulation.steps;
    let mut sides: Vec<Side> = vec![Right; steps + 2];
    sides[..2].fill(Left);
    let mut grid = Grid::new(&sides);
    let head: Vec<String> = (1..=steps).map(|step| format!("step {step}")).collect();
    grid.header(&format!("plant | loads | {}", head.join(" | ")));
    for result in study.cases.iter().filter(|it| !it.steps.is_empty()) {
        let steps = result.steps.iter().map(|it| {
            let r_squared = it.r_squared.map(|it| format!(" ({it:.2})"));
            let text = format!("{:.2}{}", it.slope, r_squared.unwrap_or_default());
            Cell::from(text.replace('-', "−"))
        });
        grid.row(words(result).into_iter().chain(steps));
    }
    grid
}

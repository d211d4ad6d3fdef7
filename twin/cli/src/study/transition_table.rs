//! Tables of a study of gait transitions for the terminal.

use std::path::PathBuf;

use twinrig_study::{TransitionResult, TransitionStudy, Way};

use crate::study::layout::StudyText;
use twinrig_report::text::grid::{Cell, Grid, Left, Right};

/// Formats the results of a study and the names of its files.
pub fn text(study: &TransitionStudy, files: &[PathBuf]) -> String {
    let mut text = StudyText::new(
        &study.input.name,
        "study of gait transitions",
        study.headline(),
    );
    text.table("transitions", &transitions(study));
    if study.cases.iter().any(|it| !it.hysteresis.is_empty()) {
        text.table("values on both ways", &hysteresis(study));
    }
    text.table("time in each gait", &shares(study));
    text.table("cycles", &cycles(study));
    text.finish(&study.input.left_out, files)
}

fn transitions(study: &TransitionStudy) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left, Right, Right, Right, Left, Right]);
    grid.header("run | from | to | begins | established | value | way | feet slip");
    for result in &study.cases {
        for one in &result.transitions {
            let established = one.established_s;
            grid.row([
                study.label(result).into(),
                one.from.clone().into(),
                one.to.clone().into(),
                format!("{:.2} s", one.begin_s).into(),
                established
                    .map_or("never".to_owned(), |at_s| format!("{at_s:.2} s"))
                    .into(),
                study.value_text(one.value).into(),
                match one.way {
                    Way::Up => "up".into(),
                    Way::Down => "down".into(),
                },
                format!("{:.0} mm", 1e3 * one.slip_m).into(),
            ]);
        }
    }
    grid
}

fn hysteresis(study: &TransitionStudy) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left, Left]);
    grid.header("run | between | up | down");
    let values = |values: &[f64]| -> Cell {
        let texts: Vec<String> = values.iter().map(|it| study.value_text(*it)).collect();
        texts.join(", ").into()
    };
    for result in &study.cases {
        for pair in &result.hysteresis {
            grid.row([
                study.label(result).into(),
                pair.classes.join(", ").into(),
                values(&pair.up),
                values(&pair.down),
            ]);
        }
    }
    grid
}

fn shares(study: &TransitionStudy) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left]);
    grid.header("run | gaits | most slip in one second");
    for result in &study.cases {
        grid.row([
            study.label(result).into(),
            seconds(result).into(),
            result
                .worst_slip()
                .map_or(String::new(), |[at_s, slip]| {
                    format!("{:.0} mm at {at_s:.0} s", 1e3 * slip)
                })
                .into(),
        ]);
    }
    grid
}

fn cycles(study: &TransitionStudy) -> Grid {
    let mut grid = Grid::new(&[Left, Right, Right]);
    grid.header("run | contacts of a leg | class by oscillators the same");
    for result in &study.cases {
        let agreement = result.agreement();
        let contacts = result.contacts();
        grid.row([
            study.label(result).into(),
            contacts
                .map_or(String::new(), |it| format!("{it:.2}"))
                .into(),
            agreement
                .share()
                .map_or(String::new(), |share| {
                    format!("{:.1} % of {}", 100.0 * share, agreement.cycles)
                })
                .into(),
        ]);
    }
    grid
}

fn seconds(result: &TransitionResult) -> String {
    if let Some(why) = &result.why {
        return why.clone();
    }
    let shares = result.shares().into_iter();
    let shares = shares.map(|(class, seconds)| format!("{class} {seconds:.1} s"));
    let mut parts: Vec<String> = shares.collect();
    parts.extend(
        result
            .run
            .fell_at_s
            .map(|at_s| format!("fell at {at_s:.1} s")),
    );
    parts.join(", ")
}

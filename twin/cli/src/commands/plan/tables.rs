//! Tables of connections, signals and counters of a scene.

use anstyle::Style;

use super::contents::Plan;
use twinrig_kernel::signal::folded;
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::{DIM, YELLOW};

pub(super) fn wired(plan: &Plan) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left, Left]);
    let mut rows = Vec::new();
    for wire in &plan.wires {
        let row = [
            wire.from.clone(),
            folded(&wire.signal, &plan.legs),
            format!("[{}]", wire.unit),
            format!("→ {}", wire.to),
        ];
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    for [from, signal, unit, to] in rows {
        let dim = |text| Cell::new(text, DIM);
        grid.row([dim(from), signal.into(), dim(unit), dim(to)]);
    }
    grid
}

pub(super) fn undriven(plan: &Plan) -> Grid {
    let mut grid = Grid::new(&[Left, Left]);
    let mut rows = Vec::new();
    for free in &plan.free {
        let row = (
            folded(&free.name, &plan.legs),
            measure(free.unit, free.size),
        );
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    for (name, measure) in rows {
        grid.row([name.into(), Cell::new(measure, DIM)]);
    }
    grid
}

/// Returns the unit, and the size of a vector.
fn measure(unit: &str, size: usize) -> String {
    match size {
        1 => format!("[{unit}]"),
        size => format!("[{unit}] × {size}"),
    }
}

pub(super) fn signals(plan: &Plan) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left]);
    let mut rows = Vec::new();
    for signal in &plan.signals {
        let name = folded(&signal.name, &plan.legs);
        let row = (
            name,
            measure(signal.unit, signal.size),
            (signal.computed, signal.recorded),
        );
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    for (name, unit, computed_recorded) in rows {
        let (status, style) = match computed_recorded {
            (true, true) => ("recorded", Style::new()),
            (true, false) => ("computed, not recorded", YELLOW),
            (false, _) => ("not computed", DIM),
        };
        grid.row([name.into(), Cell::new(unit, DIM), Cell::new(status, style)]);
    }
    grid
}

pub(super) fn diagnostics(plan: &Plan) -> Grid {
    let mut grid = Grid::new(&[Left, Left]);
    let mut rows = Vec::new();
    for diagnostic in &plan.diagnostics {
        let row = (folded(&diagnostic.name, &plan.legs), diagnostic.unit);
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    for (name, unit) in rows {
        grid.row([name.into(), Cell::new(format!("[{unit}]"), DIM)]);
    }
    grid
}

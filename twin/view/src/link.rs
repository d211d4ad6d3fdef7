//! Links of tables to instants of a run, which move the slider.

use twinrig_report::table::Cell;

/// Keys of the addresses of instants, of the first and of the second run.
const KEYS: [&str; 2] = ["t", "b"];

/// Returns a cell with an instant of a run \[s\] that leads there; `run` is its index.
pub(crate) fn instant(run: usize, at: f64) -> Cell {
    let key = KEYS[run.min(1)];
    Cell::link(format!("{at:.3} s"), format!("#{key}={at}"))
}

/// Returns the name of a component as the plots have it: `body/position.z`.
pub(crate) fn component_name(signal: &str, components: usize, component: usize) -> String {
    let letters = match components {
        1 => return signal.to_owned(),
        3 => ["x", "y", "z", ""],
        4 => ["w", "x", "y", "z"],
        _ => return format!("{signal}.{component}"),
    };
    format!("{signal}.{}", letters[component.min(3)])
}

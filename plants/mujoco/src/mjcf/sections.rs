//! Sections of a model, and how lines are added to them.

/// Sections of a model.
#[derive(Default)]
pub(super) struct Sections {
    pub(super) assets: String,
    pub(super) world: String,
    pub(super) equalities: String,
    pub(super) tendons: String,
    pub(super) actuators: String,
}

/// Adds a line to a section.
macro_rules! line {
    ($section:expr, $($what:tt)*) => {
        // Writing to a string cannot fail.
        let _ = writeln!($section, $($what)*);
    };
}
pub(super) use line;

/// Returns the values of an attribute.
pub(super) fn triple(numbers: &[f64]) -> String {
    let texts: Vec<String> = numbers.iter().map(f64::to_string).collect();
    texts.join(" ")
}

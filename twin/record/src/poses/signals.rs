//! Signals in a sample of the plant, by their names.

use twinrig_kernel::{Layout, Unit};

/// Signals in a sample of the plant.
pub(super) struct Signals<'a> {
    pub(super) layout: &'a Layout,
    pub(super) keep: &'a dyn Fn(&str) -> bool,
}

impl Signals<'_> {
    /// Returns the offset of the signal `name` if it has `size` components.
    pub(super) fn start(&self, name: &str, size: usize) -> Option<usize> {
        let range = self.layout.find(name)?;
        (range.len() == size).then_some(range.start)
    }

    /// As [`Signals::start`], for recorded signals only.
    pub(super) fn recorded(&self, name: &str, size: usize) -> Option<usize> {
        self.start(name, size).filter(|_| (self.keep)(name))
    }

    /// Returns the names and offsets of the recorded signals with one component in `unit`.
    pub(super) fn of_unit(&self, unit: Unit) -> impl Iterator<Item = (&str, usize)> {
        let fields = self.layout.fields();
        let scalars = fields.filter(move |field| field.port.unit == unit && field.port.size == 1);
        let scalars = scalars.map(|field| (field.port.name.as_str(), field.range().start));
        scalars.filter(|(name, _)| (self.keep)(name))
    }
}

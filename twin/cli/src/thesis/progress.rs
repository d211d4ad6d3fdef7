//! Progress of the comparison.

use twinrig_experiment::ProgressObserver;

use crate::progress::Progress;
use crate::thesis::item::Item;
use twinrig_rig::run::interrupt;

/// Progress line of the items, which also shows the parts of the studies that they run.
pub(crate) struct ItemProgress<'i> {
    line: Progress,
    items: &'i [&'static Item],
    done: usize,
}

impl<'i> ItemProgress<'i> {
    pub(crate) fn new(items: &'i [&'static Item], line: Progress) -> Self {
        Self {
            line,
            items,
            done: 0,
        }
    }

    /// Shows that the item with this index begins.
    pub(crate) fn begin(&mut self, index: usize) {
        self.done = index;
        let title = self.items.get(index).map_or("", |item| item.title);
        self.show(title, 0.0);
    }

    /// Shows a description, when a share of the item is done.
    fn show(&mut self, doing: &str, share: f64) {
        let rest = self.items.get(self.done..).unwrap_or_default();
        let id = rest.first().map_or("", |item| item.id);
        let left = left_s(rest, share);
        let text = format!("{id}: {doing}, some {left:.0} s left");
        self.line.part(self.done, self.items.len(), &text);
    }
}

/// Returns the run time left if a share of the first item is done, by the declared run times \[s\].
fn left_s(rest: &[&Item], share: f64) -> f64 {
    let all: f64 = rest.iter().map(|item| item.run_s).sum();
    all - share * rest.first().map_or(0.0, |item| item.run_s)
}

impl ProgressObserver for ItemProgress<'_> {
    fn at(&mut self, part: usize, of: usize, doing: &str) -> bool {
        self.show(doing, part as f64 / of.max(1) as f64);
        !interrupt::is_requested()
    }
}

//! Runs of items.

use std::path::Path;

use twinrig_document::suggestion;
use twinrig_experiment::Machine;
use twinrig_scenario::Setting;

use crate::error::ThesisError;
use crate::error::TwinError;
use crate::progress::Progress;
use crate::thesis::context::Context;
use crate::thesis::item::Item;
use crate::thesis::items::items;
use crate::thesis::progress::ItemProgress;
use crate::thesis::record::recorded_flips;
use crate::thesis::result::{ItemResult, ThesisResult};
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;

/// Returns the item with an identifier.
///
/// # Errors
/// [`ThesisError::UnknownItem`] with similar identifiers.
pub(crate) fn find(id: &str) -> Result<&'static Item, ThesisError> {
    items().find(|item| item.id == id).ok_or_else(|| {
        let help = suggestion(id, "items", items().map(|item| item.id));
        ThesisError::UnknownItem {
            id: id.to_owned(),
            help: format!("{help} `twin thesis --list` has all"),
        }
    })
}

/// Runs items and compares them with the thesis.
///
/// # Errors
/// Errors of scenarios and studies; [`ThesisError::Interrupted`].
pub(crate) fn run(
    registry: &Registry,
    selected: &[&'static Item],
    scenarios: &Path,
    settings: Vec<Setting>,
    machine: &Machine,
    progress: Progress,
) -> Result<ThesisResult, TwinError> {
    let progress = ItemProgress::new(selected, progress);
    let context = Context::new(registry, scenarios, settings, progress);
    let mut results = Vec::new();
    let flips = recorded_flips().unwrap_or_default();
    for (done, item) in selected.iter().enumerate() {
        context.begin(done);
        let measured = (item.measure)(&context);
        if interrupt::is_requested() {
            let of = selected.len();
            return Err(ThesisError::Interrupted { done, of }.into());
        }
        let measured = measured?;
        if context.ignores_settings() {
            let id = item.id.to_owned();
            return Err(ThesisError::UnusedSetting { id }.into());
        }
        results.push(ItemResult::of(item, &measured).with_flips(&flips));
    }
    Ok(ThesisResult {
        cpu: machine.cpu.clone(),
        build: machine.build.clone(),
        items: results,
    })
}

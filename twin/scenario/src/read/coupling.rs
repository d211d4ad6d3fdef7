//! Reading `[plant] coupling`.

use twinrig_document::{Item, Reported};
use twinrig_kernel::SimDuration;

use twinrig_runtime::GridInputs;

use twinrig_runtime::Coupling;

const HELP: &str = "write \"exact\", or as in { grid = \"1 ms\" }";

/// Reads `coupling` of a plant with the observation period `observe`.
pub(super) fn coupling(item: &Item<'_>, observe: SimDuration) -> Result<Coupling, Reported> {
    if item.is_text() {
        if item.text()? == "grid" {
            return Err(item.report("a grid requires a step", HELP));
        }
        return item.choice(&[("exact", Coupling::Exact)]);
    }
    if !item.is_table() {
        let message = format!("`{}` is neither a text nor a table", item.key());
        return Err(item.report(message, HELP));
    }
    let table = item.table()?;
    let grid = table.required("grid", |item| grid(item, observe));
    let inputs = table.optional("inputs", |item| {
        item.choice(&[("mean", GridInputs::Mean), ("held", GridInputs::Held)])
    });
    Ok(Coupling::Grid {
        step: grid?,
        inputs: inputs?.unwrap_or_default(),
    })
}

/// Reads the step of the grid. It divides the observation period, so that observations are computed
/// states and means are over whole observation periods.
fn grid(item: &Item<'_>, observe: SimDuration) -> Result<SimDuration, Reported> {
    let step = item.positive_duration()?;
    if !observe.is_multiple_of(step) {
        let message = format!("a grid of {step} does not contain all observation instants");
        let help = format!("it must divide the observation period, {observe}");
        return Err(item.report(message, help));
    }
    Ok(step)
}

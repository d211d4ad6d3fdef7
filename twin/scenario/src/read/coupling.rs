//! Reading `[plant] coupling`.

use twinrig_document::{Item, Reported};
use twinrig_kernel::SimDuration;
use twinrig_runtime::{Coupling, GridInputs};

use crate::language::{Key, Shape, TableSpec, Type, table};

const HELP: &str = "write \"exact\", or as in { grid = \"1 ms\" }";

const INPUT_WORDS: [(&str, GridInputs); 2] =
    [("mean", GridInputs::Mean), ("held", GridInputs::Held)];
const INPUTS: Type<GridInputs> = Type::new(
    Shape::Choice(|| INPUT_WORDS.map(|(word, _)| word).into()),
    |item, _| item.choice(&INPUT_WORDS),
);

table! {
    /// Keys of `coupling`.
    pub(super) coupling_table = TableSpec::new("coupling", "communication grid of the plant");
    GRID: SimDuration = "grid", Type::POSITIVE_DURATION,
        "step of the grid, which divides the observation period", r#"grid = "0.5 ms""#, required();
    INPUTS: GridInputs = "inputs", super::INPUTS, "treatment of commands and samples in a step",
        r#"grid = "0.5 ms", inputs = "held""#, default("'mean'");
}

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
    let table = &item.table()?;
    let table = coupling_table::TABLE.of(table);
    let grid = table.read_with(&coupling_table::GRID, |item| grid(item, observe));
    let inputs = table.read(&coupling_table::INPUTS);
    Ok(Coupling::Grid {
        step: grid?,
        inputs: inputs?,
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

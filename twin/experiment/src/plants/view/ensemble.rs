//! Page section on ensembles of perturbed walks.

use twinrig_report::number::{method_setting, si};
use twinrig_report::page::Block;
use twinrig_report::table::{Cell, Column, Table, Tone};

use crate::plants::ensemble::{Ensemble, QuantityInterval};
use crate::plants::study::Study;

/// Returns the section: mean and interval of each quantity, and the models that differ.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    let mut names: Vec<&str> = Vec::new();
    for quantity in study.ensembles.iter().flat_map(|one| &one.quantities) {
        if !names.contains(&&*quantity.quantity) {
            names.push(&quantity.quantity);
        }
    }
    let Some(first) = study.ensembles.first() else {
        return Vec::new();
    };
    let labels = [
        Column::label("plant"),
        Column::text("method"),
        Column::number("walks"),
    ];
    let numbers = names.iter().map(|name| Column::number(*name));
    let mut table = Table::new(labels.into_iter().chain(numbers).chain([Column::reason()]));
    for one in &study.ensembles {
        let cells = names.iter().map(|name| {
            let mut quantities = one.quantities.iter();
            let found = quantities.find(|quantity| quantity.quantity == *name);
            found.map_or_else(Cell::empty, interval)
        });
        let setting = method_setting(one.key.step_s, one.key.tolerance);
        let names = [
            one.key.plant.label().into(),
            Cell::from(one.key.method.as_str()).with_detail(setting),
            count(one).into(),
        ];
        let why = one.why.clone().into();
        table.row(names.into_iter().chain(cells).chain([why]));
        if one.completed == 0 {
            table.set_tone(Tone::Bad);
        }
    }
    let introduction = format!(
        "Trajectories of a gait diverge; its statistics can be compared. Each plant walks for {} \
         from starts whose trunk is moved and turned by up to 10⁻⁶ m and 10⁻⁶ rad along and about \
         each axis, the same for all plants, under the same commands, at the shortest of some \
         steps that the budget allows. Mean and 95 % confidence interval of the mean (Student's \
         t), after the first fifth. Duty factor: share of stance, mean of the legs; phase: of \
         touch-downs, as a share of the stride of the first leg; footstep spread: RMS deviation \
         of the steps of a leg from their mean. In grey: the change of the mean at twice the \
         step or ten times the tolerance, the error of the method.",
        si(first.simulated_s, "s")
    );
    let mut out = vec![
        Block::heading("Ensembles of perturbed walks"),
        Block::Text(introduction),
        Block::Table(table),
    ];
    out.extend(differences(study, &names));
    out
}

/// Formats the counts of walks.
fn count(one: &Ensemble) -> String {
    let mut parts = vec![one.completed.to_string()];
    parts.extend((one.fell > 0).then(|| format!("{} fell", one.fell)));
    parts.extend((one.failed > 0).then(|| format!("{} failed", one.failed)));
    parts.join(", ")
}

/// Returns a mean and half the width of its interval, with the error of the method.
fn interval(quantity: &QuantityInterval) -> Cell {
    let (mean, half) = quantity.rounded();
    let error = quantity.method_error;
    let error = error.map_or(String::new(), |error| si(error, &quantity.unit));
    Cell::from(format!("{mean} ± {half}")).with_detail(error)
}

/// Returns a sentence for each quantity on the models that differ in it.
fn differences(study: &Study, names: &[&str]) -> Vec<Block> {
    let all = study.ensemble_differences();
    let definition = "Models differ in a quantity where their intervals, widened by the errors of \
                      their methods, do not overlap.";
    let sentences = names.iter().map(|name| {
        let pairs = all.iter().filter(|one| one.quantity == *name);
        let pairs: Vec<String> = pairs
            .map(|one| format!("{} and {}", one.models[0], one.models[1]))
            .collect();
        let found = if pairs.is_empty() {
            "no two models differ".to_owned()
        } else {
            pairs.join("; ")
        };
        Block::Text(format!("{name}: {found}."))
    });
    std::iter::once(Block::text(definition))
        .chain(sentences)
        .collect()
}

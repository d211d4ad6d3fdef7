//! Page section on ensembles of perturbed walks.

use crate::ensemble::{Ensemble, QuantityInterval};
use crate::study::Study;
use twinrig_report::number::{method_setting, si};

use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::table::HtmlTable;

/// Returns the section: mean and interval of each quantity, and the models that differ.
pub(crate) fn section(study: &Study) -> String {
    let mut names: Vec<&str> = Vec::new();
    for quantity in study.ensembles.iter().flat_map(|one| &one.quantities) {
        if !names.contains(&&*quantity.quantity) {
            names.push(&quantity.quantity);
        }
    }
    let Some(first) = study.ensembles.first() else {
        return String::new();
    };
    let head = format!("plant | method | walks | {} | why", names.join(" | "));
    let mut table = HtmlTable::new(&head, 2);
    for one in &study.ensembles {
        let cells = names.iter().map(|name| {
            let found = one
                .quantities
                .iter()
                .find(|quantity| quantity.quantity == *name);
            found.map_or(String::new(), interval)
        });
        let about = element(
            "span",
            "wrap soft",
            &method_setting(one.key.step_s, one.key.tolerance),
        );
        let mut all = vec![
            element("b", "", &escaped(&one.key.plant.label())),
            escaped(&one.key.method) + &about,
            count(one),
        ];
        all.extend(cells);
        let why = one.why.as_deref().unwrap_or_default();
        all.push(escaped(why));
        table.row(if one.completed == 0 { "bad" } else { "" }, all);
    }
    let mut out = "<h2>Ensembles of perturbed walks</h2>\n".to_owned();
    out += &paragraph(&format!(
        "Trajectories of a gait diverge; its statistics can be compared. Each plant walks for {} \
         from starts whose trunk is moved and turned by up to 10⁻⁶ m and 10⁻⁶ rad along and about \
         each axis, the same for all plants, under the same commands, at the shortest of some \
         steps that the budget allows. Mean and 95 % confidence interval of the mean (Student's \
         t), after the first fifth. Duty factor: share of stance, mean of the legs; phase: of \
         touch-downs, as a share of the stride of the first leg; footstep spread: RMS deviation \
         of the steps of a leg from their mean. In grey: the change of the mean at twice the \
         step or ten times the tolerance, the error of the method.",
        si(first.simulated_s, "s")
    ));
    out += &table.html();
    out += &differences(study, &names);
    out
}

/// Formats the counts of walks.
fn count(one: &Ensemble) -> String {
    let mut parts = vec![one.completed.to_string()];
    parts.extend((one.fell > 0).then(|| format!("{} fell", one.fell)));
    parts.extend((one.failed > 0).then(|| format!("{} failed", one.failed)));
    parts.join(", ")
}

/// Formats a mean and half the width of its interval.
fn interval(quantity: &QuantityInterval) -> String {
    let (mean, half) = quantity.rounded();
    let error = quantity
        .method_error
        .map_or(String::new(), |error| si(error, quantity.unit));
    format!("{mean} ± {half}") + &element("span", "wrap soft", &error)
}

/// Returns a sentence for each quantity on the models that differ in it.
fn differences(study: &Study, names: &[&str]) -> String {
    let all = study.ensemble_differences();
    let mut out = paragraph(
        "Models differ in a quantity where their intervals, widened by the errors of their methods, do not overlap.",
    );
    for name in names {
        let pairs = all.iter().filter(|one| one.quantity == *name);
        let pairs: Vec<String> = pairs
            .map(|one| format!("{} and {}", one.models[0], one.models[1]))
            .collect();
        let found = if pairs.is_empty() {
            "no two models differ".to_owned()
        } else {
            pairs.join("; ")
        };
        out += &paragraph(&format!("{name}: {found}."));
    }
    out
}

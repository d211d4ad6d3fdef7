//! Page section that compares a walk touch-down by touch-down.

use crate::footsteps::Footstep;
use crate::study::Study;
use twinrig_report::number::si;
use twinrig_rig::PlantId;

use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::table::HtmlTable;

/// Returns the section: differences of the touch-downs.
pub(crate) fn section(study: &Study) -> String {
    let mut plants: Vec<&PlantId> = Vec::new();
    for step in &study.footsteps {
        if !plants.contains(&&step.plant) {
            plants.push(&step.plant);
        }
    }
    let sections: String = plants
        .into_iter()
        .map(|plant| of_plant(study, plant))
        .collect();
    if sections.is_empty() {
        return sections;
    }
    "<h2>Differences of touch-downs</h2>\n".to_owned() + &sections
}

fn of_plant(study: &Study, plant: &PlantId) -> String {
    let steps: Vec<&Footstep> = study
        .footsteps
        .iter()
        .filter(|step| step.plant == *plant)
        .collect();
    let mut legs: Vec<&str> = Vec::new();
    for step in &steps {
        if !legs.contains(&&*step.leg) {
            legs.push(&step.leg);
        }
    }
    let full = study.massive.first().map(PlantId::label);
    let mut out = paragraph(&summary(&plant.label(), &full.unwrap_or_default(), &steps));
    let head = legs
        .iter()
        .map(|leg| format!("| {leg} at | delay | distance"));
    let head = "touch-down".to_owned() + &head.collect::<Vec<_>>().concat();
    let mut table = HtmlTable::new(&head, 1);
    let count = steps.iter().map(|step| step.number).max().unwrap_or(0);
    for number in 1..=count {
        let mut cells = vec![number.to_string()];
        for leg in &legs {
            let step = steps
                .iter()
                .find(|step| step.leg == *leg && step.number == number);
            cells.extend(step.map_or([(); 3].map(|()| String::new()), |step| of_step(step)));
        }
        table.row("", cells);
    }
    out += &table.html();
    out
}

fn of_step(step: &Footstep) -> [String; 3] {
    let Some((later, apart)) = step.later_s.zip(step.apart_m) else {
        let which = if step.at_s.is_some() {
            "only in this model"
        } else {
            "only in the other"
        };
        let at = step.at_s.map_or(String::new(), |at| si(at, "s"));
        return [at, element("span", "soft", which), String::new()];
    };
    let signed = if later > 0.0 {
        format!("+{}", si(later, "s"))
    } else {
        si(later, "s")
    };
    let shown = |text: String, beyond: bool| {
        if beyond {
            text
        } else {
            element("span", "soft", &escaped(&text))
        }
    };
    let beyond =
        |value: f64, unsure: Option<f64>| unsure.is_some_and(|unsure| value.abs() > unsure);
    [
        step.at_s.map_or(String::new(), |at| format!("{at:.3} s")),
        shown(signed, beyond(later, step.unsure_s)),
        shown(si(apart, "m"), beyond(apart, step.unsure_m)),
    ]
}

fn summary(plant: &str, full: &str, steps: &[&Footstep]) -> String {
    let pairs: Vec<(f64, f64)> = steps
        .iter()
        .filter_map(|step| step.later_s.zip(step.apart_m))
        .collect();
    let middle = |of: fn(&(f64, f64)) -> f64| {
        let mut values: Vec<f64> = pairs.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    let greatest = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).fold(0.0, f64::max);
    let lost = steps.len() - pairs.len();
    let lost = match lost {
        0 => String::new(),
        lost => format!(" {lost} have no counterpart in the other model."),
    };
    format!(
        "Both models, {full} and {plant}, receive the same commands; each touch-down is compared \
         with its counterpart in the other model. Over {} pairs, the median difference is {} in \
         time and {} in position, the greatest {} and {}.{lost} The delay is that of {plant}. \
         Grey values are within the uncertainty of the methods: either model changes by as much \
         at a coarser step or tolerance.",
        pairs.len(),
        si(middle(|pair| pair.0.abs()), "s"),
        si(middle(|pair| pair.1), "m"),
        si(greatest(|pair| pair.0.abs()), "s"),
        si(greatest(|pair| pair.1), "m"),
    )
}

//! The part of a page that compares a walk footstep by footstep.

use crate::footsteps::Footstep;
use crate::number::si;
use crate::study::Study;

use super::table::Table;
use super::text::{element, escaped, paragraph};

/// Which footsteps differ, and by how much.
pub(crate) fn section(study: &Study) -> String {
    let mut plants: Vec<&str> = Vec::new();
    for step in &study.footsteps {
        if !plants.contains(&&*step.plant) {
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
    "<h2>Which footsteps differ</h2>\n".to_owned() + &sections
}

fn of_plant(study: &Study, plant: &str) -> String {
    let steps: Vec<&Footstep> = study
        .footsteps
        .iter()
        .filter(|step| step.plant == plant)
        .collect();
    let mut legs: Vec<&str> = Vec::new();
    for step in &steps {
        if !legs.contains(&&*step.leg) {
            legs.push(&step.leg);
        }
    }
    let full = study.massive.first().map_or("", String::as_str);
    let mut out = paragraph(&summary(plant, full, &steps));
    let mut head = vec!["touch-down".to_owned()];
    for leg in &legs {
        head.extend([format!("{leg} at"), "later".to_owned(), "apart".to_owned()]);
    }
    let head: Vec<&str> = head.iter().map(String::as_str).collect();
    let mut table = Table::new(&head, 1);
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
            "only here"
        } else {
            "only there"
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
    let most = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).fold(0.0, f64::max);
    let lost = steps.len() - pairs.len();
    let lost = match lost {
        0 => String::new(),
        lost => format!(" {lost} have no like in the other model."),
    };
    format!(
        "The same commands to both models, {full} and {plant}, and each touch-down beside its like in the other model: the middle one \
         of {} is {} off in time and {} in place, the worst {} and {}.{lost} \"Later\" is how much later {plant} touches down. What is \
         grey may as well be the methods': either model changes by as much when its own step or tolerance is coarser.",
        pairs.len(),
        si(middle(|pair| pair.0.abs()), "s"),
        si(middle(|pair| pair.1), "m"),
        si(most(|pair| pair.0.abs()), "s"),
        si(most(|pair| pair.1), "m"),
    )
}

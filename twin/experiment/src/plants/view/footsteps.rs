//! Page section that compares a walk touch-down by touch-down.

use twinrig_report::number::{fixed, si};
use twinrig_report::page::Block;
use twinrig_report::table::{Cell, Column, Table, Tone};
use twinrig_rig::PlantId;

use crate::plants::footsteps::Footstep;
use crate::plants::study::Study;

/// Returns the section: differences of the touch-downs.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    let mut plants: Vec<&PlantId> = Vec::new();
    for step in &study.footsteps {
        if !plants.contains(&&step.plant) {
            plants.push(&step.plant);
        }
    }
    let sections = plants.into_iter().flat_map(|plant| of_plant(study, plant));
    let mut out: Vec<Block> = sections.collect();
    if !out.is_empty() {
        out.insert(0, Block::heading("Differences of touch-downs"));
    }
    out
}

fn of_plant(study: &Study, plant: &PlantId) -> [Block; 2] {
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
    let columns = legs.iter().flat_map(|leg| {
        let columns = [
            format!("{leg} at"),
            "delay".to_owned(),
            "distance".to_owned(),
        ];
        columns.map(Column::number)
    });
    let number = std::iter::once(Column::text("touch-down"));
    let mut table = Table::new(number.chain(columns));
    let count = steps.iter().map(|step| step.number).max().unwrap_or(0);
    for number in 1..=count {
        let mut cells = vec![Cell::from(number.to_string())];
        for leg in &legs {
            let step = steps
                .iter()
                .find(|step| step.leg == *leg && step.number == number);
            cells
                .extend(step.map_or_else(|| [(); 3].map(|()| Cell::empty()), |step| of_step(step)));
        }
        table.row(cells);
    }
    let summary = summary(&plant.label(), &full.unwrap_or_default(), &steps);
    [Block::Text(summary), Block::Table(table)]
}

fn of_step(step: &Footstep) -> [Cell; 3] {
    let at = step.at_s.map(|at| format!("{} s", fixed(at, 3))).into();
    let Some((later, apart)) = step.later_s.zip(step.apart_m) else {
        let which = if step.at_s.is_some() {
            "only in this model"
        } else {
            "only in the other"
        };
        let which = Cell::from(which).with_tone(Tone::Faint);
        return [at, which, Cell::empty()];
    };
    let sign = if later > 0.0 { "+" } else { "" };
    let shown = |text: String, beyond: bool| {
        let tone = if beyond { Tone::Plain } else { Tone::Faint };
        Cell::from(text).with_tone(tone)
    };
    let beyond =
        |value: f64, unsure: Option<f64>| unsure.is_some_and(|unsure| value.abs() > unsure);
    [
        at,
        shown(
            format!("{sign}{}", si(later, "s")),
            beyond(later, step.unsure_s),
        ),
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

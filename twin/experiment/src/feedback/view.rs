//! Summary and page of a study of load feedback.

#[cfg(test)]
mod tests;

use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::html::marker::COLOURS;
use twinrig_report::number::fixed;
use twinrig_report::page::{Block, Figure, Page, Swatch, Term};
use twinrig_report::summary::Summary;
use twinrig_report::table::{Cell, Column, Table};

use super::results::{FeedbackResult, FeedbackStudy};
use crate::machine::Machine;
use crate::reproduction::reproduction;

/// Colours of the plant's load and of the one taken.
const TRUE: usize = 0;
const TAKEN: usize = COLOURS - 1;

impl FeedbackStudy {
    /// Returns the summary.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new(&self.input.name, "study of load feedback", self.headline());
        summary.table("gaits", &gaits(self));
        summary.table("load that the controller takes", &loads(self));
        let variable = &self.variable;
        let heading = format!("displacement of footsteps per change of {variable} (R²)");
        summary.table(&heading, &displacements(self));
        for result in &self.cases {
            if let Some(why) = &result.why {
                summary.fact("no result", format!("{}: {why}", result.label()));
            }
            if let Some(why) = &result.undisplaced {
                summary.fact("undisplaced", format!("{}: {why}", result.label()));
            }
        }
        summary.left_out(&self.input.left_out);
        summary
    }

    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn page(&self, machine: &Machine, command: &str) -> Page {
        let mut blocks = vec![
            Block::Text(format!(
                "A controller walks by the loads of its legs. The first scenario is the reference \
                 of each plant. Gaits and loads count from {} s on, phases over the first {} s.",
                self.plan.after_s, self.plan.phases_s
            )),
            Block::heading("Gaits"),
            Block::Table(gaits(self)),
            Block::heading("Load that the controller takes"),
            Block::Table(loads(self)),
            Block::Heading(format!(
                "Displacement of footsteps per change of {} (R²)",
                self.variable
            )),
            Block::Table(displacements(self)),
        ];
        let mut plants: Vec<&str> = Vec::new();
        for case in &self.input.cases {
            if !plants.contains(&&*case.plant) {
                plants.push(&case.plant);
            }
        }
        blocks.extend(plants.into_iter().map(|plant| curves(self, plant)));
        let files = &self.input.files;
        Page {
            kind: "Study of load feedback".to_owned(),
            title: format!("True and measured loads: {}", self.input.name),
            headline: self.headline(),
            blocks,
            terms: reproduction(machine, command, files, self.terms(), &self.input.left_out),
        }
    }

    fn terms(&self) -> Vec<Term> {
        let definitions = [
            (
                "load taken",
                "load at a step of the controller, after its own filter (`load_lag`)",
            ),
            (
                "error",
                "root mean square of the difference of the load taken from the plant's, over time \
                 and legs; without the delay, from the plant's load of that time before",
            ),
            (
                "delay",
                "delay at which the load taken correlates most with the plant's; mean of the legs",
            ),
            (
                "phases",
                "root mean square of the difference from the phases of the reference at the same \
                 step of the controller",
            ),
        ];
        let definitions = definitions.map(|(name, text)| Term::text(name, text));
        let undisplaced = self.cases.iter().filter_map(|it| {
            let why = it.undisplaced.as_ref()?;
            let text = format!("{}: {why}", it.label());
            Some(Term::text("no displacement", text))
        });
        definitions.into_iter().chain(undisplaced).collect()
    }
}

/// Returns the columns that name a case.
fn names() -> [Column; 2] {
    [Column::label("plant"), Column::text("loads")]
}

/// Returns the names of a case.
fn named(result: &FeedbackResult) -> [Cell; 2] {
    [&*result.case.plant, &*result.case.source].map(Cell::from)
}

fn gaits(study: &FeedbackStudy) -> Table {
    let values = [
        Column::number("speed").in_unit("m/s").with_places(3),
        Column::number("duty, fore").with_places(3),
        Column::number("hind").with_places(3),
        Column::number("phases off").in_unit("rad").with_places(3),
        Column::number("commands differ after")
            .in_unit("s")
            .with_places(3),
        Column::text("fall"),
        Column::reason().only_on_pages(),
    ];
    let mut table = Table::new(names().into_iter().chain(values));
    for (index, result) in study.cases.iter().enumerate() {
        let is_other = !study.is_reference(index);
        let differs = match result.differs_after_s {
            Some(at_s) => at_s.into(),
            None if result.why.is_some() => Cell::empty(),
            None => "never: void".into(),
        };
        let fell = result.fell_at_s.map(|at_s| format!("fell at {at_s:.1} s"));
        let values = [
            result.speed_m_s.into(),
            result.duty[0].into(),
            result.duty[1].into(),
            result.phases_rad.filter(|_| is_other).into(),
            Some(differs).filter(|_| is_other).into(),
            fell.into(),
            result.why.clone().into(),
        ];
        table.row(named(result).into_iter().chain(values));
        if !is_other {
            table.begin_group();
        }
    }
    table
}

fn loads(study: &FeedbackStudy) -> Table {
    let values = [
        Column::text("signal"),
        Column::number("error").in_unit("N").with_places(2),
        Column::number("delay").in_unit("ms").with_places(1),
        Column::number("error without it")
            .in_unit("N")
            .with_places(2),
    ];
    let mut table = Table::new(names().into_iter().chain(values));
    for result in &study.cases {
        let values = [
            result.case.signal.clone().into(),
            result.error_n().into(),
            result.delay_s().map(|it| 1e3 * it).into(),
            result.rest_n().into(),
        ];
        table.row(named(result).into_iter().chain(values));
    }
    table
}

fn displacements(study: &FeedbackStudy) -> Table {
    let steps = 1..=study.plan.modulation.steps;
    let steps = steps.map(|step| Column::number(format!("step {step}")));
    let mut table = Table::new(names().into_iter().chain(steps));
    for result in study.cases.iter().filter(|it| !it.steps.is_empty()) {
        let steps = result.steps.iter().map(|it| {
            let r_squared = it.r_squared.map(|it| format!(" ({it:.2})"));
            Cell::from(fixed(it.slope, 2) + &r_squared.unwrap_or_default())
        });
        table.row(named(result).into_iter().chain(steps));
    }
    table
}

/// Returns the plots of the loads of the first leg on a plant.
fn curves(study: &FeedbackStudy, plant: &str) -> Block {
    let of_plant = study.cases.iter();
    let of_plant = of_plant.filter(|it| it.case.plant == plant && it.why.is_none());
    let figures = of_plant.map(|result| {
        let [truth, taken] = result.curves.clone();
        let series = [(TRUE, Shape::Line(truth)), (TAKEN, Shape::Dashed(taken))];
        let plot = LinePlot {
            title: format!("load of the first leg, {}", result.label()),
            width: 540.0,
            height: 260.0,
            x: AxisLabel::in_unit("time", "s"),
            y: AxisLabel::in_unit("load", "N"),
            series: series
                .map(|(number, shape)| Series { number, shape })
                .into(),
        };
        Figure {
            heading: format!("Load of the first leg: {}", result.label()),
            legend: vec![
                (Swatch::Curve(TRUE), "of the plant".to_owned()),
                (Swatch::Dashed(TAKEN), "taken".to_owned()),
            ],
            drawing: plot.drawing(),
            caption: String::new(),
        }
    });
    Block::Figures(figures.collect())
}

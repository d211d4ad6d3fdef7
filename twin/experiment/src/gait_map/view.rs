//! Summary and page of a study of a gait over frequency and step length.

#[cfg(test)]
mod tests;

use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::number::si;
use twinrig_report::page::{Block, Figure, Page, Swatch, Term};
use twinrig_report::summary::Summary;
use twinrig_report::table::{Cell, Column, Table, Tone};

use super::GaitPoint;
use super::results::GaitMap;
use crate::error::first_line;
use crate::machine::Machine;
use crate::reproduction::reproduction;

/// Quantities that are shown: name, unit, decimal places, value.
const QUANTITIES: [Quantity; 3] = [
    Quantity("speed", "m/s", 3, |point| point.speed_m_s),
    Quantity("cost of transport", "", 3, |point| point.cost_of_transport),
    Quantity("Froude number", "", 3, |point| point.froude),
];

struct Quantity(
    &'static str,
    &'static str,
    usize,
    fn(&GaitPoint) -> Option<f64>,
);

impl Quantity {
    fn heading(&self) -> String {
        let unit = match self.1 {
            "" => String::new(),
            unit => format!(" [{unit}]"),
        };
        format!("{}{unit}, by frequency and step length", self.0)
    }
}

impl GaitMap {
    /// Returns the summary.
    pub fn summary(&self) -> Summary {
        let kind = "study of a gait over frequency and step length";
        let mut summary = Summary::new(&self.input.name, kind, self.headline());
        for plant in self.plants() {
            for quantity in &QUANTITIES {
                let heading = format!("{} on {plant}", quantity.heading());
                summary.table(&heading, &table(self, plant, quantity));
            }
        }
        if let Some(why) = self.points.iter().find_map(|point| point.why.as_ref()) {
            summary.fact("no result", first_line(why));
        }
        summary.left_out(&self.input.left_out);
        summary
    }

    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn page(&self, machine: &Machine, command: &str) -> Page {
        let input = &self.input;
        let mut blocks = vec![Block::Text(format!(
            "Each run starts as the scenario does and lasts {} s; it is measured from {} s on. A \
             gait that falls has no values.",
            input.end_s, input.after_s
        ))];
        for plant in self.plants() {
            blocks.push(Block::Heading(format!("Gaits on {plant}")));
            for quantity in &QUANTITIES {
                blocks.push(Block::subheading(capital(&quantity.heading())));
                blocks.push(Block::Table(table(self, plant, quantity)));
            }
            let speed = AxisLabel::in_unit("speed", "m/s");
            let length = AxisLabel::in_unit("step length", "m");
            let cost = AxisLabel::number("cost of transport");
            let of_length = |it: &GaitPoint| Some([it.step_length_m, it.speed_m_s?]);
            let of_speed = |it: &GaitPoint| Some([it.speed_m_s?, it.cost_of_transport?]);
            blocks.push(Block::Figures(vec![
                lines(self, plant, [length, speed.clone()], of_length),
                lines(self, plant, [speed, cost], of_speed),
            ]));
        }
        let definitions = [
            ("speed", "mean speed of the trunk along its initial heading"),
            (
                "cost of transport",
                "positive work of the drives over weight and distance: negative work is not \
                 recovered, losses of motors are not included",
            ),
            (
                "Froude number",
                "square of the speed over gravity and mean height of the trunk",
            ),
        ];
        let definitions = definitions.map(|(name, text)| Term::text(name, text));
        let files = std::slice::from_ref(&input.file);
        let terms = reproduction(machine, command, files, definitions.into(), &input.left_out);
        Page {
            kind: "Study of a gait".to_owned(),
            title: format!("{}: over frequency and step length", input.name),
            headline: self.headline(),
            blocks,
            terms,
        }
    }
}

/// Returns a quantity on a plant: frequencies by row, step lengths by column.
fn table(map: &GaitMap, plant: &str, Quantity(_, _, places, value): &Quantity) -> Table {
    let lengths = map.input.step_lengths_m.iter();
    let lengths = lengths.map(|length| Column::number(si(*length, "m")).with_places(*places));
    let mut table = Table::new(std::iter::once(Column::label("frequency")).chain(lengths));
    let mut points = map.of_plant(plant);
    for frequency in &map.input.frequencies_hz {
        let row = points.by_ref().take(map.input.step_lengths_m.len());
        let cells = row.map(|point| match (value(point), point.fell_at_s) {
            (Some(value), _) => Cell::from(value),
            (None, Some(at_s)) => Cell::from(format!("fell {at_s:.1} s")).with_tone(Tone::Bad),
            (None, None) => Cell::from("–").with_tone(Tone::Faint),
        });
        let cells: Vec<Cell> = cells.collect();
        table.row(std::iter::once(Cell::from(si(*frequency, "Hz"))).chain(cells));
    }
    table
}

/// Returns a text that begins with a capital letter.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}

/// Returns the plot of two quantities, with a line for each frequency and a point for each step
/// length.
fn lines(
    map: &GaitMap,
    plant: &str,
    [x, y]: [AxisLabel; 2],
    at: impl Fn(&GaitPoint) -> Option<[f64; 2]>,
) -> Figure {
    let frequencies = map.input.frequencies_hz.iter().enumerate();
    let series = frequencies.clone().flat_map(|(number, frequency)| {
        let points = map.of_plant(plant);
        let points = points.filter(|point| point.frequency_hz == *frequency);
        let points = points.filter_map(|point| {
            let tooltip = format!("{}, {}", si(*frequency, "Hz"), si(point.step_length_m, "m"));
            Some((at(point)?, tooltip))
        });
        let points: Vec<([f64; 2], String)> = points.collect();
        let line = points.iter().map(|(at, _)| *at).collect();
        [Shape::Line(line), Shape::Dots(points)].map(|shape| Series { number, shape })
    });
    let title = format!("{} over {} on {plant}", y.name(), x.name());
    let plot = LinePlot {
        title: title.clone(),
        width: 540.0,
        height: 300.0,
        x,
        y,
        series: series.collect(),
    };
    Figure {
        heading: capital(&title),
        legend: frequencies
            .map(|(number, frequency)| (Swatch::Curve(number), si(*frequency, "Hz")))
            .collect(),
        drawing: plot.drawing(),
        caption: "A line for each frequency, a point for each step length.".to_owned(),
    }
}

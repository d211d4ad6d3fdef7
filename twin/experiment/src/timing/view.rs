//! Summary and page of a study of the timing of a servo bus.

use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::page::{Block, Figure, Page, Swatch, Term};
use twinrig_report::summary::Summary;
use twinrig_report::table::{Cell, Column, Table};

use super::results::{TimingPoint, TimingStudy};
use crate::error::first_line;
use crate::machine::Machine;
use crate::reproduction::reproduction;

/// Quantities by number of servos: name, unit, decimal places, value.
const QUANTITIES: [Quantity; 2] = [
    Quantity("rate", "Hz", 1, |it| it.rate_hz),
    Quantity("age of the oldest position", "ms", 2, |it| {
        it.age_s.map(|age| 1e3 * age)
    }),
];

struct Quantity(
    &'static str,
    &'static str,
    usize,
    fn(&TimingPoint) -> Option<f64>,
);

impl Quantity {
    fn heading(&self) -> String {
        format!("{} [{}], by number of servos", self.0, self.1)
    }
}

impl TimingStudy {
    /// Returns the summary.
    pub fn summary(&self) -> Summary {
        let name = format!("{} at the adapter {}", self.model, self.adapter);
        let mut summary = Summary::new(&name, "study of the timing of a bus", self.headline());
        for quantity in &QUANTITIES {
            summary.table(&quantity.heading(), &self.table(quantity));
        }
        if let Some(why) = self.points.iter().find_map(|it| it.why.as_ref()) {
            summary.fact("no result", first_line(why));
        }
        summary
    }

    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn page(&self, machine: &Machine, command: &str) -> Page {
        let mut blocks = vec![Block::Text(format!(
            "The driver writes goals to all servos and reads positions of all, {} times in each \
             loop, on the emulated bus; return delay {}. The program takes no time: a real loop is \
             slower.",
            self.transfers, self.return_delay
        ))];
        for quantity in &QUANTITIES {
            blocks.push(Block::heading(quantity.heading()));
            blocks.push(Block::Table(self.table(quantity)));
            blocks.push(Block::Figures(self.figures(quantity)));
        }
        blocks.push(Block::heading("Times that users state"));
        blocks.push(Block::text(
            "Times in threads of DynamixelSDK, beside simulated ones of XM430 and XL330.",
        ));
        blocks.push(Block::Table(self.stated_table()));
        let definitions = [
            ("rate", "transfers a second: one over the median duration"),
            (
                "age",
                "time from the sample of the encoder to the end of the transfer, of the oldest \
                 position; median of the transfers",
            ),
            (
                "adapter",
                "timing of USB and host; which of its figures are measured, fitted or assumed is \
                 in docs/timing.md",
            ),
        ];
        let definitions = definitions.map(|(name, text)| Term::text(name, text));
        Page {
            kind: "Study of the timing of a bus".to_owned(),
            title: format!("{} at the adapter {}", self.model, self.adapter),
            headline: self.headline(),
            blocks,
            terms: reproduction(machine, command, &[], definitions.into(), &[]),
        }
    }

    /// Returns the numbers of servos.
    fn servos(&self) -> Vec<u8> {
        let first = self.curves().next().unwrap_or_default();
        first.iter().map(|it| it.servos).collect()
    }

    /// Returns a quantity: loops by row, numbers of servos by column.
    fn table(&self, Quantity(_, _, places, value): &Quantity) -> Table {
        let names = [
            Column::number("timer").in_unit("ms"),
            Column::number("baud").in_unit("bit/s"),
            Column::label("read"),
        ];
        let servos = self.servos().into_iter();
        let servos = servos.map(|count| Column::number(count.to_string()).with_places(*places));
        let mut table = Table::new(names.into_iter().chain(servos));
        let mut last: Option<&TimingPoint> = None;
        for curve in self.curves() {
            let Some(first) = curve.first() else { continue };
            if last.is_some_and(|last| !last.is_of_panel(first)) {
                table.begin_group();
            }
            last = Some(first);
            let names = [
                Cell::from(1e3 * first.timer_s),
                Cell::from(first.baud as f64),
                Cell::from(&*first.read),
            ];
            let values = curve.iter().map(|it| Cell::from(value(it)));
            table.row(names.into_iter().chain(values));
        }
        table
    }

    /// Returns a plot of a quantity over the number of servos for each timer and baud rate.
    fn figures(&self, Quantity(name, unit, _, value): &Quantity) -> Vec<Figure> {
        let panels = self.points.chunk_by(TimingPoint::is_of_panel);
        let panels = panels.filter_map(|panel| {
            let first = panel.first()?;
            let curves = panel.chunk_by(TimingPoint::is_of_curve).enumerate();
            let mut legend = Vec::new();
            let mut series = Vec::new();
            for (number, curve) in curves {
                let points = curve
                    .iter()
                    .filter_map(|it| Some([it.servos.into(), value(it)?]));
                let shape = Shape::Line(points.collect());
                series.push(Series { number, shape });
                legend.push((Swatch::Curve(number), curve.first()?.read.clone()));
            }
            let heading = format!("Timer {} ms, {} bit/s", 1e3 * first.timer_s, first.baud);
            let plot = LinePlot {
                title: heading.clone(),
                width: 420.0,
                height: 240.0,
                x: AxisLabel::number("servos"),
                y: AxisLabel::in_unit(*name, unit),
                series,
            };
            Some(Figure {
                heading,
                legend,
                drawing: plot.drawing(),
                caption: String::new(),
            })
        });
        panels.collect()
    }

    fn stated_table(&self) -> Table {
        let mut table = Table::new([
            Column::label("issue"),
            Column::text("as stated"),
            Column::text("stated").in_unit("ms"),
            Column::number("return delay").in_unit("µs"),
            Column::text("simulated").in_unit("ms"),
        ]);
        for it in &self.stated {
            let simulated = it.simulated.iter();
            let simulated =
                simulated.map(|(name, time)| format!("{:.2} ({name})", 1e3 * time.as_secs_f64()));
            table.row([
                Cell::link(it.issue.to_string(), it.source()),
                it.conditions.into(),
                it.stated_ms.into(),
                Cell::from(1e6 * it.return_delay.as_secs_f64()),
                Cell::from(simulated.collect::<Vec<_>>().join(", ")),
            ]);
        }
        table
    }
}

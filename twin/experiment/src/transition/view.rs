//! Summary and page of a study of gait transitions.

#[cfg(test)]
mod tests;

use twinrig_kernel::Unit;
use twinrig_report::page::{Block, Figure, Page, Swatch, Term};
use twinrig_report::summary::Summary;
use twinrig_report::table::{Cell, Column, Table};

use super::MIXED;
use super::events::RampDirection;
use super::gait_diagram::{GaitDiagram, colour};
use super::results::{TransitionResult, TransitionStudy};
use crate::machine::Machine;
use crate::reproduction::reproduction;

/// Time before and after a transition that its own diagram has \[s\].
const AROUND_S: f64 = 2.0;
/// Greatest number of diagrams of transitions of a run.
const DIAGRAMS: usize = 6;

impl TransitionStudy {
    /// Returns the summary.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new(
            &self.input.name,
            "study of gait transitions",
            self.headline(),
        );
        summary.table("transitions", &transitions(self));
        summary.table("hysteresis", &hysteresis(self));
        summary.table("time in each gait", &shares(self));
        summary.table("cycles", &cycles(self));
        summary.left_out(&self.input.left_out);
        summary
    }

    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn page(&self, machine: &Machine, command: &str) -> Page {
        let variable = &self.input.variable;
        let mut blocks = vec![
            Block::Text(format!(
                "{variable} changes in steps; the phases of the touch-downs of each cycle are \
                 compared with the patterns of gaits (thesis, section 3.3.2.3, figure 3.7)."
            )),
            Block::heading("Transitions"),
            Block::Table(transitions(self)),
            Block::heading("Hysteresis"),
        ];
        let hysteresis = hysteresis(self);
        blocks.push(if hysteresis.is_empty() {
            Block::text("There is no transition between two gaits.")
        } else {
            Block::Table(hysteresis)
        });
        for result in self.cases.iter().filter(|it| it.why.is_none()) {
            blocks.push(Block::Heading(self.label(result)));
            blocks.extend(self.diagrams(result));
        }
        let files = std::slice::from_ref(&self.input.file);
        let definitions = self.definitions();
        Page {
            kind: "Study of gait transitions".to_owned(),
            title: format!("Gaits while {variable} changes: {}", self.input.name),
            headline: self.headline(),
            blocks,
            terms: reproduction(machine, command, files, definitions, &self.input.left_out),
        }
    }

    fn definitions(&self) -> Vec<Term> {
        vec![
            Term::text(
                "class",
                format!(
                    "pattern of touch-downs nearest to a cycle of the first leg, if no leg \
                     deviates by more than {} of the cycle from the pattern at its best rotation",
                    self.plan.tolerance
                ),
            ),
            Term::text(
                "transition",
                format!(
                    "from the last cycle of a gait to the first of the next one that lasts {} \
                     cycles",
                    self.plan.lasting
                ),
            ),
            Term::text(
                "speed",
                "of the trunk over a second, along its heading at the begin of the second; below \
                 zero it moves backwards",
            ),
            Term::text(
                "slip",
                "sum of the horizontal paths of all feet on the ground, whose soles deflect: also \
                 a standing robot with noise of the phases has some",
            ),
        ]
    }

    fn classes(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for pattern in &self.input.patterns {
            if !names.contains(&pattern.name) {
                names.push(pattern.name.clone());
            }
        }
        names
    }

    /// Returns the diagram of the whole run, and those of its first transitions.
    fn diagrams(&self, result: &TransitionResult) -> Vec<Block> {
        let classes = self.classes();
        let unit = match self.input.unit {
            Unit::One => String::new(),
            unit => format!(" [{}]", unit.symbol()),
        };
        // The name has no room for more.
        let variable = format!("{}{unit}", self.input.variable);
        let end_s = result.run.fell_at_s.unwrap_or(result.run.end_s);
        let legend = result.shares().into_iter().map(|(class, seconds)| {
            let swatch = match colour(class, &classes) {
                Some(colour) => Swatch::Curve(colour),
                None if class == MIXED => Swatch::Region,
                None => Swatch::Nothing,
            };
            (swatch, format!("{class}: {seconds:.1} s"))
        });
        let figure = |heading: String, span_s: [f64; 2], legend: Vec<(Swatch, String)>| {
            let diagram = GaitDiagram {
                result,
                classes: &classes,
                variable: &variable,
                span_s,
            };
            Block::Figure(Figure {
                heading,
                legend,
                drawing: diagram.drawing(),
                caption: String::new(),
            })
        };
        let whole = [0.0, end_s.max(1.0)];
        let whole = figure("The whole run".to_owned(), whole, legend.collect());
        let parts = result.transitions.iter().take(DIAGRAMS).filter_map(|one| {
            let established_s = one.established_s.unwrap_or(one.begin_s);
            let span_s = [one.begin_s - AROUND_S, established_s + AROUND_S];
            let span_s = span_s.map(|at_s| at_s.clamp(0.0, end_s));
            let value = self.value_text(one.value);
            let heading = format!(
                "{} to {} at {:.1} s, {value}",
                one.from, one.to, one.begin_s
            );
            (span_s[1] > span_s[0]).then(|| figure(heading, span_s, Vec::new()))
        });
        std::iter::once(whole).chain(parts).collect()
    }
}

fn transitions(study: &TransitionStudy) -> Table {
    let mut table = Table::new([
        Column::label("run"),
        Column::text("from"),
        Column::text("to"),
        Column::number("begins").in_unit("s").with_places(2),
        Column::number("established").in_unit("s").with_places(2),
        Column::number("value"),
        Column::text("way"),
        Column::number("feet slip").in_unit("mm").with_places(0),
        Column::reason().only_on_pages(),
    ]);
    for result in &study.cases {
        let label = study.label(result);
        if let Some(why) = &result.why {
            let mut cells = vec![Cell::empty(); 9];
            cells[0] = label.clone().into();
            cells[8] = why.clone().into();
            table.row(cells);
            table.begin_group();
        }
        for (number, one) in result.transitions.iter().enumerate() {
            table.row([
                label.clone().into(),
                one.from.clone().into(),
                one.to.clone().into(),
                one.begin_s.into(),
                one.established_s.map_or("never".into(), Cell::from),
                study.value_text(one.value).into(),
                match one.way {
                    RampDirection::Up => "up".into(),
                    RampDirection::Down => "down".into(),
                },
                (1e3 * one.slip_m).into(),
            ]);
            if number == 0 {
                table.begin_group();
            }
        }
    }
    table
}

/// Returns the values at which pairs of gaits change, on the way up and on the way down.
fn hysteresis(study: &TransitionStudy) -> Table {
    let mut table = Table::new([
        Column::label("run"),
        Column::text("between"),
        Column::text("and"),
        Column::text("up"),
        Column::text("down"),
    ]);
    let values = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|it| study.value_text(*it)).collect();
        texts.join(", ")
    };
    for result in &study.cases {
        for pair in &result.hysteresis {
            let [a, b] = pair.classes.clone();
            let [up, down] = [values(&pair.up), values(&pair.down)];
            let texts = [study.label(result), a, b, up, down];
            table.row(texts.map(Cell::from));
        }
    }
    table
}

fn shares(study: &TransitionStudy) -> Table {
    let mut table = Table::new([
        Column::label("run"),
        Column::text("gaits"),
        Column::text("most slip in one second"),
    ]);
    for result in &study.cases {
        let slip = result
            .worst_slip()
            .map(|[at_s, slip]| format!("{:.0} mm at {at_s:.0} s", 1e3 * slip));
        table.row([
            study.label(result).into(),
            seconds(result).into(),
            slip.into(),
        ]);
    }
    table
}

fn cycles(study: &TransitionStudy) -> Table {
    let mut table = Table::new([
        Column::label("run"),
        Column::number("contacts of a leg").with_places(2),
        Column::number("class by oscillators the same"),
    ]);
    for result in &study.cases {
        let agreement = result.agreement();
        let share = agreement
            .share()
            .map(|share| format!("{:.1} % of {}", 100.0 * share, agreement.cycles));
        table.row([
            study.label(result).into(),
            result.contacts().into(),
            share.into(),
        ]);
    }
    table
}

/// Returns the time in each gait, or the reason of a run without results.
fn seconds(result: &TransitionResult) -> String {
    if let Some(why) = &result.why {
        return why.clone();
    }
    let shares = result.shares().into_iter();
    let shares = shares.map(|(class, seconds)| format!("{class} {seconds:.1} s"));
    let mut parts: Vec<String> = shares.collect();
    let fall = result.run.fell_at_s;
    parts.extend(fall.map(|at_s| format!("fell at {at_s:.1} s")));
    parts.join(", ")
}

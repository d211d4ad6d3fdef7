//! Results of the comparison, as printed, recorded and shown in the documentation.

use serde::{Deserialize, Serialize};

use crate::thesis::flips::Flips;
use crate::thesis::item::{Item, Measurements, Printed, PrintedFigure, Source};
use crate::thesis::number;
use crate::thesis::verdict::{Measurement, Verdict};

/// Results of all items that were run. The field names are the JSON keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ThesisResult {
    /// Processor of the run times.
    pub cpu: String,
    /// Version of the program.
    pub build: String,
    /// Items, in the order of the thesis.
    pub items: Vec<ItemResult>,
}

/// Result of an item.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ItemResult {
    /// Identifier.
    pub id: String,
    /// Title.
    pub title: String,
    /// Place in the thesis.
    pub place: String,
    /// Printed figures beside ours.
    pub figures: Vec<FigureResult>,
    /// Commands that show more.
    pub commands: Vec<String>,
}

/// Printed figure beside ours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FigureResult {
    /// Key of the measurement.
    pub key: String,
    /// Quantity.
    pub quantity: String,
    /// Section, figure or table.
    pub place: String,
    /// Printed value with its unit, or the statement in words of ours.
    pub printed: String,
    /// Printed value; none for a statement.
    pub printed_value: Option<f64>,
    /// Unit of the printed value and of ours.
    pub unit: String,
    /// Ours; none if nothing was observed.
    pub ours: Option<Measurement>,
    /// Verdict.
    pub verdict: Verdict,
    /// Inputs of ours, and what was free to differ: `fitted: geometry of the leg`.
    pub inputs: Vec<String>,
    /// Rule of the verdict with the reason for its tolerance.
    pub rule: String,
    /// Evidence, reason of a difference, or what ours assumes.
    pub remark: String,
    /// Moves of the inputs that flip the verdict, for readers; empty if none was made.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub flips: String,
    /// Whether ours is a run time, which depends on the machine.
    pub timing: bool,
}

impl ItemResult {
    /// Compares measurements with the printed figures of an item.
    pub(crate) fn of(item: &Item, measured: &Measurements) -> Self {
        let figure = |figure: &PrintedFigure| {
            let source = item.source(figure.key);
            FigureResult::of(figure, source, measured.get(figure.key))
        };
        Self {
            id: item.id.to_owned(),
            title: item.title.to_owned(),
            place: item.place.to_owned(),
            figures: item.figures.iter().map(figure).collect(),
            commands: item.commands.iter().map(ToString::to_string).collect(),
        }
    }
}

impl ItemResult {
    /// Returns the result with the recorded flips of its figures.
    pub(crate) fn with_flips(mut self, flips: &Flips) -> Self {
        if let Some(item) = flips.item(&self.id) {
            // Arithmetic reads no file.
            let fixed = [Verdict::NotRun, Verdict::Recomputed, Verdict::Misprint];
            let is_moved =
                |figure: &&mut FigureResult| !figure.timing && !fixed.contains(&figure.verdict);
            for figure in self.figures.iter_mut().filter(is_moved) {
                figure.flips = item.text(&figure.key, &figure.place);
            }
        }
        self
    }
}

impl FigureResult {
    fn of(figure: &PrintedFigure, source: Option<&Source>, ours: Option<Measurement>) -> Self {
        let ours = ours.filter(|found| found.value.is_finite());
        let printed_value = figure.printed_value();
        let inputs = source.map_or(&[][..], |source| source.inputs);
        Self {
            key: figure.key.to_owned(),
            quantity: figure.quantity.to_owned(),
            place: figure.place.to_owned(),
            printed: match figure.printed {
                Printed::Value(value) => {
                    let value = number::printed(value);
                    format!("{value} {}", figure.unit).trim_end().to_owned()
                }
                Printed::Statement(statement) => statement.to_owned(),
            },
            printed_value,
            unit: figure.unit.to_owned(),
            ours,
            verdict: match source {
                Some(source) => figure.rule.verdict(source.basis, printed_value, ours),
                None => Verdict::NotRun,
            },
            inputs: inputs.iter().map(|input| input.text()).collect(),
            rule: figure.rule_text(),
            remark: figure.remark.to_owned(),
            flips: String::new(),
            timing: figure.is_timing,
        }
    }

    /// Returns ours for readers: `542 µs`, or a run time, `542 µs ⏱`.
    pub(crate) fn ours_text(&self) -> String {
        let Some(found) = &self.ours else {
            return "–".to_owned();
        };
        let clock = if self.timing { " ⏱" } else { "" };
        number::measurement(found, self.printed_value, &self.unit) + clock
    }

    /// Returns the ground of the verdict: rule, remark, inputs and flips.
    pub(crate) fn ground(&self) -> String {
        let inputs = self.inputs.join("; ");
        let parts = [&self.rule, &self.remark, &inputs, &self.flips];
        let parts = parts.into_iter().filter(|part| !part.is_empty());
        parts.map(String::as_str).collect::<Vec<_>>().join("; ")
    }
}

impl ThesisResult {
    /// Returns the number of figures with a verdict.
    pub(crate) fn count(&self, verdict: Verdict) -> usize {
        let figures = self.items.iter().flat_map(|item| &item.figures);
        figures.filter(|figure| figure.verdict == verdict).count()
    }

    /// Returns the figures that were not observed, and those whose verdict is not that of `record`.
    pub(crate) fn departures(&self, record: Option<&Self>) -> Vec<String> {
        let mut departures = Vec::new();
        for item in &self.items {
            let recorded = record.and_then(|record| record.item(&item.id));
            for figure in &item.figures {
                let name = format!("{}, {}", item.id, figure.quantity);
                let verdict = figure.verdict;
                if verdict == Verdict::Unobserved {
                    departures.push(format!("{name}: {}", verdict.words()));
                    continue;
                }
                match recorded.and_then(|item| item.figure(figure)) {
                    Some(known) if known.verdict == verdict => {}
                    Some(known) => departures.push(format!(
                        "{name}: {}, recorded as {}",
                        verdict.words(),
                        known.verdict.words()
                    )),
                    None => departures.push(format!("{name}: {}, not recorded", verdict.words())),
                }
            }
        }
        departures
    }

    /// Returns an item.
    pub(crate) fn item(&self, id: &str) -> Option<&ItemResult> {
        self.items.iter().find(|item| item.id == id)
    }
}

impl ItemResult {
    /// Returns the result of the same printed figure.
    pub(crate) fn figure(&self, like: &FigureResult) -> Option<&FigureResult> {
        self.of_figure(&like.key, &like.place)
    }

    /// Returns the result of the figure with a key and a place.
    pub(crate) fn of_figure(&self, key: &str, place: &str) -> Option<&FigureResult> {
        let mut figures = self.figures.iter();
        figures.find(|figure| (figure.key.as_str(), figure.place.as_str()) == (key, place))
    }
}

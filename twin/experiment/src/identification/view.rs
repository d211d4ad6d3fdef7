//! Text and page of a fit, and its overlay for files of robots and benches.

use std::fmt::Write as _;

use twinrig_document::{escaped, print_quantity, quoted};
use twinrig_kernel::Unit;
use twinrig_report::number::precise;
use twinrig_report::page::{Block, Card, Page, Term};
use twinrig_report::table::{Cell, Column, Table, Tone};
use twinrig_report::text::style::{BOLD, DIM, styled};

use super::figures::figures;
use super::outcome::{
    DataRange, FitOutcome, FittedParameter, RecordingResidual, UnknownDirection, error_of,
};

/// Prefix of the keys of a scenario that replace values of a robot file or of a bench.
const OVERRIDE: &str = "override.";

impl FitOutcome {
    /// Returns the text of a result.
    pub fn text(&self) -> String {
        let details = format!("{} · {}", self.space, self.scenario);
        let mut out = format!(
            "{}  {}\n\n",
            styled(BOLD, &self.name),
            styled(DIM, &details)
        );
        let mut tables = vec![parameters(self), residuals("recording", &self.recordings)];
        tables.extend(self.predictions().map(|(_, table)| table));
        for table in tables {
            for line in table.grid().lines(2) {
                // Writing to a string cannot fail.
                let _ = writeln!(out, "{line}");
            }
            out.push('\n');
        }
        for sentence in self.sentences() {
            let _ = writeln!(out, "  {}", escaped(&sentence));
        }
        out
    }

    /// Returns what the fit shows, in sentences.
    fn sentences(&self) -> Vec<String> {
        let mut sentences: Vec<String> = self
            .unknown
            .iter()
            .map(UnknownDirection::sentence)
            .collect();
        for it in &self.correlations {
            let [one, other] = &it.keys;
            sentences.push(format!(
                "correlation {:+.3}: {one}, {other}",
                it.correlation
            ));
        }
        sentences.push(format!(
            "residuals {:.2} of the assumed deviation, correlated over {:.0} samples",
            self.deviation, self.correlation_time
        ));
        if let [least, .., greatest] = self.minima[..] {
            sentences.push(format!(
                "{} minima: costs {least:.4} to {greatest:.4}",
                self.minima.len()
            ));
        }
        if let Some(cost) = self.profile_cost
            && self
                .minima
                .first()
                .is_some_and(|least| cost < 0.999 * least)
        {
            sentences.push(format!(
                "profiles found a cost of {cost:.4}: this is a local minimum; search more often"
            ));
        }
        let spikes: usize = self.recordings.iter().map(|it| it.spikes).sum();
        if spikes > 0 {
            sentences.push(format!("{spikes} corrupted readings are not compared"));
        }
        if !self.converged {
            sentences.push(format!("not converged after {} steps", self.steps));
        }
        sentences
    }

    /// Returns the overlay: the estimates as values that a file of a robot or a bench includes.
    /// Parameters of other files are comments; `date` is that of the file, as in TOML.
    pub fn overlay(&self, date: &str) -> String {
        let mut text = format!(
            "# Fitted by `twin fit` with {} and {}.\n\
             # A file of a robot or a bench takes it by `include`.\n\n\
             [fit]\nname = {}\ndate = {date}\nbuild = {}\n",
            escaped(&self.space),
            escaped(&self.scenario),
            quoted(&self.name),
            quoted(&self.build)
        );
        let hashes = distinct(self.recordings.iter().map(|it| it.hash.as_str()));
        let hashes: Vec<String> = hashes.into_iter().map(quoted).collect();
        let _ = writeln!(text, "recordings = [{}]", hashes.join(", "));
        for signal in self.signals() {
            if let Some([mean, worst]) = self.held_out_error(signal) {
                let signal = quoted(signal);
                let errors = format!("{{ mean = {mean}, worst = {worst} }}");
                let _ = writeln!(text, "left_out.{signal} = {errors}");
            }
        }
        // A document that includes the overlay warns of values beyond these.
        if !self.data.is_empty() {
            text.push_str("\n[fit.data]\n");
        }
        for DataRange { key, ends } in &self.data {
            let _ = writeln!(text, "{key} = [{}]", ends.join(", "));
        }
        text.push_str(&self.distribution.toml());
        text.push_str("\n[values]\n");
        for it in &self.parameters {
            let (mark, key) = match it.key.strip_prefix(OVERRIDE) {
                Some(key) => ("", key),
                None => ("# of the scenario: ", it.key.as_str()),
            };
            let _ = writeln!(text, "{mark}{key} = {}  # {}", it.toml, it.interval_text());
        }
        text
    }

    /// Returns the compared signals.
    fn signals(&self) -> Vec<&str> {
        distinct(self.recordings.iter().map(|it| it.signal.as_str()))
    }

    /// Returns the tables of recordings that were predicted, with their headings.
    fn predictions(&self) -> impl Iterator<Item = (&'static str, Table)> {
        let held_out = self.held_out.iter();
        let held_out: Vec<RecordingResidual> = held_out
            .flat_map(|it| it.residuals.iter().cloned())
            .collect();
        let tables = [
            ("Recordings predicted", "predicted", self.validation.clone()),
            ("Recordings left out in turn", "left out", held_out),
        ];
        let tables = tables.into_iter().filter(|(.., all)| !all.is_empty());
        tables.map(|(heading, name, all)| (heading, residuals(name, &all)))
    }
}

/// Returns the different ones of some texts, in the order of their first occurrence.
fn distinct<'t>(texts: impl Iterator<Item = &'t str>) -> Vec<&'t str> {
    let mut found = Vec::new();
    for text in texts {
        if !found.contains(&text) {
            found.push(text);
        }
    }
    found
}

impl UnknownDirection {
    fn sentence(&self) -> String {
        let parts = self
            .parts
            .iter()
            .map(|(key, share)| format!("{share:+.2} {key}"));
        let parts: Vec<String> = parts.collect();
        format!("the recordings cannot tell {}", parts.join(" "))
    }
}

impl FittedParameter {
    fn quantity(&self, number: f64) -> String {
        let unit = Unit::ALL.iter().find(|unit| unit.symbol() == self.unit);
        let digits: f64 = format!("{number:.4e}").parse().unwrap_or(number);
        print_quantity(digits, unit.copied().unwrap_or(Unit::One))
    }

    fn profile_text(&self, bounds: [Option<f64>; 2]) -> String {
        let [low, high] = bounds.map(|bound| bound.map(|bound| self.quantity(bound)));
        match (low, high) {
            (Some(low), Some(high)) => format!("{low} … {high}"),
            (Some(low), None) => format!("≥ {low}"),
            (None, Some(high)) => format!("≤ {high}"),
            (None, None) => "all of the range".to_owned(),
        }
    }

    fn interval_text(&self) -> String {
        match self.interval {
            _ if self.at_bound => "at the bound of its range".to_owned(),
            None => "not known".to_owned(),
            Some([low, high]) => {
                format!("95 %: {} … {}", self.quantity(low), self.quantity(high))
            }
        }
    }
}

fn parameters(outcome: &FitOutcome) -> Table {
    let has_profiles = outcome.parameters.iter().any(|it| it.profile.is_some());
    let mut table = Table::new(
        [
            Some(Column::label("parameter")),
            Some(Column::number("estimate")),
            Some(Column::text("interval")),
            has_profiles.then(|| Column::text("profile likelihood")),
            Some(Column::number("from")),
            Some(Column::number("to")),
        ]
        .into_iter()
        .flatten(),
    );
    for it in &outcome.parameters {
        let faint = |number| Cell::from(it.quantity(number)).with_tone(Tone::Faint);
        let tone = if it.interval.is_some() {
            Tone::Plain
        } else {
            Tone::Doubtful
        };
        let profile = it.profile.map(|bounds| it.profile_text(bounds));
        let cells = [
            Some(it.key.strip_prefix(OVERRIDE).unwrap_or(&it.key).into()),
            Some(it.quantity(it.estimate).into()),
            Some(Cell::from(it.interval_text()).with_tone(tone)),
            has_profiles.then(|| profile.into()),
            Some(faint(it.range[0])),
            Some(faint(it.range[1])),
        ];
        table.row(cells.into_iter().flatten());
    }
    table
}

fn residuals(name: &str, recordings: &[RecordingResidual]) -> Table {
    let mut table = Table::new([
        Column::label(name),
        Column::text("signal"),
        Column::number("mean absolute"),
        Column::number("not fitted"),
        Column::number("rms"),
        Column::number("greatest"),
    ]);
    for it in recordings {
        let number = |number| Cell::from(precise(number, &it.unit));
        table.row([
            it.recording.as_str().into(),
            it.signal.as_str().into(),
            number(it.mean_absolute),
            it.unfitted.map(|error| precise(error, &it.unit)).into(),
            number(it.rms),
            number(it.worst),
        ]);
    }
    table.begin_group();
    for signal in distinct(recordings.iter().map(|it| it.signal.as_str())) {
        let mut of = recordings.iter().filter(|it| it.signal == signal);
        let unit = of.next().map_or("", |it| it.unit.as_str());
        let mean = error_of(recordings.iter(), signal).map(|[mean, _]| precise(mean, unit));
        table.row([
            "mean".into(),
            signal.into(),
            mean.into(),
            Cell::empty(),
            Cell::empty(),
            Cell::empty(),
        ]);
    }
    table
}

/// Returns the page of a fit.
pub fn fit_page(outcome: &FitOutcome) -> Page {
    let fitted = outcome
        .recordings
        .first()
        .map(|it| it.signal.clone())
        .unwrap_or_default();
    let unit = outcome
        .recordings
        .first()
        .map(|it| it.unit.clone())
        .unwrap_or_default();
    let error =
        |value: Option<[f64; 2]>| value.map_or("none".to_owned(), |[mean, _]| precise(mean, &unit));
    let mut blocks = vec![Block::Cards(vec![
        Card::new(
            "fitted",
            error(outcome.fitted_error(&fitted)),
            "mean absolute residual",
        ),
        Card::new(
            "left out",
            error(outcome.held_out_error(&fitted)),
            "the same, predicted",
        ),
        Card::new(
            "samples",
            outcome.samples.to_string(),
            format!(
                "of which 1 in {:.0} is independent",
                outcome.correlation_time
            ),
        ),
    ])];
    blocks.push(Block::heading("Parameters"));
    blocks.push(Block::Table(parameters(outcome)));
    blocks.extend(outcome.sentences().into_iter().map(Block::Text));
    blocks.push(Block::heading("Residuals"));
    blocks.push(Block::Table(residuals("recording", &outcome.recordings)));
    for (heading, table) in outcome.predictions() {
        blocks.push(Block::heading(heading));
        blocks.push(Block::Table(table));
    }
    blocks.push(Block::heading("Recordings with the greatest residuals"));
    blocks.push(Block::Figures(figures(outcome)));
    Page {
        kind: "Fit".to_owned(),
        title: outcome.name.clone(),
        headline: format!(
            "{} parameters, {} recordings",
            outcome.parameters.len(),
            outcome.recordings.len()
        ),
        blocks,
        terms: Vec::<Term>::new(),
    }
}

//! Summary and page of a study of load filters.

#[cfg(test)]
mod tests;

use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::number::{fixed, plain, si};
use twinrig_report::page::{Block, Card, Figure, Page, Swatch, Term};
use twinrig_report::summary::Summary;
use twinrig_report::table::{Cell, Column, Table, Tone};

use super::curves::{EstimateCurve, VoltageCurve, VoltagePoint};
use super::distribution::Residuals;
use super::filter::FilterKind;
use super::printed::Verdict;
use super::results::EstimateStudy;
use crate::machine::Machine;
use crate::reproduction::{Budgeted, timed_reproduction};

/// Filters that are drawn: the thesis' one, and the one without a frequency.
const DRAWN: [&str; 2] = ["F2", "F3"];
/// Standard deviations of the shaded region.
const SPREAD: f64 = 3.0;

impl EstimateStudy {
    /// Returns the summary.
    pub fn summary(&self) -> Summary {
        let mut summary = Summary::new(&self.scenario, "study of load filters", self.headline());
        summary.table("compared with the thesis", &thesis(self));
        summary.table("piezoelectric cell", &coefficients(self));
        summary.table("validation", &validation(self));
        summary.table("tuning", &tuning(self));
        let settings = self.settings();
        summary.section("tuned filters", settings.lines().map(str::to_owned));
        let cut: Vec<&str> = self.cut().collect();
        if !cut.is_empty() {
            let (cut, budget_s) = (cut.join(", "), self.budget_s);
            let searches = format!("searches of {cut} by a budget of {budget_s} s");
            summary.fact("truncated", searches);
        }
        self.starts.note(&mut summary);
        summary.left_out(&self.left_out);
        summary
    }

    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn page(&self, machine: &Machine, command: &str) -> Page {
        let voltages = self.voltages.iter().map(voltage);
        let residuals = self.identification.residuals.iter().map(histogram);
        let curves = self.estimates.iter();
        let drawn = curves
            .filter(|curve| DRAWN.contains(&curve.filter))
            .map(estimates);
        let blocks = vec![
            Block::text(
                "One run identifies both cells, a second one tunes the covariances of the \
                 filters, and a third one validates them, as in sections 4.3.2.2 and 4.3.2.3 of \
                 the thesis.",
            ),
            Block::Cards(cards(self)),
            Block::heading("Compared with the thesis"),
            Block::Table(thesis(self)),
            Block::heading("Identification"),
            Block::Figure(hysteresis(self)),
            Block::Figures(voltages.collect()),
            Block::Table(coefficients(self)),
            Block::Figures(residuals.collect()),
            Block::heading("Validation"),
            Block::Figures(drawn.collect()),
            Block::Table(validation(self)),
            Block::text(
                "NIS: mean normalised innovation squared of a measurement; NEES: mean normalised \
                 estimation error squared of the force. Both are 1 for a filter whose model and \
                 covariances are right, within the band if samples are independent, which they \
                 are not behind a low-pass filter.",
            ),
            Block::heading("Tuned filters"),
            Block::text(
                "Particle swarms, three of them for F2, minimise −ln O of eq. 4.19 over the \
                 deviations that a millisecond adds to the states and the noise of the \
                 piezoelectric voltage. Estimates do not change if all variances have the same \
                 factor, so the piezoresistive noise is that of the identification.",
            ),
            Block::Table(tuning(self)),
            Block::text("Ready for a tactile bus of a scenario:"),
            Block::Code(self.settings()),
        ];
        Page {
            kind: "Study of load filters".to_owned(),
            title: format!("Identification, tuning and validation: {}", self.scenario),
            headline: self.headline(),
            blocks,
            terms: self.terms(machine, command),
        }
    }

    fn terms(&self, machine: &Machine, command: &str) -> Vec<Term> {
        let low_pass = "all channels, the reference included, are behind the thesis' Butterworth \
                        filter of 10 Hz and fourth order: forwards and backwards for the \
                        identification, causal for tuning and validation, where truth and \
                        estimate are late by its 42 ms";
        let [first, second, third] = self.seeds;
        let seeds = format!("{first} identifies, {second} tunes, {third} validates");
        let definitions = vec![
            Term::text("low-pass filter", low_pass),
            Term::text("seeds", seeds),
        ];
        let budget = Budgeted {
            cut: self.cut().map(str::to_owned).collect(),
            budget_s: self.budget_s,
        };
        timed_reproduction(
            machine,
            command,
            &self.file,
            definitions,
            &self.left_out,
            (&self.starts, &budget),
        )
    }
}

fn cards(study: &EstimateStudy) -> Vec<Card> {
    let card = |kind: FilterKind| {
        let row = study.row(kind.name(), None)?;
        Some(Card::new(
            format!("{}: force, RMS error", kind.name()),
            format!("{} N", plain(row.force_rmse_n)),
            kind.about().to_owned(),
        ))
    };
    FilterKind::ALL.into_iter().filter_map(card).collect()
}

fn thesis(study: &EstimateStudy) -> Table {
    let mut table = Table::new([
        Column::label("quantity"),
        Column::text("printed"),
        Column::status(""),
        Column::text("ours"),
        Column::reason().only_on_pages(),
    ]);
    for figure in study.printed() {
        let tone = match figure.verdict {
            Verdict::Holds => Tone::Good,
            Verdict::Differs => Tone::Bad,
            Verdict::Unknown => Tone::Faint,
        };
        table.row([
            figure.what.into(),
            figure.printed.into(),
            Cell::from(figure.verdict.word()).with_tone(tone),
            figure.ours.into(),
            figure.why.into(),
        ]);
    }
    table
}

fn hysteresis(study: &EstimateStudy) -> Figure {
    let points = &study.loop_points;
    let measured = |rising: bool| {
        let points = points.iter().filter(|point| point.rising == rising);
        Shape::dots(points.map(|it| [it.force, it.measured]))
    };
    let fitted = Shape::dots(points.iter().map(|it| [it.force, it.fitted]));
    let series = [(0, measured(true)), (1, measured(false)), (2, fitted)];
    let plot = LinePlot {
        title: "voltage of the piezoresistive cell over the force".to_owned(),
        width: 1080.0,
        height: 460.0,
        x: AxisLabel::in_unit("force", "N"),
        y: AxisLabel::in_unit("voltage", "V"),
        series: series
            .map(|(number, shape)| Series { number, shape })
            .into(),
    };
    let caption = format!(
        "Figure 4.11: the piezoresistive cell with the sigmoids of eq. 4.21, one period of each \
         frequency. R² {:.5}; the thesis has 0.995.",
        study.identification.hysteresis.r_squared
    );
    let legend = vec![
        (Swatch::Curve(0), "rising force".to_owned()),
        (Swatch::Curve(1), "falling force".to_owned()),
        (Swatch::Curve(2), "fitted".to_owned()),
    ];
    Figure {
        heading: "Piezoresistive cell".to_owned(),
        legend,
        drawing: plot.drawing(),
        caption,
    }
}

fn voltage(curve: &VoltageCurve) -> Figure {
    let line = |of: fn(&VoltagePoint) -> f64| -> Vec<[f64; 2]> {
        let points = curve.points.iter();
        points.map(|point| [point.at_s, of(point)]).collect()
    };
    let series = [
        (0, Shape::Line(line(|it| it.measured))),
        (3, Shape::Dashed(line(|it| it.rate_sensor))),
        (1, Shape::Dashed(line(|it| it.coefficients))),
        (2, Shape::Dashed(line(|it| it.amplifier))),
    ];
    let plot = LinePlot {
        title: format!("piezoelectric voltage at {} Hz", curve.hz),
        width: 540.0,
        height: 340.0,
        x: AxisLabel::in_unit("time", "s"),
        y: AxisLabel::in_unit("voltage", "V"),
        series: series
            .map(|(number, shape)| Series { number, shape })
            .into(),
    };
    let legend = vec![
        (Swatch::Curve(0), "measured".to_owned()),
        (Swatch::Dashed(3), "rate alone".to_owned()),
        (Swatch::Dashed(1), "a Ḟ + b F̈".to_owned()),
        (Swatch::Dashed(2), "charge amplifier".to_owned()),
    ];
    let heading = format!("Piezoelectric cell at {} Hz", curve.hz);
    Figure {
        heading,
        legend,
        drawing: plot.drawing(),
        caption: "Figure 4.13.".to_owned(),
    }
}

/// Returns the coefficients of the piezoelectric cell at each frequency, and its charge amplifier.
fn coefficients(study: &EstimateStudy) -> Table {
    let found = &study.identification;
    let mut table = Table::new([
        Column::label("frequency"),
        Column::number("a").in_unit("V·s/N").with_places(6),
        Column::number("b").in_unit("V·s²/N").with_places(7),
        Column::number("offset")
            .in_unit("V")
            .with_places(5)
            .only_on_pages(),
        Column::number("R²").with_places(6),
    ]);
    for (hz, plane) in found.frequencies.iter().zip(&found.coefficients.runs) {
        let [a, b, offset] = plane.model.map(Cell::from);
        table.row([
            format!("{hz} Hz").into(),
            a,
            b,
            offset,
            plane.r_squared.into(),
        ]);
    }
    let amplifier = &found.amplifier.model.amplifier;
    let times = [amplifier.feedback_s, amplifier.lag_s].map(|time| si(time, "s"));
    table.row([
        "charge amplifier".into(),
        format!("k {}", fixed(amplifier.sensitivity, 6)).into(),
        times.join(", ").into(),
        Cell::empty(),
        found.amplifier.r_squared.into(),
    ]);
    table
}

fn histogram(residuals: &Residuals) -> Figure {
    let millivolts = |value: f64| 1e3 * value;
    let width = match residuals.histogram[..] {
        [[first, _], [second, _], ..] => millivolts(second - first),
        _ => 0.0,
    };
    let bars = residuals.histogram.iter();
    let bars = bars.map(|&[centre, density]| [millivolts(centre), 1e-3 * density]);
    let normal = residuals.histogram.iter().map(|&[centre, _]| {
        let z = (centre - residuals.mean) / residuals.deviation;
        let scale = millivolts(residuals.deviation) * (2.0 * std::f64::consts::PI).sqrt();
        [millivolts(centre), libm::exp(-0.5 * z * z) / scale]
    });
    let series = vec![
        Series {
            number: 0,
            shape: Shape::Bars {
                width,
                points: bars.collect(),
            },
        },
        Series {
            number: 1,
            shape: Shape::Dashed(normal.collect()),
        },
    ];
    let plot = LinePlot {
        title: format!("residuals of {}", residuals.of),
        width: 540.0,
        height: 320.0,
        x: AxisLabel::in_unit("residual", "mV"),
        y: AxisLabel::in_unit("density", "1/mV"),
        series,
    };
    let legend = vec![
        (Swatch::Curve(0), "residuals".to_owned()),
        (
            Swatch::Dashed(1),
            "Gaussian of the same deviation".to_owned(),
        ),
    ];
    let caption = format!(
        "Figure 4.14: skewness {:.2}, excess kurtosis {:.2}: {}.",
        residuals.skewness,
        residuals.excess_kurtosis,
        if residuals.is_gaussian() {
            "about Gaussian"
        } else {
            "not Gaussian"
        }
    );
    Figure {
        heading: residuals.of.to_owned(),
        legend,
        drawing: plot.drawing(),
        caption,
    }
}

fn estimates(curve: &EstimateCurve) -> Figure {
    let points = || curve.points.iter();
    let band = points().map(|it| {
        let spread = SPREAD * it.deviation;
        [it.at_s, it.estimate - spread, it.estimate + spread]
    });
    let estimate = points().map(|it| [it.at_s, it.estimate]).collect();
    let truth = points().map(|it| [it.at_s, it.truth]).collect();
    let series = [
        (1, Shape::Band(band.collect())),
        (0, Shape::Line(truth)),
        (1, Shape::Dashed(estimate)),
    ];
    let plot = LinePlot {
        title: format!("estimate of {} at {} Hz", curve.filter, curve.hz),
        width: 540.0,
        height: 340.0,
        x: AxisLabel::in_unit("time", "s"),
        y: AxisLabel::in_unit("force", "N"),
        series: series
            .map(|(number, shape)| Series { number, shape })
            .into(),
    };
    let legend = vec![
        (Swatch::Curve(0), "truth".to_owned()),
        (Swatch::Dashed(1), "estimate, ± 3σ".to_owned()),
    ];
    let heading = format!("{} at {} Hz", curve.filter, curve.hz);
    Figure {
        heading,
        legend,
        drawing: plot.drawing(),
        caption: "Figure 4.15.".to_owned(),
    }
}

fn validation(study: &EstimateStudy) -> Table {
    let mut table = Table::new([
        Column::label("filter"),
        Column::text("frequency"),
        Column::number("periods").only_on_pages(),
        Column::number("force: RMS").in_unit("N"),
        Column::number("rate: RMS").in_unit("N/s"),
        Column::number("rate, of the truth")
            .in_unit("N/s")
            .only_on_pages(),
        Column::number("maxima").with_places(3),
        Column::number("minima").in_unit("N"),
        Column::number("σ at maxima").in_unit("N"),
        Column::number("at minima").in_unit("N"),
        Column::number("NIS").with_places(3),
        Column::number("95 %").only_on_pages(),
        Column::number("NEES").with_places(3),
        Column::number("95 %").only_on_pages(),
    ]);
    let mut before = "";
    for row in &study.rows {
        let band = |[low, high]: [f64; 2]| format!("{} … {}", fixed(low, 3), fixed(high, 3));
        // Means outside of their band are marked.
        let marked = |value: f64, [low, high]: [f64; 2]| {
            let is_inside = (low..=high).contains(&value);
            let tone = if is_inside {
                Tone::Good
            } else {
                Tone::Doubtful
            };
            Cell::from(value).with_tone(tone)
        };
        table.row([
            row.filter.into(),
            row.hz
                .map_or("all".to_owned(), |hz| format!("{hz} Hz"))
                .into(),
            row.periods.into(),
            row.force_rmse_n.into(),
            row.rate_rmse_n_s.into(),
            row.rate_rms_n_s.into(),
            row.maxima.into(),
            row.minima_n.into(),
            row.deviation_at_maxima_n.into(),
            row.deviation_at_minima_n.into(),
            marked(row.nis, row.nis_band),
            band(row.nis_band).into(),
            marked(row.nees, row.nees_band),
            band(row.nees_band).into(),
        ]);
        if row.filter != before {
            table.begin_group();
        }
        before = row.filter;
    }
    table
}

fn tuning(study: &EstimateStudy) -> Table {
    let mut table = Table::new([
        Column::label("filter"),
        Column::number("−ln O before").with_places(3),
        Column::number("tuned").with_places(3),
        Column::number("evaluations"),
        Column::text(""),
        Column::reason().only_on_pages(),
    ]);
    for filter in &study.filters {
        let why = filter.truncated.then_some("ended by the budget");
        table.row([
            filter.kind.name().into(),
            filter.cost[0].into(),
            filter.cost[1].into(),
            filter.evaluations.into(),
            Cell::from(filter.kind.about()).with_tone(Tone::Faint),
            why.into(),
        ]);
    }
    table
}

//! Page of a study of load filters.

use crate::estimate::{
    EstimateCurve, EstimateStudy, FilterKind, FilterRow, Residuals, Verdict, VoltageCurve,
};
use crate::machine::Machine;
use twinrig_report::number::plain;

use super::{Page, card, drawing, introduction};
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::line_plot::{AxisLabel, LinePlot, Series, Shape};
use twinrig_report::html::marker::swatch;
use twinrig_report::html::table::HtmlTable;

/// Filters that are drawn: the thesis' one, and the one without a frequency.
const DRAWN: [&str; 2] = ["F2", "F3"];
/// Standard deviations of the shaded region.
const SPREAD: f64 = 3.0;

impl EstimateStudy {
    /// Returns the page, with the machine it ran on and the command that repeats it.
    pub fn html(&self, machine: &Machine, command: &str) -> String {
        let low_pass = "all channels, the reference included, are behind the thesis' Butterworth \
                        filter of 10 Hz and fourth order: forwards and backwards for the \
                        identification, causal for tuning and validation, where truth and \
                        estimate are late by its 42 ms";
        let left_out = self.left_out.iter();
        let left_out = left_out.map(|left| ("left out".to_owned(), left.clone()));
        let seeds = format!(
            "{} identifies, {} tunes, {} validates",
            self.seeds[0], self.seeds[1], self.seeds[2]
        );
        let terms = [
            ("low-pass filter".to_owned(), low_pass.to_owned()),
            ("seeds".to_owned(), seeds),
        ];
        Page {
            kind: "load filters",
            title: "Identification, tuning and validation",
            scenario: &self.scenario,
            file: &self.file,
            headline: self.headline(),
            body: body(self),
            terms: terms.into_iter().chain(left_out).collect(),
            cut: self.cut().map(str::to_owned).collect(),
            budget_s: self.budget_s,
        }
        .html(machine, command)
    }
}

fn body(study: &EstimateStudy) -> String {
    let mut out = introduction(
        "One run identifies both cells, a second one tunes the covariances of the filters, and a \
         third one validates them, as in sections 4.3.2.2 and 4.3.2.3 of the thesis.",
    );
    out += &cards(study);
    out += "<h2>The thesis and here</h2>\n";
    out += &thesis(study);
    out += "<h2>Identification</h2>\n";
    out += &hysteresis(study);
    let voltages: String = study.voltages.iter().map(voltage).collect();
    out += &element("div", "pair", &voltages);
    out += &coefficients(study);
    let residuals = study.identification.residuals.iter();
    let histograms: String = residuals.map(histogram).collect();
    out += &element("div", "pair", &histograms);
    out += "<h2>Validation</h2>\n";
    let curves = study.estimates.iter();
    let drawn = curves.filter(|curve| DRAWN.contains(&curve.filter));
    let drawn: String = drawn.map(estimates).collect();
    out += &element("div", "pair", &drawn);
    out += &rows(study);
    out += "<h2>Tuned filters</h2>\n";
    out += &tuned(study);
    out += &element("pre", "", &element("code", "", &escaped(&study.settings())));
    out
}

fn cards(study: &EstimateStudy) -> String {
    let mut out = String::new();
    for kind in FilterKind::ALL {
        if let Some(row) = study.row(kind.name(), None) {
            let value = format!("{} N", plain(row.force_rmse_n));
            out += &card(
                &format!("{}: force, RMS error", kind.name()),
                &value,
                kind.about(),
            );
        }
    }
    element("div", "cards", &out)
}

fn thesis(study: &EstimateStudy) -> String {
    let mut table = HtmlTable::new("quantity | printed | ours | | why", 4);
    for figure in study.printed() {
        let class = match figure.verdict {
            Verdict::Holds => "tag ok",
            Verdict::Differs => "tag bad",
            Verdict::Unknown => "tag",
        };
        table.row(
            "",
            vec![
                element("span", "wrap", &escaped(&figure.what)),
                escaped(&figure.printed),
                element("span", "wrap", &escaped(&figure.ours)),
                element("span", class, figure.verdict.word()),
                element("span", "why", &escaped(&figure.why)),
            ],
        );
    }
    table.html()
}

fn entry(number: usize, dashed: bool, text: &str) -> (String, String) {
    (swatch(number, dashed), text.to_owned())
}

fn hysteresis(study: &EstimateStudy) -> String {
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
    let entries = [
        entry(0, false, "rising force"),
        entry(1, false, "falling force"),
        entry(2, false, "fitted"),
    ];
    drawing("Piezoresistive cell", &entries, &plot.svg(), &caption)
}

fn voltage(curve: &VoltageCurve) -> String {
    let line = |of: fn(&crate::estimate::VoltagePoint) -> f64| -> Vec<[f64; 2]> {
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
    let entries = [
        entry(0, false, "measured"),
        entry(3, true, "rate alone"),
        entry(1, true, "a Ḟ + b F̈"),
        entry(2, true, "charge amplifier"),
    ];
    let heading = format!("Piezoelectric cell at {} Hz", curve.hz);
    drawing(&heading, &entries, &plot.svg(), "Figure 4.13.")
}

fn coefficients(study: &EstimateStudy) -> String {
    let found = &study.identification;
    let mut table = HtmlTable::new("frequency | a [V·s/N] | b [V·s²/N] | offset [V] | R²", 0);
    for (hz, plane) in found.frequencies.iter().zip(&found.coefficients.runs) {
        let [a, b, offset] = plane.model;
        table.row(
            "",
            vec![
                format!("{hz} Hz"),
                format!("{a:.6}"),
                format!("{b:.7}"),
                format!("{offset:.5}"),
                format!("{:.6}", plane.r_squared),
            ],
        );
    }
    let amplifier = &found.amplifier.model.amplifier;
    table.html()
        + &paragraph(&format!(
            "Charge amplifier: k = {} V·s/N, T₁ = {} ms, T₂ = {} ms, R² {:.6}.",
            plain(amplifier.sensitivity),
            plain(1e3 * amplifier.feedback_s),
            plain(1e3 * amplifier.lag_s),
            found.amplifier.r_squared
        ))
}

fn histogram(residuals: &Residuals) -> String {
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
    let entries = [
        entry(0, false, "residuals"),
        entry(1, true, "Gaussian of the same deviation"),
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
    drawing(residuals.of, &entries, &plot.svg(), &caption)
}

fn estimates(curve: &EstimateCurve) -> String {
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
    let entries = [entry(0, false, "truth"), entry(1, true, "estimate, ± 3σ")];
    let heading = format!("{} at {} Hz", curve.filter, curve.hz);
    drawing(&heading, &entries, &plot.svg(), "Figure 4.15.")
}

fn rows(study: &EstimateStudy) -> String {
    let mut table = HtmlTable::new(
        "filter | frequency | periods | force, RMS error | rate, RMS error | rate, RMS \
         | maxima, of the truth's | minima, error | deviation at maxima | at minima \
         | NIS | 95 % | NEES | 95 %",
        1,
    );
    let mut before: Option<&FilterRow> = None;
    let band = |band: [f64; 2]| format!("{:.3}–{:.3}", band[0], band[1]);
    for row in &study.rows {
        let first = before.is_some_and(|before| before.filter != row.filter);
        table.row(
            if first { "first" } else { "" },
            vec![
                element("b", "", row.filter),
                row.hz
                    .map_or_else(|| "all".to_owned(), |hz| format!("{hz} Hz")),
                row.periods.to_string(),
                format!("{} N", plain(row.force_rmse_n)),
                format!("{} N/s", plain(row.rate_rmse_n_s)),
                format!("{} N/s", plain(row.rate_rms_n_s)),
                format!("{:.3}", row.maxima),
                format!("{} N", plain(row.minima_n)),
                format!("{} N", plain(row.deviation_at_maxima_n)),
                format!("{} N", plain(row.deviation_at_minima_n)),
                plain(row.nis),
                band(row.nis_band),
                plain(row.nees),
                band(row.nees_band),
            ],
        );
        before = Some(row);
    }
    table.html()
        + &paragraph(
            "NIS: mean normalised innovation squared of a measurement; NEES: mean normalised \
             estimation error squared of the force. Both are 1 for a filter whose model and \
             covariances are right, within the band if samples are independent, which they are \
             not behind a low-pass filter.",
        )
}

fn tuned(study: &EstimateStudy) -> String {
    let mut table = HtmlTable::new("filter | − ln O before | tuned | evaluations | ", 1);
    for filter in &study.filters {
        let note = if filter.truncated {
            element("span", "why", "ended by the budget")
        } else {
            String::new()
        };
        table.row(
            "",
            vec![
                element("b", "", filter.kind.name()),
                plain(filter.cost[0]),
                plain(filter.cost[1]),
                filter.evaluations.to_string(),
                note,
            ],
        );
    }
    paragraph(
        "Particle swarms, three of them for F2, minimise −ln O of eq. 4.19 over the deviations that \
         a millisecond adds to the states and the noise of the piezoelectric voltage. Estimates do \
         not change if all variances have the same factor, so the piezoresistive noise is that of \
         the identification. Ready for a tactile bus of a scenario:",
    ) + &table.html()
}

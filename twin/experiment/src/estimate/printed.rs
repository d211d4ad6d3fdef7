//! Figures of the thesis beside those found here.

use serde::Serialize;

use super::distribution::Residuals;
use super::filter::FilterKind;
use super::results::EstimateStudy;
use twinrig_report::number::plain;

/// Comparison with a figure of the thesis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PrintedFigure {
    /// Quantity.
    pub what: String,
    /// As printed.
    pub printed: String,
    /// As found here.
    pub ours: String,
    /// Comparison.
    pub verdict: Verdict,
    /// Reason of a difference, or of the agreement.
    pub why: String,
}

/// Comparison of a printed figure with ours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The printed statement holds here, too.
    Holds,
    /// It does not.
    Differs,
    /// The thesis prints no number, or it was not measured here.
    Unknown,
}

impl Verdict {
    fn of(holds: Option<bool>) -> Self {
        match holds {
            Some(true) => Self::Holds,
            Some(false) => Self::Differs,
            None => Self::Unknown,
        }
    }

    /// Word for tables.
    pub fn word(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::Differs => "differs",
            Self::Unknown => "–",
        }
    }
}

/// R² of the hysteresis (figure 4.11) and of the piezoelectric cell (figure 4.13).
const HYSTERESIS: f64 = 0.995;
const PIEZOELECTRIC: f64 = 0.9997;
/// Unexplained variance over the printed one up to which a fit is as good.
const AS_GOOD: f64 = 2.0;
/// Load at which the piezoresistive cell saturates \[N\] (section 4.3.2.2), and the share of it by
/// which ours may differ: the thesis says "around".
const SATURATION: f64 = 10.0;
const AROUND: f64 = 0.2;
/// Share of a maximum below which it counts as right: that of the resolution of figure 4.15.
const RIGHT: f64 = 0.01;

/// The filter of figure 4.15: the thesis' second one.
const THEIRS: &str = "F2";

impl EstimateStudy {
    /// Returns the figures of the thesis beside those found here.
    pub fn printed(&self) -> Vec<PrintedFigure> {
        let mut figures = of_cells(self);
        figures.extend(of_filters(self));
        figures
    }

    /// Returns sentences on the thesis' observations about figure 4.15.
    pub(super) fn observations(&self) -> Vec<String> {
        let mut sentences = Vec::new();
        for (hz, word) in [(1.0, "too low"), (2.5, "too high")] {
            let Some(row) = self.row(THEIRS, Some(hz)) else {
                continue;
            };
            let excess = row.maxima - 1.0;
            let holds = if hz < 2.0 {
                excess < -RIGHT
            } else {
                excess > RIGHT
            };
            sentences.push(format!(
                "Maxima of {THEIRS} at {hz} Hz: {:+.1} % ({word} in the thesis: {}).",
                100.0 * excess,
                if holds { "holds" } else { "does not hold" }
            ));
        }
        if let Some(row) = self.row(THEIRS, None) {
            let holds = row.deviation_at_maxima_n > row.deviation_at_minima_n;
            sentences.push(format!(
                "The spread is largest at the maxima, as in the thesis: {}.",
                if holds { "holds" } else { "does not hold" }
            ));
        }
        sentences
    }
}

fn figure(
    what: &str,
    printed: &str,
    ours: String,
    holds: Option<bool>,
    why: &str,
) -> PrintedFigure {
    PrintedFigure {
        what: what.to_owned(),
        printed: printed.to_owned(),
        ours,
        verdict: Verdict::of(holds),
        why: why.to_owned(),
    }
}

/// Returns whether a fit leaves at most [`AS_GOOD`] times as much unexplained as the printed one.
fn is_as_good(r_squared: f64, printed: f64) -> bool {
    1.0 - r_squared <= AS_GOOD * (1.0 - printed)
}

fn of_cells(study: &EstimateStudy) -> Vec<PrintedFigure> {
    let found = &study.identification;
    let r_squared = |value: f64| format!("{value:.5}");
    // Where the tangent in the middle meets the upper asymptote.
    let branches = [
        &found.hysteresis.model.loading,
        &found.hysteresis.model.unloading,
    ];
    let [up, down] = branches.map(|it| -it.c + 2.0 / it.b.abs());
    let saturates = |force: f64| (force - SATURATION).abs() <= AROUND * SATURATION;
    let (rate, acceleration) = (&found.coefficients.rate, &found.coefficients.acceleration);
    let gaussian = found.residuals.iter().any(Residuals::is_gaussian);
    let moments: Vec<String> = found
        .residuals
        .iter()
        .map(|it| format!("{:.2} and {:.2}", it.skewness, it.excess_kurtosis))
        .collect();
    vec![
        figure(
            "R² of the hysteresis (fig. 4.11)",
            "0.995",
            r_squared(found.hysteresis.r_squared),
            Some(is_as_good(found.hysteresis.r_squared, HYSTERESIS)),
            "the form is that of the cell; what it cannot explain is creep in the course of the run, \
             and the low-pass filter, behind which a curve is no longer one",
        ),
        figure(
            "saturation under a dynamic load (fig. 4.11)",
            "around 10 N",
            format!("{up:.1} N rising, {down:.1} N falling"),
            Some(saturates(up) && saturates(down)),
            "where the tangent in the middle of a sigmoid meets its upper end",
        ),
        figure(
            "piezoelectric voltage in proportion to the rate alone (fig. 4.13)",
            "no direct relation",
            format!("R² {}", r_squared(found.rate_sensor.r_squared)),
            Some(found.rate_sensor.r_squared < HYSTERESIS),
            "the charge amplifier turns the phase, the more the higher the frequency",
        ),
        figure(
            "R² of a Ḟ + b F̈ (fig. 4.13)",
            "0.9997",
            format!(
                "{}; {} with exponentials",
                r_squared(found.planes_r_squared),
                r_squared(found.exponentials_r_squared)
            ),
            Some(is_as_good(found.planes_r_squared, PIEZOELECTRIC)),
            "a and b of one frequency are exact for a sine; the rest is harmonics, as of scratches. \
             The coefficients of a charge amplifier are no exponentials",
        ),
        figure(
            "a and b fall exponentially with the frequency",
            "no coefficients",
            format!(
                "a {} V·s/N, {:.2} Hz, R² {:.4}; b {} V·s²/N, {:.2} Hz, R² {:.4}",
                plain(rate.model.value),
                rate.model.scale_hz,
                rate.r_squared,
                plain(acceleration.model.value),
                acceleration.model.scale_hz,
                acceleration.r_squared
            ),
            None,
            "value at 0 Hz and frequency at which it has fallen to 1/e",
        ),
        figure(
            "residuals (fig. 4.14)",
            "not Gaussian",
            format!("skewness and excess kurtosis {}", moments.join("; ")),
            Some(!gaussian),
            "hysteresis, a and b, amplifier; errors of a model repeat with the period",
        ),
    ]
}

fn of_filters(study: &EstimateStudy) -> Vec<PrintedFigure> {
    let mut figures = Vec::new();
    for (hz, low) in [(1.0, true), (2.5, false)] {
        let row = study.row(THEIRS, Some(hz));
        let all = FilterKind::ALL.into_iter().filter(|kind| kind.is_fused());
        let maxima = |kind: FilterKind| {
            let maxima = study.row(kind.name(), Some(hz))?.maxima;
            Some(format!("{} {maxima:.3}", kind.name()))
        };
        let ours: Vec<String> = all.filter_map(maxima).collect();
        figures.push(figure(
            &format!("maxima at {hz} Hz, over those of the truth (fig. 4.15)"),
            if low { "too low" } else { "too high" },
            ours.join(", "),
            row.map(|row| {
                if low {
                    row.maxima < 1.0 - RIGHT
                } else {
                    row.maxima > 1.0 + RIGHT
                }
            }),
            "judged by F2, the thesis' filter; above saturation its force is integrated from the \
             piezoelectric voltage, whose coefficients hold at the frequency only where the \
             exponentials do",
        ));
    }
    let all = study.row(THEIRS, None);
    figures.push(figure(
        "standard deviation of the estimate (fig. 4.15)",
        "largest at the maxima",
        all.map_or_else(String::new, |row| {
            format!(
                "{} N at the maxima, {} N at the minima",
                plain(row.deviation_at_maxima_n),
                plain(row.deviation_at_minima_n)
            )
        }),
        all.map(|row| row.deviation_at_maxima_n > row.deviation_at_minima_n),
        "in saturation the piezoresistive cell adds nothing",
    ));
    figures.push(figure(
        "estimated rate (fig. 4.15)",
        "poor",
        all.map_or_else(String::new, |row| {
            let share = 100.0 * row.rate_rmse_n_s / row.rate_rms_n_s;
            format!("error {share:.0} % of the rate, RMS")
        }),
        None,
        "RMS error of F2 over the RMS of the true rate",
    ));
    figures.extend(variances(study));
    figures
}

/// Ratio of the measurement variances that the search chose.
fn variances(study: &EstimateStudy) -> Option<PrintedFigure> {
    let filter = study
        .filters
        .iter()
        .find(|filter| filter.kind.name() == THEIRS)?;
    let resistive = filter.settings.piezoresistive?.variance;
    let ratio = filter.settings.piezoelectric? / resistive;
    let magnitude = libm::log10(ratio);
    Some(figure(
        "piezoelectric over piezoresistive variance",
        "3 orders of magnitude",
        format!("{magnitude:.1} orders of magnitude"),
        Some((magnitude - 3.0).abs() <= 1.0),
        "a search trusts the cell whose model is right: the simulated piezoelectric one, the \
         piezoresistive one of the thesis, which met the reverse in particles of less fitness",
    ))
}

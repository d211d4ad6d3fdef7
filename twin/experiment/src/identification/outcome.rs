//! Result of a fit.

use serde::Serialize;
use twinrig_campaign::identification::FittedDistribution;

/// Result of a fit; a function of recordings, search space, scenario and build.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FitOutcome {
    /// Name of the fit.
    pub name: String,
    /// File of the search space.
    pub space: String,
    /// Scenario of the twin.
    pub scenario: String,
    /// Build of the program.
    pub build: String,
    /// Fitted parameters, in the order of the search space.
    pub parameters: Vec<FittedParameter>,
    /// Pairs of parameters with a correlation beyond ±0.9.
    pub correlations: Vec<Correlation>,
    /// Directions that the data cannot tell.
    pub unknown: Vec<UnknownDirection>,
    /// Values that the recordings state of the file of robot or bench, with their ranges.
    pub data: Vec<DataRange>,
    /// Residuals of each recording.
    pub recordings: Vec<RecordingResidual>,
    /// Distribution of the parameters.
    #[serde(skip)]
    pub distribution: FittedDistribution,
    /// Residuals of recordings that were not fitted, but predicted.
    pub validation: Vec<RecordingResidual>,
    /// Residuals of recordings that were left out in turn; empty without cross-validation.
    pub held_out: Vec<HeldOut>,
    /// Standard deviation of a residual over the assumed one.
    pub deviation: f64,
    /// Samples over the number of independent ones (integrated autocorrelation time); 1 of white
    /// residuals.
    pub correlation_time: f64,
    /// Samples.
    pub samples: usize,
    /// Bayesian information criterion, with the independent samples: less is better.
    pub bic: f64,
    /// Steps of least squares.
    pub steps: usize,
    /// Whether the last one was small enough.
    pub converged: bool,
    /// Evaluations of the searches.
    pub searched: u64,
    /// Mean cost of a residual at the minimum of each search, the least first.
    pub minima: Vec<f64>,
    /// Least mean cost of a residual on the profiles; below the least of `minima`, that is a local
    /// one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile_cost: Option<f64>,
    /// Notes of the store of searches.
    #[serde(skip)]
    pub notes: Vec<String>,
}

/// Range of a value in the recordings.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DataRange {
    /// Dotted key of the file of robot or bench.
    pub key: String,
    /// Least and greatest value, in TOML.
    pub ends: [String; 2],
}

/// A fitted parameter, in SI units.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FittedParameter {
    /// Dotted key.
    pub key: String,
    /// Symbol of the unit.
    pub unit: String,
    /// Estimate.
    pub estimate: f64,
    /// The same in TOML, as it is set.
    pub toml: String,
    /// Bounds of the search.
    pub range: [f64; 2],
    /// Interval with a confidence of 95 %; none where the data do not tell the parameter, or where
    /// it is at a bound.
    pub interval: Option<[f64; 2]>,
    /// Bounds of the interval of 95 % by the profile likelihood, each none beyond the range; only
    /// if it was asked for, and not at a bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<[Option<f64>; 2]>,
    /// Whether it is at a bound of its range.
    pub at_bound: bool,
}

/// Correlation of two parameters.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correlation {
    /// Their keys.
    pub keys: [String; 2],
    /// Correlation, −1 to 1.
    pub correlation: f64,
}

/// A direction in the space of the parameters that the data cannot tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UnknownDirection {
    /// Keys with their parts in it, the largest first: shares of their ranges.
    pub parts: Vec<(String, f64)>,
}

/// Residuals of a recording, of one signal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordingResidual {
    /// Name of the recording.
    pub recording: String,
    /// BLAKE3 hash of its file.
    pub hash: String,
    /// Compared signal.
    pub signal: String,
    /// Symbol of the unit.
    pub unit: String,
    /// Samples.
    pub samples: usize,
    /// Mean absolute residual.
    pub mean_absolute: f64,
    /// The same with the values of the files; none where the twin fails with them.
    pub unfitted: Option<f64>,
    /// Root mean square of the residuals.
    pub rms: f64,
    /// Greatest residual.
    pub worst: f64,
    /// Corrupted readings, which are not compared.
    pub spikes: usize,
    /// Time \[s\], recorded value and that of the twin, for plots.
    #[serde(skip)]
    pub curve: Vec<[f64; 3]>,
}

/// Recordings that the other ones predict.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldOut {
    /// Residuals of the recordings that were left out.
    pub residuals: Vec<RecordingResidual>,
    /// Parameters fitted to the others, in the order of the search space \[SI\].
    pub estimates: Vec<f64>,
}

impl FitOutcome {
    /// Returns the mean of the mean absolute residuals of recordings left out in turn, and the
    /// greatest of them, for a signal; none without cross-validation.
    pub fn held_out_error(&self, signal: &str) -> Option<[f64; 2]> {
        let residuals = self.held_out.iter().flat_map(|held| &held.residuals);
        error_of(residuals, signal)
    }

    /// Returns the same of the recordings fitted.
    pub fn fitted_error(&self, signal: &str) -> Option<[f64; 2]> {
        error_of(self.recordings.iter(), signal)
    }
}

/// Returns the mean of the mean absolute residuals of a signal, and the greatest of them.
pub(super) fn error_of<'r>(
    residuals: impl Iterator<Item = &'r RecordingResidual>,
    signal: &str,
) -> Option<[f64; 2]> {
    let errors: Vec<f64> = residuals
        .filter(|it| it.signal == signal)
        .map(|it| it.mean_absolute)
        .collect();
    let sum: f64 = errors.iter().sum();
    (!errors.is_empty()).then(|| {
        let worst = errors.iter().copied().fold(0.0, f64::max);
        [sum / errors.len() as f64, worst]
    })
}

//! Execution of a fit.

use std::path::PathBuf;

use twinrig_campaign::identification::FitSpace;
use twinrig_campaign::least_squares::{Information, LeastSquares, Loss, Minimum};
use twinrig_campaign::search::{CmaEs, Dimension};
use twinrig_campaign::sweep::SweepValue;
use twinrig_document::Document;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::registry::Registry;
use twinrig_runtime::{Plant, interrupt};
use twinrig_scenario::Setting;

use super::data::FitData;
use super::outcome::{
    Correlation, FitOutcome, FittedParameter, HeldOut, RecordingResidual, UnknownDirection,
};
use super::twin::Twin;
use crate::error::{Error, FitError};

/// A fit to be done.
#[derive(Clone, Debug)]
pub struct FitRequest {
    /// Recordings.
    pub recordings: Vec<PathBuf>,
    /// File of the search space.
    pub space: PathBuf,
    /// Settings of all runs.
    pub settings: Vec<Setting>,
    /// Whether recordings are left out in turn.
    pub cross_validate: bool,
    /// Threads.
    pub threads: usize,
}

/// State of a running fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitProgress {
    /// Fits done: one of all recordings, then one without each.
    pub fits: usize,
    /// Fits in total.
    pub of: usize,
    /// Generations of the search, or steps of least squares.
    pub done: usize,
    /// Whether they are steps.
    pub is_solving: bool,
    /// Mean cost of a residual.
    pub cost: f64,
}

/// Residual of a sample without a result of the twin, in standard deviations.
const NO_RESULT: f64 = 1e6;
/// Greatest step of differences, as a share of a range.
const DIFFERENCE: f64 = 0.02;
/// Step at which least squares end, as a share of a range: far below any interval.
const TOLERANCE: f64 = 1e-5;
/// Quantile of the normal distribution for a confidence of 95 %.
const NORMAL_95: f64 = 1.959_964;
/// Standard deviation of CMA-ES at which it ends: least squares do the rest.
const SEARCHED: f64 = 1e-3;

/// Fits the parameters of a search space to recordings. `observer` is called after each generation
/// and step, and returns whether to continue.
///
/// # Errors
/// [`Error`] if files cannot be read, signals are missing, or after an interrupt.
pub fn fit(
    registry: &Registry,
    request: &FitRequest,
    observer: &mut dyn FnMut(FitProgress) -> bool,
) -> Result<FitOutcome, Error> {
    let space = FitSpace::read(&Document::read(&request.space)?)?;
    let twin = Twin::new(registry, &space, &request.settings)?;
    let middle = vec![0.5; space.dimensions.len()];
    let plain = twin.of_recording(&[])?;
    let inputs = Twin::inputs(&*plant_at(&space, &twin, &plain, &middle)?);
    let mut data: Vec<Recorded<'_>> = Vec::new();
    for path in &request.recordings {
        let read = FitData::read(path, &space, &inputs)?;
        if data.iter().any(|other| other.data.hash == read.hash) {
            return Err(FitError::Twice(read.file).into());
        }
        // Errors of settings and ranges are reported before the search.
        let assembly = twin.of_recording(&read.settings)?;
        for (index, end) in (0..middle.len()).flat_map(|index| [(index, 0.0), (index, 1.0)]) {
            let mut point = middle.clone();
            point[index] = end;
            plant_at(&space, &twin, &assembly, &point)?;
        }
        let mut plant = plant_at(&space, &twin, &assembly, &middle)?;
        twin.play(&read, &mut *plant)?;
        data.push(Recorded {
            data: read,
            assembly,
        });
    }
    let all: Vec<&Recorded<'_>> = data.iter().collect();
    let samples: usize = all.iter().map(|it| it.data.samples()).sum();
    if samples <= space.dimensions.len() {
        let parameters = space.dimensions.len();
        return Err(FitError::TooFewSamples {
            samples,
            parameters,
        }
        .into());
    }
    let folds = if request.cross_validate && all.len() > 1 {
        all.len()
    } else {
        0
    };
    let mut fitter = Fitter {
        build: registry.build()?.to_string(),
        space: &space,
        twin: &twin,
        threads: request.threads,
        progress: FitProgress {
            fits: 0,
            of: 1 + folds,
            done: 0,
            is_solving: false,
            cost: f64::INFINITY,
        },
        observer,
    };
    let (minimum, searched) = fitter.fit(&all)?;
    let mut outcome = fitter.outcome(&all, &minimum, searched);
    for left_out in 0..folds {
        fitter.progress.fits += 1;
        let others: Vec<&Recorded<'_>> = all
            .iter()
            .enumerate()
            .filter_map(|(index, it)| (index != left_out).then_some(*it))
            .collect();
        let (minimum, _) = fitter.fit(&others)?;
        outcome.held_out.push(HeldOut {
            residuals: fitter.residuals_of(all[left_out], &minimum.point),
            estimates: estimates(&space, &minimum.point),
        });
    }
    Ok(outcome)
}

/// A recording with its twin.
struct Recorded<'r> {
    data: FitData,
    assembly: Assembly<'r>,
}

fn estimates(space: &FitSpace, point: &[f64]) -> Vec<f64> {
    let values = space.values(point).into_iter();
    values
        .map(|value| value.number.unwrap_or(f64::NAN))
        .collect()
}

struct Fitter<'a, 'o> {
    build: String,
    space: &'a FitSpace,
    twin: &'a Twin<'a>,
    threads: usize,
    progress: FitProgress,
    observer: &'o mut dyn FnMut(FitProgress) -> bool,
}

impl Fitter<'_, '_> {
    fn settings(&self) -> LeastSquares {
        LeastSquares {
            loss: self.space.huber.map_or(Loss::Square, Loss::Huber),
            iterations: self.space.steps,
            tolerance: TOLERANCE,
            difference: DIFFERENCE,
            threads: self.threads,
        }
    }

    /// Fits the parameters to some recordings; returns the minimum, and the evaluations of the
    /// search of its start.
    fn fit(&mut self, data: &[&Recorded<'_>]) -> Result<(Minimum, u64), Error> {
        let settings = self.settings();
        let (space, twin) = (self.space, self.twin);
        let model = |point: &[f64]| residuals(space, twin, data, point);
        let count = space.dimensions.len();
        let samples: usize = data.iter().map(|it| it.data.samples()).sum();
        let (observer, mut progress) = (&mut *self.observer, self.progress);
        let mut searched = 0;
        let start = if space.generations == 0 {
            vec![0.5; count]
        } else {
            let search = CmaEs {
                dimensions: vec![Dimension::linear(0.0, 1.0); count],
                population: space.particles,
                iterations: space.generations,
                restarts: 0,
                tolerance: SEARCHED,
                seed: space.seed,
                threads: self.threads,
            };
            let cost = |point: &[f64]| {
                let found = model(point);
                found.map_or(f64::INFINITY, |residuals| settings.cost(&residuals))
            };
            let found = search.minimise(&cost, &mut |it| {
                progress.done = it.iteration;
                progress.is_solving = false;
                progress.cost = it.cost / samples as f64;
                observer(progress)
            })?;
            searched = found.evaluations;
            found.best
        };
        let minimum = settings.minimise(&model, &start, &mut |step| {
            progress.done = step.iteration;
            progress.is_solving = true;
            progress.cost = step.cost / samples as f64;
            observer(progress)
        });
        Ok((minimum.map_err(FitError::from)?, searched))
    }

    /// Returns the residuals of a recording in the units of its signals.
    fn residuals_of(&self, recorded: &Recorded<'_>, point: &[f64]) -> Vec<RecordingResidual> {
        let scaled = of_recording(self.space, self.twin, recorded, point);
        let data = &recorded.data;
        let mut rest = scaled.as_slice();
        let signals = data.compared.iter().zip(&self.space.residuals);
        signals
            .map(|(signal, spec)| {
                let (own, behind) = rest.split_at(signal.times.len());
                rest = behind;
                let count = own.len().max(1) as f64;
                let absolute = own.iter().map(|it| it.abs() * signal.deviation);
                let squares: f64 = own.iter().map(|it| it * it).sum();
                RecordingResidual {
                    recording: data.name.clone(),
                    hash: data.hash.clone(),
                    signal: spec.signal.value.clone(),
                    unit: signal.unit.clone(),
                    samples: own.len(),
                    mean_absolute: absolute.clone().sum::<f64>() / count,
                    rms: (squares / count).sqrt() * signal.deviation,
                    worst: absolute.fold(0.0, f64::max),
                }
            })
            .collect()
    }

    fn outcome(&self, data: &[&Recorded<'_>], minimum: &Minimum, searched: u64) -> FitOutcome {
        let space = self.space;
        let series = data.iter().flat_map(|it| &it.data.compared);
        let mut series: Vec<usize> = series.map(|signal| signal.times.len()).collect();
        series.extend(std::iter::repeat_n(1, space.priors.len()));
        let information = Information::of(&self.settings(), minimum, &series);
        let parameters: Vec<FittedParameter> = (0..space.dimensions.len())
            .map(|index| parameter(space, minimum, &information, index))
            .collect();
        let key = |index: usize| space.dimensions[index].key.value.clone();
        let mut correlations = Vec::new();
        for one in 0..parameters.len() {
            for other in one + 1..parameters.len() {
                let correlation = information.correlation(one, other);
                if correlation.abs() > 0.9 {
                    correlations.push(Correlation {
                        keys: [key(one), key(other)],
                        correlation,
                    });
                }
            }
        }
        let unknown = information.directions.iter().filter(|it| !it.is_known());
        let unknown = unknown.map(|direction| {
            let mut parts: Vec<(String, f64)> = direction
                .vector
                .iter()
                .enumerate()
                .filter(|(_, share)| share.abs() > 0.1)
                .map(|(index, share)| (key(index), *share))
                .collect();
            parts.sort_by(|one, other| other.1.abs().total_cmp(&one.1.abs()));
            UnknownDirection { parts }
        });
        let samples = minimum.residuals.len();
        let free = information.free.iter().filter(|free| **free).count() as f64;
        let independent = samples as f64 / information.correlation_time;
        FitOutcome {
            name: space.name.clone(),
            space: space.file.clone(),
            scenario: self.twin.scenario().to_owned(),
            build: self.build.clone(),
            correlations,
            unknown: unknown.collect(),
            recordings: data
                .iter()
                .flat_map(|it| self.residuals_of(it, &minimum.point))
                .collect(),
            held_out: Vec::new(),
            deviation: information.variance.sqrt(),
            correlation_time: information.correlation_time,
            samples,
            bic: independent * libm::log(information.variance) + free * libm::log(independent),
            steps: minimum.iterations,
            converged: minimum.converged,
            searched,
            parameters,
        }
    }
}

/// Returns a parameter with its interval: of a logarithmic one, with bounds in a ratio to it.
fn parameter(
    space: &FitSpace,
    minimum: &Minimum,
    information: &Information,
    index: usize,
) -> FittedParameter {
    let dimension = &space.dimensions[index];
    let value = &space.values(&minimum.point)[index];
    let (share, interval) = (minimum.point[index], &dimension.interval);
    let deviation = information.deviation(index);
    let reach = NORMAL_95 * deviation;
    let is_known = information.free[index] && reach.is_finite();
    // Beyond the range, in its own scale.
    let at = |share: f64| {
        if interval.logarithmic {
            interval.from * libm::exp(share * libm::log(interval.to / interval.from))
        } else {
            interval.from + share * (interval.to - interval.from)
        }
    };
    // An interval tells no more digits.
    let estimate = value.number.unwrap_or(f64::NAN);
    let estimate: f64 = format!("{estimate:.5e}").parse().unwrap_or(estimate);
    FittedParameter {
        key: dimension.key.value.clone(),
        unit: interval.unit.symbol().to_owned(),
        estimate,
        toml: SweepValue::quantity(estimate, interval.unit).toml,
        range: [interval.from, interval.to],
        interval: is_known.then(|| [at(share - reach), at(share + reach)]),
        at_bound: !information.free[index],
    }
}

/// Builds the plant of a recording at shares of the ranges.
fn plant_at<'r>(
    space: &FitSpace,
    twin: &Twin<'r>,
    assembly: &Assembly<'r>,
    point: &[f64],
) -> Result<Box<dyn Plant>, Error> {
    let values = space.values(point);
    let keys = space.dimensions.iter().map(|it| it.key.value.as_str());
    let point: Vec<_> = keys.zip(values.iter().map(|it| it.toml.as_str())).collect();
    twin.plant(assembly, &point)
}

/// Returns the residuals of all recordings and priors, in standard deviations.
fn residuals(
    space: &FitSpace,
    twin: &Twin<'_>,
    data: &[&Recorded<'_>],
    point: &[f64],
) -> Option<Vec<f64>> {
    let mut all = Vec::new();
    for data in data {
        if interrupt::is_requested() {
            return None;
        }
        all.extend(of_recording(space, twin, data, point));
    }
    for prior in &space.priors {
        all.push((point[prior.dimension] - prior.mean) / prior.deviation);
    }
    Some(all)
}

/// Returns the residuals of a recording, in standard deviations.
fn of_recording(
    space: &FitSpace,
    twin: &Twin<'_>,
    recorded: &Recorded<'_>,
    point: &[f64],
) -> Vec<f64> {
    let data = &recorded.data;
    let played = plant_at(space, twin, &recorded.assembly, point)
        .ok()
        .and_then(|mut plant| twin.play(data, &mut *plant).ok().flatten());
    let Some(played) = played else {
        return vec![NO_RESULT; data.samples()];
    };
    let signals = played.iter().zip(&data.compared);
    signals
        .flat_map(|(values, signal)| {
            let pairs = values.iter().zip(&signal.values);
            pairs.map(|(value, recorded)| (value - recorded) / signal.deviation)
        })
        .collect()
}

//! Execution of a fit.

use std::path::PathBuf;

use twinrig_campaign::identification::{FitSpace, FittedDistribution};
use twinrig_campaign::least_squares::{Failure, Information, Minimum};
use twinrig_campaign::sweep::SweepValue;
use twinrig_document::{Document, parse_with_unit};
use twinrig_rig::registry::Registry;
use twinrig_runtime::interrupt;
use twinrig_scenario::Setting;

use super::minima::{FitProgress, Fitter};
use super::model::{Recorded, of_recording, read};
use super::outcome::{
    Correlation, DataRange, FitOutcome, FittedParameter, HeldOut, RecordingResidual,
    UnknownDirection,
};
use super::profiles::Profiles;
use super::searches::{SearchEnd, Searches};
use super::twin::Twin;
use crate::error::{Error, FitError};

/// A fit to be done.
#[derive(Clone, Debug)]
pub struct FitRequest {
    /// Recordings.
    pub recordings: Vec<PathBuf>,
    /// Recordings that are predicted only.
    pub validate: Vec<PathBuf>,
    /// File of the search space.
    pub space: PathBuf,
    /// Settings of all runs; that of a dimension's key holds it at this value.
    pub settings: Vec<Setting>,
    /// Whether recordings are left out in turn.
    pub cross_validate: bool,
    /// Whether intervals are those of the profile likelihood, too.
    pub profile: bool,
    /// Folder of the searches that are done, from which an interrupted fit continues.
    pub store: Option<PathBuf>,
    /// Threads.
    pub threads: usize,
}

/// Quantile of the normal distribution for a confidence of 95 %.
const NORMAL_95: f64 = 1.959_964;

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
    let mut space = FitSpace::read(&Document::read(&request.space)?)?;
    let set: Vec<&str> = request.settings.iter().map(|it| it.key.as_str()).collect();
    space.hold(&set);
    if space.dimensions.is_empty() {
        return Err(FitError::AllHeld.into());
    }
    let twin = Twin::new(registry, &space, &request.settings)?;
    let files = [request.recordings.as_slice(), &request.validate].concat();
    let data = read(&space, &twin, &files)?;
    let (data, validation) = data.split_at(request.recordings.len());
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
    let folds = if request.cross_validate {
        folds(&space, &all)?
    } else {
        Vec::new()
    };
    let build = registry.build()?.to_string();
    let mut fitter = Fitter {
        searches: Searches::open(request.store.as_deref(), &build, &space, &twin)?,
        build,
        space: &space,
        twin: &twin,
        threads: request.threads,
        progress: FitProgress {
            fits: 0,
            of: (1 + folds.len()) * space.searches,
            done: 0,
            is_solving: false,
            cost: f64::INFINITY,
        },
        observer,
    };
    let mut ends = fitter.fit(&all)?;
    let mut minimum = fitter.evaluate(&all, &ends[0])?;
    let mut profiles = Profiles::default();
    if request.profile {
        profiles = fitter.profiles(&all, &mut ends, &mut minimum)?;
    }
    let mut outcome = fitter.outcome(&all, &ends, &minimum);
    profiles.put(&space, &mut outcome);
    let predicted = validation
        .iter()
        .map(|it| fitter.residuals_of(it, &minimum.point));
    outcome.validation = predicted.flatten().collect();
    for fold in folds {
        outcome.held_out.push(fitter.held_out(&all, &fold)?);
    }
    outcome.notes = fitter.searches.notes();
    // An interrupted model has no residuals.
    if interrupt::is_requested() {
        return Err(FitError::from(Failure::Interrupted(outcome.steps)).into());
    }
    Ok(outcome)
}

/// Returns the indices of the recordings that are left out together: each alone, or those that
/// state the same value.
fn folds(space: &FitSpace, all: &[&Recorded<'_>]) -> Result<Vec<Vec<usize>>, FitError> {
    let mut folds: Vec<(String, Vec<usize>)> = Vec::new();
    for (index, Recorded { data, .. }) in all.iter().enumerate() {
        let value = match &space.leave_out {
            None => data.hash.clone(),
            Some(key) => {
                let mut stated = data.settings.iter();
                let stated = stated.find(|(other, _)| other == key);
                let missing = || FitError::LeftOut {
                    recording: data.file.clone(),
                    key: key.clone(),
                };
                stated.ok_or_else(missing)?.1.clone()
            }
        };
        match folds.iter_mut().find(|(other, _)| *other == value) {
            Some((_, fold)) => fold.push(index),
            None => folds.push((value, vec![index])),
        }
    }
    if folds.len() < 2 {
        return Err(FitError::NothingLeft);
    }
    Ok(folds.into_iter().map(|(_, fold)| fold).collect())
}

/// Returns the ranges of the quantities that recordings state.
fn ranges(data: &[&Recorded<'_>]) -> Vec<DataRange> {
    let mut ranges: Vec<DataRange> = Vec::new();
    for (key, toml) in data.iter().flat_map(|it| &it.data.settings) {
        let number = |toml: &str| Some(parse_with_unit(toml.trim_matches('"'))?.0);
        let Some(value) = number(toml) else {
            continue;
        };
        let Some(range) = ranges.iter_mut().find(|range| range.key == *key) else {
            ranges.push(DataRange {
                key: key.clone(),
                ends: [toml.clone(), toml.clone()],
            });
            continue;
        };
        let [least, greatest] = &mut range.ends;
        if number(least).is_some_and(|least| value < least) {
            least.clone_from(toml);
        }
        if number(greatest).is_some_and(|greatest| value > greatest) {
            greatest.clone_from(toml);
        }
    }
    ranges
}

fn estimates(space: &FitSpace, point: &[f64]) -> Vec<f64> {
    let values = space.values(point).into_iter();
    values
        .map(|value| value.number.unwrap_or(f64::NAN))
        .collect()
}

impl Fitter<'_, '_> {
    /// Fits the parameters without some recordings, by their indices, and predicts these.
    fn held_out(&mut self, all: &[&Recorded<'_>], fold: &[usize]) -> Result<HeldOut, Error> {
        let (left_out, others): (Vec<_>, Vec<_>) = all
            .iter()
            .enumerate()
            .partition(|(index, _)| fold.contains(index));
        let others: Vec<_> = others.into_iter().map(|(_, it)| *it).collect();
        let point = self.fit(&others)?.swap_remove(0).point;
        let residuals = left_out
            .iter()
            .flat_map(|(_, it)| self.residuals_of(it, &point));
        Ok(HeldOut {
            residuals: residuals.collect(),
            estimates: estimates(self.space, &point),
        })
    }

    /// Returns the residuals of a recording in the units of its signals.
    fn residuals_of(&self, recorded: &Recorded<'_>, point: &[f64]) -> Vec<RecordingResidual> {
        let of = |point| of_recording(self.space, self.twin, recorded, point);
        let unfitted = of(None);
        let fitted = of(Some(point)).unwrap_or_else(|| vec![f64::NAN; recorded.samples()]);
        let data = &recorded.data;
        let mut samples = 0..0;
        let signals = data.compared.iter().zip(&self.space.residuals);
        signals
            .map(|(signal, spec)| {
                samples = samples.end..samples.end + signal.times.len();
                let own = &fitted[samples.clone()];
                let unfitted = unfitted.as_ref().map(|all| &all[samples.clone()]);
                let count = own.len().max(1) as f64;
                let absolute = own.iter().map(|it| it.abs() * signal.deviation);
                let squares: f64 = own.iter().map(|it| it * it).sum();
                let mean = |residuals: &[f64]| {
                    let sum: f64 = residuals.iter().map(|it| it.abs()).sum();
                    sum * signal.deviation / count
                };
                RecordingResidual {
                    recording: data.name.clone(),
                    hash: data.hash.clone(),
                    signal: spec.name(),
                    unit: signal.unit.clone(),
                    samples: own.len(),
                    mean_absolute: mean(own),
                    unfitted: unfitted.map(mean),
                    rms: (squares / count).sqrt() * signal.deviation,
                    worst: absolute.fold(0.0, f64::max),
                    spikes: signal.spikes,
                    curve: signal.curve(own),
                }
            })
            .collect()
    }

    pub(super) fn information(&self, data: &[&Recorded<'_>], minimum: &Minimum) -> Information {
        let series = data.iter().flat_map(|it| &it.data.compared);
        let mut series: Vec<usize> = series.map(|signal| signal.times.len()).collect();
        series.extend(std::iter::repeat_n(1, self.space.priors.len()));
        Information::of(&self.settings(), minimum, &series)
    }

    fn outcome(&self, data: &[&Recorded<'_>], ends: &[SearchEnd], minimum: &Minimum) -> FitOutcome {
        let space = self.space;
        let information = self.information(data, minimum);
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
            data: ranges(data),
            distribution: FittedDistribution::of(&space.dimensions, &minimum.point, &information),
            recordings: data
                .iter()
                .flat_map(|it| self.residuals_of(it, &minimum.point))
                .collect(),
            validation: Vec::new(),
            held_out: Vec::new(),
            profile_cost: None,
            notes: Vec::new(),
            deviation: information.variance.sqrt(),
            correlation_time: information.correlation_time,
            samples,
            bic: independent * libm::log(information.variance) + free * libm::log(independent),
            steps: ends[0].steps,
            converged: ends[0].converged,
            searched: ends.iter().map(|it| it.evaluations).sum(),
            minima: ends.iter().map(|it| it.cost / samples as f64).collect(),
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
        profile: None,
        at_bound: !information.free[index],
    }
}

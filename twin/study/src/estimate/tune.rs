//! Tuning of covariances by particle swarm (section 4.3.1.3).

use std::ops::Range;

use serde::Serialize;
use twinrig_campaign::search::{Progress, SearchError, Swarm};
use twinrig_estimate::{EstimateError, Objective, Settings, TunedSample};
use twinrig_kernel::stream;

use super::data::{Part, Signals};
use super::filter::{FilterKind, untuned, with_deviations};
use super::identify::Identification;
use super::track::track;
use crate::error::StudyError;

/// Periods of each frequency in which a filter settles, and after which it is judged. One is enough:
/// the load is periodic.
const SETTLING: f64 = 2.0;
const JUDGED: f64 = 1.0;

/// Swarms of each filter, of which the best counts: the objective of F2 has several minima, and a
/// swarm may stay at any of them. ASSUMED.
const SWARMS: u64 = 3;

/// Tuned filter.
#[derive(Clone, Debug, PartialEq)]
pub struct TunedFilter {
    /// Which filter.
    pub kind: FilterKind,
    /// Its settings.
    pub settings: Settings,
    /// −ln O before and after tuning (eq. 4.19).
    pub cost: [f64; 2],
    /// Evaluations of the objective.
    pub evaluations: usize,
    /// Whether the budget ended the search.
    pub truncated: bool,
    /// Least cost of the best swarm after the initial points and each iteration; empty if no swarm
    /// was better than the start.
    pub history: Vec<f64>,
}

/// Size of the swarms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SearchSize {
    /// Particles.
    pub particles: usize,
    /// Iterations.
    pub iterations: usize,
}

/// Samples of the tuning run on which filters are judged: of each frequency a few periods, which
/// begin where the force is least, so that the initial state holds.
pub(crate) struct TuningData<'a> {
    signals: &'a Signals,
    /// Samples of each frequency, and the first judged one.
    parts: Vec<(Range<usize>, usize)>,
}

impl<'a> TuningData<'a> {
    pub(crate) fn new(signals: &'a Signals) -> Self {
        let part = |part: &Part| {
            let Range { start, end } = part.samples;
            let period = signals.count(part.hz, 1.0);
            let first = start..(start + period).min(end);
            let least = first.min_by(|&a, &b| signals.force[a].total_cmp(&signals.force[b]));
            let begin = least.unwrap_or(start);
            let settled = begin + signals.count(part.hz, SETTLING);
            let stop = settled + signals.count(part.hz, JUDGED);
            (begin..stop.min(end), settled.min(end))
        };
        Self {
            parts: signals.parts.iter().map(part).collect(),
            signals,
        }
    }

    /// Returns −ln O of a filter; infinite where its estimates are.
    fn cost(&self, settings: &Settings) -> Result<f64, EstimateError> {
        let mut samples = Vec::new();
        let signals = self.signals;
        for (range, settled) in &self.parts {
            track(settings, signals, range.clone(), |i, estimate, _| {
                if i >= *settled {
                    samples.push(TunedSample {
                        estimate: [estimate.force, estimate.rate, estimate.bias],
                        truth: [signals.force[i], signals.rate[i]],
                    });
                }
            })?;
        }
        let cost = Objective::THESIS.cost(&samples);
        Ok(if cost.is_finite() {
            cost
        } else {
            f64::INFINITY
        })
    }
}

/// Best point of a swarm.
struct Best {
    deviations: Vec<f64>,
    cost: f64,
    history: Vec<f64>,
    /// Whether it was ended early.
    ended: bool,
}

/// Tunes a filter by several swarms. `go_on` is called with the numbers of swarm and iteration after
/// the initial points and after every iteration; it ends the search with the best settings so far.
pub(crate) fn tune(
    kind: FilterKind,
    found: &Identification,
    data: &TuningData<'_>,
    size: SearchSize,
    seed: u64,
    go_on: &mut dyn FnMut(u64, usize) -> bool,
) -> Result<TunedFilter, StudyError> {
    let (start, dimensions) = untuned(kind, found);
    let before = data.cost(&start)?;
    let objective = |deviations: &[f64]| {
        let settings = with_deviations(&start, &dimensions, deviations);
        // Settings within the ranges are valid.
        data.cost(&settings).unwrap_or(f64::INFINITY)
    };
    let mut swarm = Swarm {
        dimensions: dimensions.iter().map(|it| it.range).collect(),
        particles: size.particles,
        iterations: size.iterations,
        seed,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    let (mut best, mut evaluations, mut truncated) = (None::<Best>, 0, false);
    for number in 0..SWARMS {
        swarm.seed = stream(seed, &format!("{}/{number}", kind.name())).bits();
        let found = search(&swarm, &objective, &mut |iteration| {
            go_on(number, iteration)
        })?;
        evaluations += size.particles * found.history.len();
        truncated |= found.ended;
        let ended = found.ended;
        if best.as_ref().is_none_or(|best| found.cost < best.cost) {
            best = Some(found);
        }
        if ended {
            break;
        }
    }
    let best = best.filter(|best| best.cost < before);
    let settings = best.as_ref().map_or(start, |best| {
        with_deviations(&start, &dimensions, &best.deviations)
    });
    Ok(TunedFilter {
        kind,
        settings,
        cost: [before, best.as_ref().map_or(before, |best| best.cost)],
        evaluations,
        truncated,
        history: best.map_or_else(Vec::new, |best| best.history),
    })
}

fn search(
    swarm: &Swarm,
    objective: &(dyn Fn(&[f64]) -> f64 + Sync),
    go_on: &mut dyn FnMut(usize) -> bool,
) -> Result<Best, StudyError> {
    let mut best = Best {
        deviations: Vec::new(),
        cost: f64::INFINITY,
        history: Vec::new(),
        ended: false,
    };
    let found = swarm.minimise(objective, &mut |progress: Progress<'_>| {
        best.deviations = progress.best.to_vec();
        best.cost = progress.cost;
        best.history.push(progress.cost);
        best.ended = !go_on(progress.iteration);
        !best.ended
    });
    match found {
        Err(SearchError::Interrupted { .. }) if best.ended => Ok(best),
        Err(error) => Err(error.into()),
        Ok(_) => Ok(best),
    }
}

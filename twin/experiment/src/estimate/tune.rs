//! Tuning of covariances by particle swarm (section 4.3.1.3).

use serde::{Deserialize, Serialize};
use twinrig_campaign::search::{Progress, SearchError, Swarm};
use twinrig_estimate::{EstimateError, Objective, Settings, TunedSample};
use twinrig_kernel::stream;

use super::data::Signals;
use super::filter::{FilterKind, untuned, with_deviations};
use super::identify::Identification;
use super::track::track;
use crate::error::StudyError;
use crate::measured::Measured;

/// Tuned filter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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

impl Measured for TunedFilter {
    fn is_cut(&self) -> bool {
        self.truncated
    }
}

/// Size of the swarms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SearchSize {
    /// Particles.
    pub particles: usize,
    /// Iterations.
    pub iterations: usize,
}

/// Returns −ln O of a filter over the steady parts of a run, through the whole of which it runs:
/// what disturbs it while the frequency changes counts as far as it lasts. Infinite where an
/// estimate is.
fn cost_of(settings: &Settings, signals: &Signals) -> Result<f64, EstimateError> {
    let mut samples = Vec::with_capacity(signals.force.len());
    let end = signals.parts.last().map_or(0, |part| part.samples.end);
    let mut parts = signals.parts.iter().map(|part| &part.samples).peekable();
    track(settings, signals, 0..end, |i, estimate, _| {
        while parts.next_if(|part| part.end <= i).is_some() {}
        if parts.peek().is_some_and(|part| part.contains(&i)) {
            samples.push(TunedSample {
                estimate: [estimate.force, estimate.rate, estimate.bias],
                truth: [signals.force[i], signals.rate[i]],
            });
        }
    })?;
    let cost = Objective::THESIS.cost(&samples);
    Ok(if cost.is_finite() {
        cost
    } else {
        f64::INFINITY
    })
}

/// Best point of a swarm.
struct Best {
    deviations: Vec<f64>,
    cost: f64,
    history: Vec<f64>,
    /// Whether it was ended early.
    ended: bool,
}

/// Tunes a filter by its swarms. `keep_running` is called with the numbers of swarm and iteration,
/// after the initial points and after every iteration; it ends the search with the best settings so
/// far.
pub(crate) fn tune(
    kind: FilterKind,
    found: &Identification,
    signals: &Signals,
    size: SearchSize,
    seed: u64,
    keep_running: &mut dyn FnMut(u64, usize) -> bool,
) -> Result<TunedFilter, StudyError> {
    let (start, dimensions) = untuned(kind, found);
    let before = cost_of(&start, signals)?;
    let objective = |deviations: &[f64]| {
        let settings = with_deviations(&start, &dimensions, deviations);
        // Settings within the ranges are valid.
        cost_of(&settings, signals).unwrap_or(f64::INFINITY)
    };
    let mut swarm = Swarm {
        dimensions: dimensions.iter().map(|it| it.range).collect(),
        particles: size.particles,
        iterations: size.iterations,
        seed,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    let (mut best, mut evaluations, mut truncated) = (None::<Best>, 0, false);
    for number in 0..kind.swarms() {
        swarm.seed = stream(seed, &format!("{}/{number}", kind.name())).bits();
        let found = search(&swarm, &objective, &mut |iteration| {
            keep_running(number, iteration)
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
    keep_running: &mut dyn FnMut(usize) -> bool,
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
        best.ended = !keep_running(progress.iteration);
        !best.ended
    });
    match found {
        Err(SearchError::Interrupted { .. }) if best.ended => Ok(best),
        Err(error) => Err(error.into()),
        Ok(_) => Ok(best),
    }
}

//! Minima of the cost of a fit: searches from several seeds, each with least squares at its end.

use twinrig_campaign::identification::FitSpace;
use twinrig_campaign::least_squares::{LeastSquares, Loss, Minimum};
use twinrig_campaign::search::{CmaEs, Dimension};

use super::model::{Recorded, residuals};
use super::searches::{SearchEnd, Searches};
use super::twin::Twin;
use crate::error::{Error, FitError};

/// Greatest step of differences, as a share of a range.
const DIFFERENCE: f64 = 0.02;
/// Step at which least squares end, as a share of a range: far below any interval.
const TOLERANCE: f64 = 1e-5;
/// Standard deviation of CMA-ES at which it ends: least squares do the rest.
const SEARCHED: f64 = 1e-3;

/// State of a running fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitProgress {
    /// Searches done: those of all recordings, then those with some left out.
    pub fits: usize,
    /// Searches in total.
    pub of: usize,
    /// Generations of the search, or steps of least squares.
    pub done: usize,
    /// Whether they are steps.
    pub is_solving: bool,
    /// Mean cost of a residual.
    pub cost: f64,
}

/// What all fits have in common.
pub(super) struct Fitter<'a, 'o> {
    pub(super) searches: Searches,
    pub(super) build: String,
    pub(super) space: &'a FitSpace,
    pub(super) twin: &'a Twin<'a>,
    pub(super) threads: usize,
    pub(super) progress: FitProgress,
    pub(super) observer: &'o mut dyn FnMut(FitProgress) -> bool,
}

impl Fitter<'_, '_> {
    pub(super) fn settings(&self) -> LeastSquares {
        LeastSquares {
            loss: self.space.huber.map_or(Loss::Square, Loss::Huber),
            iterations: self.space.steps,
            tolerance: TOLERANCE,
            difference: DIFFERENCE,
            threads: self.threads,
        }
    }

    /// Fits the parameters to some recordings: returns the ends of the searches, of which there is
    /// at least one, in the order of their cost.
    pub(super) fn fit(&mut self, data: &[&Recorded<'_>]) -> Result<Vec<SearchEnd>, Error> {
        let mut ends = Vec::new();
        for search in 0..self.space.searches {
            let seed = self.space.seed.wrapping_add(search as u64);
            ends.push(self.end(data, seed)?);
            self.progress.fits += 1;
        }
        ends.sort_by(|one, other| one.cost.total_cmp(&other.cost));
        Ok(ends)
    }

    /// Returns the end of a search from a seed.
    fn end(&mut self, data: &[&Recorded<'_>], seed: u64) -> Result<SearchEnd, Error> {
        let key = self.searches.key(data, seed);
        if let Some(end) = self.searches.take(&key) {
            return Ok(end);
        }
        let end = self.search(data, seed)?;
        self.searches.append(key, end.clone())?;
        Ok(end)
    }

    /// Returns residuals and derivatives at the end of a search.
    pub(super) fn evaluate(
        &self,
        data: &[&Recorded<'_>],
        end: &SearchEnd,
    ) -> Result<Minimum, Error> {
        let (space, twin) = (self.space, self.twin);
        let model = |point: &[f64]| residuals(space, twin, data, point);
        let minimum = self.settings().evaluate(&model, &end.point);
        Ok(minimum.map_err(FitError::from)?)
    }

    fn search(&mut self, data: &[&Recorded<'_>], seed: u64) -> Result<SearchEnd, Error> {
        let settings = self.settings();
        let (space, twin) = (self.space, self.twin);
        let model = |point: &[f64]| residuals(space, twin, data, point);
        let samples: usize = data.iter().map(|it| it.samples()).sum();
        let (observer, mut progress) = (&mut *self.observer, self.progress);
        let count = space.dimensions.len();
        let (mut start, mut evaluations) = (vec![0.5; count], 0);
        if space.generations > 0 {
            let search = CmaEs {
                dimensions: vec![Dimension::linear(0.0, 1.0); count],
                population: space.particles,
                iterations: space.generations,
                restarts: 0,
                tolerance: SEARCHED,
                seed,
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
            (start, evaluations) = (found.best, found.evaluations);
        }
        self.progress = progress;
        let end = self.descend(data, &start)?;
        Ok(SearchEnd { evaluations, ..end })
    }

    /// Returns the end of least squares from a point.
    pub(super) fn descend(
        &mut self,
        data: &[&Recorded<'_>],
        start: &[f64],
    ) -> Result<SearchEnd, Error> {
        let (space, twin) = (self.space, self.twin);
        let model = |point: &[f64]| residuals(space, twin, data, point);
        let samples: usize = data.iter().map(|it| it.samples()).sum();
        let (settings, mut progress) = (self.settings(), self.progress);
        let found = settings.minimise(&model, start, &mut |step| {
            progress.done = step.iteration;
            progress.is_solving = true;
            progress.cost = step.cost / samples as f64;
            (self.observer)(progress)
        });
        let found = found.map_err(FitError::from)?;
        Ok(SearchEnd {
            point: found.point,
            cost: found.cost,
            steps: found.iterations,
            converged: found.converged,
            evaluations: 0,
        })
    }
}

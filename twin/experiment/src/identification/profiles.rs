//! Intervals of a fit by the profile likelihood, and lower minima that profiles find.

use twinrig_campaign::identification::FitSpace;
use twinrig_campaign::least_squares::{Minimum, ProfileInterval};

use super::minima::Fitter;
use super::model::{Recorded, residuals};
use super::outcome::FitOutcome;
use super::searches::SearchEnd;
use crate::error::{Error, FitError};

/// Share of the cost by which a profile is below the minimum that then is a local one.
const LOWER: f64 = 1e-3;
/// Minima that are left for a lower one; the last one stays, and the page tells that it is local.
const CONTINUED_MOST: usize = 10;

/// Profiles of the parameters at no bound.
#[derive(Default)]
pub(super) struct Profiles {
    found: Vec<Option<ProfileInterval>>,
    /// Least cost on them, none without a profile.
    least_cost: Option<f64>,
}

impl Profiles {
    /// Adds the intervals to an outcome.
    pub(super) fn put(self, space: &FitSpace, outcome: &mut FitOutcome) {
        let dimensions = space.dimensions.iter().zip(self.found);
        for (parameter, (dimension, found)) in outcome.parameters.iter_mut().zip(dimensions) {
            let at = |share: Option<f64>| Some(dimension.interval.number_at(share?));
            parameter.profile = found.map(|it| it.bounds.map(at));
        }
        let samples = outcome.samples as f64;
        outcome.profile_cost = self.least_cost.map(|cost| cost / samples);
    }
}

impl Fitter<'_, '_> {
    /// Returns the profiles of the parameters around a minimum. Where one is below it, the fit
    /// continues from there: the end of that is the first of `ends`, and the minimum.
    pub(super) fn profiles(
        &mut self,
        data: &[&Recorded<'_>],
        ends: &mut Vec<SearchEnd>,
        minimum: &mut Minimum,
    ) -> Result<Profiles, Error> {
        for _ in 0..CONTINUED_MOST {
            let (profiles, lower) = self.profiles_of(data, minimum, true)?;
            let Some(point) = lower else {
                return Ok(profiles);
            };
            let end = self.descend(data, &point)?;
            *minimum = self.evaluate(data, &end)?;
            ends.insert(0, end);
        }
        Ok(self.profiles_of(data, minimum, false)?.0)
    }

    /// Returns the profiles around a minimum, up to a point below it if `to_lower`.
    fn profiles_of(
        &self,
        data: &[&Recorded<'_>],
        minimum: &Minimum,
        to_lower: bool,
    ) -> Result<(Profiles, Option<Vec<f64>>), Error> {
        let information = self.information(data, minimum);
        let (space, twin, settings) = (self.space, self.twin, self.settings());
        let model = |point: &[f64]| residuals(space, twin, data, point);
        let mut profiles = Profiles {
            found: Vec::new(),
            least_cost: Some(minimum.cost),
        };
        for (index, free) in information.free.iter().enumerate() {
            if !free {
                profiles.found.push(None);
                continue;
            }
            let found = settings.profile(&model, minimum, &information, index);
            let found = found.map_err(FitError::from)?;
            profiles.least_cost = profiles.least_cost.map(|cost| cost.min(found.least_cost));
            if to_lower && found.least_cost < (1.0 - LOWER) * minimum.cost {
                return Ok((profiles, Some(found.least)));
            }
            profiles.found.push(Some(found));
        }
        Ok((profiles, None))
    }
}

//! The residuals of a twin at a point of the search space.

use twinrig_campaign::identification::FitSpace;
use twinrig_rig::assembly::Assembly;
use twinrig_runtime::{Plant, interrupt};

use super::data::FitData;
use super::twin::Twin;
use crate::error::Error;

/// Residual of a sample without a result of the twin, in standard deviations.
const NO_RESULT: f64 = 1e6;

/// A recording with its twin.
pub(super) struct Recorded<'r> {
    pub data: FitData,
    pub assembly: Assembly<'r>,
}

impl Recorded<'_> {
    /// Number of residuals.
    pub(super) fn samples(&self) -> usize {
        self.data.samples()
    }
}

/// Builds the plant of a recording at shares of the ranges.
pub(super) fn plant_at<'r>(
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
pub(super) fn residuals(
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
pub(super) fn of_recording(
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

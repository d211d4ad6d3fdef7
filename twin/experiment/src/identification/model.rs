//! The residuals of a twin at a point of the search space.

use std::path::PathBuf;

use twinrig_campaign::identification::FitSpace;
use twinrig_rig::assembly::Assembly;
use twinrig_runtime::{Plant, interrupt};

use super::data::FitData;
use super::twin::Twin;
use crate::error::{Error, FitError};

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

/// Reads recordings, and reports errors of settings and ranges.
pub(super) fn read<'r>(
    space: &FitSpace,
    twin: &Twin<'r>,
    files: &[PathBuf],
) -> Result<Vec<Recorded<'r>>, Error> {
    let middle = vec![0.5; space.dimensions.len()];
    let inputs = Twin::inputs(&*plant_at(space, twin, &twin.of_recording(&[])?, &middle)?);
    let mut recorded: Vec<Recorded<'_>> = Vec::new();
    for path in files {
        let data = FitData::read(path, space, &inputs)?;
        if recorded.iter().any(|other| other.data.hash == data.hash) {
            return Err(FitError::Twice(data.file).into());
        }
        let assembly = twin.of_recording(&data.settings)?;
        for (index, end) in (0..middle.len()).flat_map(|index| [(index, 0.0), (index, 1.0)]) {
            let mut point = middle.clone();
            point[index] = end;
            plant_at(space, twin, &assembly, &point)?;
        }
        let mut plant = plant_at(space, twin, &assembly, &middle)?;
        twin.play(&data, &mut *plant)?;
        recorded.push(Recorded { data, assembly });
    }
    Ok(recorded)
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
        let found = of_recording(space, twin, data, Some(point));
        all.extend(found.unwrap_or_else(|| vec![NO_RESULT; data.samples()]));
    }
    for prior in &space.priors {
        all.push((point[prior.dimension] - prior.mean) / prior.deviation);
    }
    Some(all)
}

/// Returns the residuals of a recording, in standard deviations; none where the twin fails. Without
/// a point the twin has the values of its files.
pub(super) fn of_recording(
    space: &FitSpace,
    twin: &Twin<'_>,
    recorded: &Recorded<'_>,
    point: Option<&[f64]>,
) -> Option<Vec<f64>> {
    let Recorded { data, assembly } = recorded;
    let plant = match point {
        Some(point) => plant_at(space, twin, assembly, point),
        None => twin.plant(assembly, &[]),
    };
    let played = twin.play(data, &mut *plant.ok()?).ok()??;
    let signals = played.iter().zip(&data.compared);
    let scaled = signals.flat_map(|(values, signal)| {
        let pairs = values.iter().zip(&signal.values);
        pairs.map(|(value, recorded)| (value - recorded) / signal.deviation)
    });
    Some(scaled.collect())
}

//! Recordings as the data of a fit.

use std::path::Path;

use twinrig_campaign::identification::{FitSpace, ResidualSpec};
use twinrig_document::{parse_quantity, read_file};
use twinrig_kernel::{SimTime, Unit};
use twinrig_record::{RecordError, Recording, SETTING_PREFIX, Series};
use twinrig_rig::playback::TimedValues;

use crate::error::{Error, FitError};

/// Data of a recording.
pub(super) struct FitData {
    /// Name: the file without its extension.
    pub name: String,
    /// File.
    pub file: String,
    /// BLAKE3 hash of the file.
    pub hash: String,
    /// Values of the file of robot or bench that the recording states: keys and values in TOML.
    pub settings: Vec<(String, String)>,
    /// Recorded commands, by the name of the input of the twin.
    pub commands: Vec<(String, TimedValues)>,
    /// State of the twin at the start.
    pub start: Vec<(String, f64)>,
    /// Compared signals, in the order of the search space.
    pub compared: Vec<Compared>,
}

/// A compared signal over time.
pub(super) struct Compared {
    pub times: Vec<SimTime>,
    pub values: Vec<f64>,
    /// Standard deviation of a residual.
    pub deviation: f64,
    pub unit: String,
    /// Corrupted readings, which are not compared.
    pub spikes: usize,
}

impl FitData {
    /// Reads a recording; `inputs` are those of the twin.
    pub(super) fn read(path: &Path, space: &FitSpace, inputs: &[String]) -> Result<Self, Error> {
        let file = path.display().to_string();
        let bytes = read_file(path, u64::MAX).map_err(|source| RecordError::Read {
            path: path.to_owned(),
            source,
        })?;
        let hash = blake3::hash(&bytes).to_hex().to_string();
        let recording = Recording::from_bytes(bytes)?;
        let mut commands = Vec::new();
        for input in inputs {
            if let Ok(series) = recording.series(input) {
                let series = element(series, None)?;
                commands.push((
                    input.clone(),
                    TimedValues {
                        times: series.times,
                        values: series.values,
                    },
                ));
            }
        }
        if commands.is_empty() {
            return Err(FitError::NoCommands {
                recording: file,
                inputs: inputs.join(", "),
            }
            .into());
        }
        let signal = |name: &str, component: Option<usize>| -> Result<Series, Error> {
            let series = recording.series(name);
            let series = series.map_err(|error| no_signal(&file, name, &error))?;
            let series = element(series, component)?;
            if series.times.is_empty() {
                let (recording, signal) = (file.clone(), name.to_owned());
                return Err(FitError::Empty { recording, signal }.into());
            }
            Ok(series)
        };
        let mut compared = Vec::new();
        for spec in &space.residuals {
            let series = signal(&spec.signal.value, spec.component)?;
            compared.push(Compared::of(series, spec)?);
        }
        let mut start = Vec::new();
        for state in &space.start {
            let series = signal(&state.signal, None)?;
            let minus = state.minus.as_deref();
            let minus = minus
                .map(|text| quantity(&series, "minus", text))
                .transpose()?;
            let value = |first: &f64| state.times * (first - minus.unwrap_or(0.0));
            let first = series.values.first().map(value);
            start.extend(first.map(|first| (state.state.clone(), first)));
        }
        let settings = recording.notes().filter_map(|(key, value)| {
            let key = key.strip_prefix(SETTING_PREFIX)?;
            Some((key.to_owned(), value.to_owned()))
        });
        Ok(Self {
            name: path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
            file,
            hash,
            settings: settings.collect(),
            commands,
            start,
            compared,
        })
    }

    /// Number of residuals.
    pub(super) fn samples(&self) -> usize {
        self.compared.iter().map(|signal| signal.times.len()).sum()
    }
}

/// Points of a curve in a plot.
const CURVE_POINTS: usize = 400;

impl Compared {
    /// Returns some of the samples with the values of the twin, by their residuals in standard
    /// deviations.
    pub(super) fn curve(&self, residuals: &[f64]) -> Vec<[f64; 3]> {
        let samples = self.times.iter().zip(&self.values).zip(residuals);
        let every = self.times.len().div_ceil(CURVE_POINTS).max(1);
        let points = samples.map(|((time, value), residual)| {
            [
                time.as_secs_f64(),
                *value,
                value + residual * self.deviation,
            ]
        });
        points.step_by(every).collect()
    }

    fn of(series: Series, spec: &ResidualSpec) -> Result<Self, FitError> {
        let positive = |key: &'static str, text: &str| {
            let number = quantity(&series, key, text)?;
            if number <= 0.0 {
                let why = "it is not positive".to_owned();
                return Err(bad_quantity(&series, key, why));
            }
            Ok(number)
        };
        let deviation = positive("deviation", &spec.deviation.value)?;
        let spike = spec.spike.as_ref();
        let spike = spike.map(|text| positive("spike", &text.value));
        let kept = kept(&series.values, spike.transpose()?);
        let spikes = series.values.len() - kept.len();
        Ok(Self {
            times: kept.iter().map(|index| series.times[*index]).collect(),
            values: kept.iter().map(|index| series.values[*index]).collect(),
            deviation,
            unit: series.signal.unit,
            spikes,
        })
    }
}

/// Returns the number of a key in the unit of a signal.
fn quantity(series: &Series, key: &'static str, text: &str) -> Result<f64, FitError> {
    let symbol = &series.signal.unit;
    let unit = Unit::ALL.iter().find(|unit| unit.symbol() == symbol);
    let number = parse_quantity(text, unit.copied().unwrap_or(Unit::One));
    number.map_err(|error| bad_quantity(series, key, error.to_string()))
}

fn bad_quantity(series: &Series, key: &'static str, why: String) -> FitError {
    let signal = series.signal.name.clone();
    FitError::Distance { key, signal, why }
}

/// Returns the indices of the samples that are not further than `spike` from both neighbours.
fn kept(values: &[f64], spike: Option<f64>) -> Vec<usize> {
    let indices = 0..values.len();
    let Some(spike) = spike else {
        return indices.collect();
    };
    let is_far = |one: usize, other: Option<usize>| {
        let other = other.and_then(|other| values.get(other));
        other.is_some_and(|other| (values[one] - other).abs() > spike)
    };
    indices
        .filter(|&index| {
            !(is_far(index, index.checked_sub(1)) && is_far(index, index.checked_add(1)))
        })
        .collect()
}

/// Returns a component of a signal, which is the only one if none is named.
fn element(mut series: Series, component: Option<usize>) -> Result<Series, FitError> {
    let size = series.signal.size;
    let index = component.unwrap_or(0);
    if index >= size || (component.is_none() && size != 1) {
        return Err(FitError::Component {
            signal: series.signal.name,
            size,
        });
    }
    series.values = series
        .values
        .into_iter()
        .skip(index)
        .step_by(size)
        .collect();
    series.signal.size = 1;
    Ok(series)
}

fn no_signal(recording: &str, signal: &str, error: &RecordError) -> FitError {
    let nearest = match error {
        RecordError::UnknownSignal {
            nearest: Some(nearest),
            ..
        } => format!("; did you mean `{nearest}`?"),
        _ => String::new(),
    };
    FitError::NoSignal {
        recording: recording.to_owned(),
        signal: signal.to_owned(),
        nearest,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_far_from_both_neighbours_are_left_out() {
        let values = [0.0, 0.1, -3.1, 0.2, 0.3, 5.0, 5.1, 9.0];
        assert_eq!(kept(&values, None).len(), values.len());
        // A step of two samples is a motion, and an end has one neighbour.
        assert_eq!(kept(&values, Some(1.0)), [0, 1, 3, 4, 5, 6, 7]);
        assert_eq!(kept(&[], Some(1.0)), [0_usize; 0]);
    }
}

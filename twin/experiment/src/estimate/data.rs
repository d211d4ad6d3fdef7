//! Recorded samples of a sensor, and the low-passed signals that the study works on.

use std::ops::Range;

use twinrig_estimate::Butterworth;

use crate::error::StudyError;

/// Sample of both cells and of the reference cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadSample {
    /// Time \[ns\], strictly increasing.
    pub at_ns: u64,
    /// Voltages of the piezoresistive and the piezoelectric amplifier \[V\].
    pub volts: [f64; 2],
    /// Force of the reference cell \[N\].
    pub reference: f64,
    /// Channels out of range: piezoresistive, piezoelectric, reference.
    pub saturated: [bool; 3],
    /// Frequency of the load \[Hz\], where it has been measured since the sample before.
    pub frequency: Option<f64>,
}

/// Part of a run at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyPart {
    /// Commanded frequency \[Hz\].
    pub hz: f64,
    /// Begin \[ns\].
    pub from_ns: u64,
    /// End \[ns\].
    pub to_ns: u64,
}

/// Recorded run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadRun {
    /// Samples at a constant period.
    pub samples: Vec<LoadSample>,
    /// Parts at one frequency each, in order, without the time that the frequency takes to change.
    pub steady: Vec<SteadyPart>,
}

/// The thesis' low-pass filter (section 4.3.2.1): order, and cut-off frequency \[Hz\].
pub(crate) const LOW_PASS: (usize, f64) = (4, 10.0);
/// Distance of two samples, in mean periods, from which samples between them are missing.
const GAP: f64 = 1.5;
/// Time before a change and at the ends of a record in which a filter without phase is not settled,
/// as it runs backwards, too \[s\]: its transients decay by e^−9 (the slower pole pair has the real
/// part −2π·10·sin 22.5° s⁻¹).
const EDGE_S: f64 = 0.375;
/// Least number of samples of a run: a second of a slow board.
const LEAST: usize = 100;

/// How the channels are low-passed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Forwards and backwards, for identification.
    Zero,
    /// As the samples arrive, as a stage of a driver does.
    Causal,
}

/// Part of the signals at one frequency.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Part {
    /// Commanded frequency \[Hz\].
    pub(crate) hz: f64,
    /// Its samples.
    pub(crate) samples: Range<usize>,
}

/// Channels of a run behind the low-pass filter, with the derivatives of the force.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Signals {
    /// Mean period of the samples \[s\].
    pub(crate) period_s: f64,
    pub(crate) at_ns: Vec<u64>,
    /// Voltages of the piezoresistive and the piezoelectric amplifier \[V\].
    pub(crate) volts: [Vec<f64>; 2],
    /// Whether they are out of range.
    pub(crate) saturated: Vec<[bool; 2]>,
    /// Reference force \[N\].
    pub(crate) force: Vec<f64>,
    /// \[N/s\]
    pub(crate) rate: Vec<f64>,
    /// \[N/s²\]
    pub(crate) acceleration: Vec<f64>,
    /// Measured frequency \[Hz\].
    pub(crate) frequency: Vec<Option<f64>>,
    pub(crate) parts: Vec<Part>,
}

impl Signals {
    /// Returns the signals behind the thesis' low-pass filter.
    pub(crate) fn new(run: &LoadRun, phase: Phase) -> Result<Self, StudyError> {
        Self::below(run, phase, LOW_PASS.1)
    }

    /// Returns the signals behind a low-pass filter with a cut-off frequency \[Hz\].
    pub(crate) fn below(run: &LoadRun, phase: Phase, cutoff: f64) -> Result<Self, StudyError> {
        let samples = &run.samples;
        let period_s = period_s(samples)?;
        check(run, period_s)?;
        let filter = Butterworth::new(LOW_PASS.0, cutoff, 1.0 / period_s)?;
        let channel = |value: &dyn Fn(&LoadSample) -> f64| {
            let raw: Vec<f64> = samples.iter().map(value).collect();
            low_passed(&filter, &raw, phase)
        };
        let force = channel(&|it| it.reference)?;
        let rate = derivative(&force, period_s);
        let at_ns: Vec<u64> = samples.iter().map(|it| it.at_ns).collect();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a positive number of samples; a cast saturates"
        )]
        let edge = match phase {
            Phase::Zero => (EDGE_S / period_s) as usize,
            Phase::Causal => 0,
        };
        let part = |steady: &SteadyPart| {
            let start = at_ns.partition_point(|&at| at < steady.from_ns).max(edge);
            let end = at_ns.partition_point(|&at| at < steady.to_ns);
            let end = end.saturating_sub(edge);
            Part {
                hz: steady.hz,
                samples: start..end.max(start),
            }
        };
        Ok(Self {
            period_s,
            volts: [channel(&|it| it.volts[0])?, channel(&|it| it.volts[1])?],
            saturated: samples
                .iter()
                .map(|it| [it.saturated[0], it.saturated[1]])
                .collect(),
            acceleration: derivative(&rate, period_s),
            frequency: samples.iter().map(|it| it.frequency).collect(),
            parts: run.steady.iter().map(part).collect(),
            rate,
            force,
            at_ns,
        })
    }

    /// Returns the part at a frequency, to a hundredth.
    pub(crate) fn at(&self, hz: f64) -> Option<&Part> {
        self.parts
            .iter()
            .find(|part| (part.hz - hz).abs() <= 0.01 * hz)
    }

    /// Returns the indices of all steady samples.
    pub(crate) fn steady(&self) -> impl Iterator<Item = usize> {
        self.parts.iter().flat_map(|part| part.samples.clone())
    }
}

fn period_s(samples: &[LoadSample]) -> Result<f64, StudyError> {
    let (Some(first), Some(last), true) = (samples.first(), samples.last(), samples.len() >= LEAST)
    else {
        return Err(StudyError::FewSamples {
            found: samples.len(),
            required: LEAST,
        });
    };
    let nanos = last.at_ns.saturating_sub(first.at_ns);
    Ok(nanos as f64 * 1e-9 / (samples.len() - 1) as f64)
}

fn check(run: &LoadRun, period_s: f64) -> Result<(), StudyError> {
    let apart = |pair: &[LoadSample]| pair[1].at_ns.saturating_sub(pair[0].at_ns) as f64 * 1e-9;
    let is_gap = |pair: &&[LoadSample]| apart(pair) >= GAP * period_s;
    let gaps = run.samples.windows(2).filter(is_gap).count();
    if gaps > 0 {
        return Err(StudyError::MissingSamples { gaps });
    }
    let saturated = run.samples.iter().filter(|it| it.saturated[2]).count();
    if saturated > 0 {
        return Err(StudyError::ReferenceSaturated { samples: saturated });
    }
    Ok(())
}

fn low_passed(filter: &Butterworth, raw: &[f64], phase: Phase) -> Result<Vec<f64>, StudyError> {
    if phase == Phase::Zero {
        return Ok(filter.zero_phase(raw)?);
    }
    let mut filter = filter.clone();
    filter.settle(raw.first().copied().unwrap_or_default());
    Ok(raw.iter().map(|&value| filter.step(value)).collect())
}

/// Central differences; one-sided ones at the ends.
fn derivative(values: &[f64], period_s: f64) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    let at = |i: usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(last));
        let span = (after - before).max(1) as f64;
        (values[after] - values[before]) / (span * period_s)
    };
    (0..values.len()).map(at).collect()
}

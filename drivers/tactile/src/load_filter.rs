//! Filter of the load as a stage of the driver.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;
use twinrig_estimate::{
    Butterworth, Channel, EstimateError, ForceEstimator, Measurement, Outcome, Settings,
};
use twinrig_kernel::{HostTime, Port, Snapshot, SnapshotError, Unit};
use twinrig_wire::Diagnostics;

use crate::stage::{Stage, TactileSample};

/// Configuration of a filter.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadFilterConfig {
    /// Name of the filter, the last part of its signal: `estimate`.
    pub name: String,
    /// Signal of the force at which the sensor is mounted: `bench/force`.
    pub signal: String,
    /// Models and noises.
    pub settings: Settings,
    /// Low-pass filter of all channels, fourth order, before the estimator: its cut-off frequency
    /// and the rate of the samples \[Hz\]. Estimates are later by its group delay.
    pub low_pass: Option<[f64; 2]>,
    /// Ranges in which the voltages are plausible: the response of a cell, the rails of an
    /// amplifier \[V\].
    pub ranges: [RangeInclusive<f64>; 2],
    /// Signal of the process with the frequency of the load \[Hz\], which model F2 requires.
    pub frequency: Option<String>,
    /// Whether the reference cell measures the load, as on the test bench.
    pub reference: bool,
}

/// Filter of the load: an extended Kalman filter that processes every sample at its own time, on
/// the host's side of the bus. Its clock is the board's, so that the estimates are a function of
/// the frames alone, whenever they arrive; over a restart of the board it is continued by the
/// clock of the host.
///
/// Outputs, of the newest sample: `SIGNAL/NAME`, the load \[N\]; `…/deviation`, its standard
/// deviation \[N\]; `…/rate` \[N/s\]; `…/nis`, the normalised innovation squared \[1\]; where a
/// reference cell measures the load, `…/reference`, its force behind the same low-pass filter
/// \[N\], and `…/nees`, the normalised estimation error squared \[1\].
///
/// A voltage that is out of range or not plausible ([`LoadFilterConfig::ranges`]) is not used.
/// Diagnostics: `NAME/unused`, of such voltages; `NAME/late` and `NAME/dropped`, of samples out of
/// order; `NAME/recoveries`, see [`Settings::recovery`].
#[derive(Debug)]
pub struct LoadFilter {
    config: LoadFilterConfig,
    /// Names of the counters.
    counters: [String; 4],
    state: State,
    outputs: Vec<f64>,
}

/// Counters of a filter.
const COUNTERS: [&str; 4] = ["unused", "late", "dropped", "recoveries"];

#[derive(Clone, Debug, Serialize, Deserialize)]
struct State {
    estimator: ForceEstimator,
    clock: SampleClock,
    /// Of the voltages and of the reference.
    low_pass: Option<[Butterworth; 3]>,
    /// The low-pass filters have their initial state.
    settled: bool,
    /// Last measured frequency \[Hz\] that no sample has used.
    frequency: Option<f64>,
    /// Force of the reference cell, behind the low-pass filter \[N\].
    reference: f64,
    unused: u64,
}

/// Time of samples by the clock of the board.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct SampleClock {
    /// Time at the stamp 0 of the board \[ns\].
    base_ns: u64,
    last: Option<LastSample>,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct LastSample {
    stamp_us: u64,
    time_ns: u64,
    at: HostTime,
}

impl SampleClock {
    /// Returns the time of a sample \[ns\].
    fn advance(&mut self, sample: &TactileSample) -> u64 {
        let stamp_ns = sample.stamp_us * 1_000;
        if let Some(last) = self.last
            && sample.stamp_us <= last.stamp_us
        {
            let passed = sample.at.as_nanos().saturating_sub(last.at.as_nanos());
            self.base_ns = (last.time_ns + passed.max(1)).saturating_sub(stamp_ns);
        }
        let time_ns = self.base_ns + stamp_ns;
        self.last = Some(LastSample {
            stamp_us: sample.stamp_us,
            time_ns,
            at: sample.at,
        });
        time_ns
    }
}

impl LoadFilter {
    /// Creates a filter.
    ///
    /// # Errors
    /// [`EstimateError`] for invalid settings; [`EstimateError::NoFrequency`] for model F2 without
    /// the signal of a frequency.
    pub fn new(mut config: LoadFilterConfig) -> Result<Self, EstimateError> {
        if config.frequency.is_none() {
            config.settings.frequency = None;
        }
        let filters = |[cutoff, rate]: [f64; 2]| {
            let filter = Butterworth::new(4, cutoff, rate)?;
            Ok::<_, EstimateError>([filter.clone(), filter.clone(), filter])
        };
        let mut filter = Self {
            state: State {
                estimator: ForceEstimator::new(&config.settings)?,
                clock: SampleClock::default(),
                low_pass: config.low_pass.map(filters).transpose()?,
                settled: false,
                frequency: None,
                reference: 0.0,
                unused: 0,
            },
            outputs: Vec::new(),
            counters: COUNTERS.map(|counter| format!("{}/{counter}", config.name)),
            config,
        };
        filter.publish();
        Ok(filter)
    }

    /// Name, the last part of its signal.
    pub fn name(&self) -> &str {
        &self.config.name
    }

    /// Returns whether it takes a measured frequency from the process.
    pub fn has_frequency(&self) -> bool {
        self.config.frequency.is_some()
    }

    /// Delay of the low-pass filter at low frequencies \[s\].
    pub fn low_pass_delay_s(&self) -> f64 {
        let filters = self.state.low_pass.as_ref();
        filters.map_or(0.0, |[filter, ..]| filter.group_delay_s())
    }

    fn publish(&mut self) {
        let estimate = self.state.estimator.estimate();
        self.outputs.clear();
        self.outputs.extend([
            estimate.force,
            estimate.deviation,
            estimate.rate,
            estimate.nis,
        ]);
        if self.config.reference {
            let reference = self.state.reference;
            // Before the first sample the covariance may be singular.
            let nees = self.state.estimator.nees(&[reference]).unwrap_or_default();
            self.outputs.extend([reference, nees]);
        }
    }
}

impl State {
    /// Returns both voltages and the reference behind the low-pass filter.
    fn low_passed(&mut self, sample: &TactileSample) -> [f64; 3] {
        let raw = [sample.volts[0], sample.volts[1], sample.reference];
        let Some(filters) = &mut self.low_pass else {
            return raw;
        };
        if !std::mem::replace(&mut self.settled, true) {
            for (filter, value) in filters.iter_mut().zip(raw) {
                filter.settle(value);
            }
        }
        std::array::from_fn(|n| filters[n].step(raw[n]))
    }

    fn push(&mut self, at_ns: u64, channel: Channel, value: f64) -> Outcome {
        self.estimator.push(Measurement {
            at_ns,
            channel,
            value,
        })
    }
}

impl Stage for LoadFilter {
    fn ports(&self) -> Vec<Port> {
        let LoadFilterConfig { signal, name, .. } = &self.config;
        let output = |what: &str, unit| Port::output(format!("{signal}/{name}{what}"), unit, 1);
        let mut ports = vec![
            output("", Unit::Newton),
            output("/deviation", Unit::Newton),
            output("/rate", Unit::NewtonPerSecond),
            output("/nis", Unit::One),
        ];
        if self.config.reference {
            ports.extend([
                output("/reference", Unit::Newton),
                output("/nees", Unit::One),
            ]);
        }
        if let Some(frequency) = &self.config.frequency {
            ports.push(Port::input(frequency, Unit::Hertz, 1));
        }
        ports
    }

    fn handle_sample(&mut self, sample: &TactileSample) {
        let state = &mut self.state;
        let at_ns = state.clock.advance(sample);
        let [piezoresistive, piezoelectric, reference] = state.low_passed(sample);
        state.reference = reference;
        let voltages = [
            (Channel::Piezoresistive, piezoresistive),
            (Channel::Piezoelectric, piezoelectric),
        ];
        for (n, (channel, volts)) in voltages.into_iter().enumerate() {
            if sample.saturated[n] || !self.config.ranges[n].contains(&sample.volts[n]) {
                state.unused += 1;
            } else {
                state.push(at_ns, channel, volts);
            }
        }
        if let Some(hertz) = state.frequency.take() {
            state.push(at_ns, Channel::Frequency, TAU * hertz);
        }
        self.publish();
    }

    fn begin_transfer(&mut self, _now: HostTime, from_process: &[f64]) {
        // It belongs to the next sample: its own time would make that one late.
        self.state.frequency = from_process.first().copied();
    }

    fn outputs(&self) -> &[f64] {
        &self.outputs
    }

    fn report(&self, diagnostics: &mut Diagnostics<'_>) {
        let counters = self.state.estimator.counters();
        let recoveries = self.state.estimator.estimate().recoveries;
        let dropped = counters.too_old + counters.duplicate + counters.invalid;
        let counts = [self.state.unused, counters.late, dropped, recoveries];
        for (name, count) in self.counters.iter().zip(counts) {
            diagnostics.count(name, count);
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.state)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.state = snapshot.read()?;
        self.publish();
        Ok(())
    }
}

//! Drawn loads, and the voltages of a simulated sensor under them.

use std::f64::consts::{PI, TAU};

use twinrig_kernel::stream;
use twinrig_sensor::{SensorFile, TactileParameters, TactileSensor};

/// Sample period \[s\] and \[ns\]: 1 kHz, as in the thesis.
pub const PERIOD_S: f64 = 1e-3;
pub const PERIOD_NS: u64 = 1_000_000;

/// Samples before those that are judged: one second.
pub const SETTLING: usize = 1000;

/// Periods of a run after its first second: the thesis' tests have at least ten.
const PERIODS: f64 = 10.0;

/// Full scale of the piezoelectric voltage \[V\], the range of its acquisition card. Biases are
/// shares of it: the thesis' "0.5 %" does not say of what.
pub const FULL_SCALE: f64 = 10.0;

/// Shape of a periodic load from 0 N to its peak.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Bump of eq. 4.17 with the sign corrected: exp(1 − 1/(1 − x²)).
    Bump,
    /// Harmonic rise and return of the bench's cam: (1 − cos φ)/2.
    Harmonic,
}

impl Shape {
    /// Returns value and derivative, of a load with peak 1, at a phase in periods.
    fn at(self, phase: f64) -> [f64; 2] {
        let part = phase.rem_euclid(1.0);
        match self {
            Self::Harmonic => {
                let angle = TAU * part;
                [0.5 * (1.0 - libm::cos(angle)), PI * libm::sin(angle)]
            }
            Self::Bump => {
                let x = 2.0 * part - 1.0;
                let rest = 1.0 - x * x;
                if rest <= 0.0 {
                    return [0.0; 2];
                }
                let value = libm::exp(1.0 - 1.0 / rest);
                [value, value * -4.0 * x / (rest * rest)]
            }
        }
    }
}

/// A load and the faults of its measurement.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    /// Place in its ensemble.
    pub index: u64,
    pub shape: Shape,
    /// Greatest load \[N\].
    pub peak: f64,
    /// Frequency \[Hz\].
    pub hz: f64,
    /// Standard deviations of the piezoresistive and the piezoelectric noise \[V\].
    pub noise: [f64; 2],
    /// Bias of the piezoelectric voltage \[V\].
    pub bias: f64,
}

/// Intervals from which draws are taken, uniformly.
#[derive(Clone, Copy, Debug)]
pub struct Ranges {
    /// \[N\].
    pub peak: [f64; 2],
    /// \[Hz\].
    pub hz: [f64; 2],
    /// \[V\].
    pub noise: [f64; 2],
    /// Magnitude, the sign is drawn; as a share of [`FULL_SCALE`].
    pub bias: [f64; 2],
}

impl Draw {
    /// Draws number `index` of an ensemble. Bumps and harmonic loads alternate.
    pub fn new(seed: u64, index: u64, ranges: &Ranges) -> Self {
        let mut random = stream(seed, &format!("fused/draw/{index}"));
        let mut within = |[low, high]: [f64; 2]| low + (high - low) * random.unit();
        let (peak, hz) = (within(ranges.peak), within(ranges.hz));
        let noise = [within(ranges.noise), within(ranges.noise)];
        let bias = within(ranges.bias) * FULL_SCALE;
        Self {
            index,
            shape: [Shape::Bump, Shape::Harmonic][(index % 2) as usize],
            peak,
            hz,
            noise,
            bias: if within([0.0, 1.0]) < 0.5 {
                -bias
            } else {
                bias
            },
        }
    }
}

/// Samples of a run, every [`PERIOD_S`] from time 0.
pub struct Samples {
    /// Load \[N\] and its rate \[N/s\].
    pub load: Vec<[f64; 2]>,
    /// Piezoresistive and piezoelectric voltage \[V\].
    pub volts: Vec<[f64; 2]>,
}

/// Returns the sensor of the tactile bench.
pub fn sensor() -> TactileParameters {
    let file = include_str!("../../../benches/tactile.toml");
    let file = SensorFile::parse("tactile.toml", file).unwrap();
    file.sensor().unwrap()
}

/// Returns load and rate every [`PERIOD_S`]; it starts at 0 N.
pub fn load(shape: Shape, peak: f64, hz: f64, seconds: f64) -> Vec<[f64; 2]> {
    let at = |at_s: f64| {
        let [value, slope] = shape.at(hz * at_s);
        [peak * value, peak * slope * hz]
    };
    let times = (0_u32..).map(|index| f64::from(index) * PERIOD_S);
    times.take_while(|&at_s| at_s < seconds).map(at).collect()
}

/// Returns a sensor that has been under 10 N for some time \[s\], and unloaded for a second.
pub fn crept(seconds: f64) -> TactileSensor {
    let mut sensor = TactileSensor::new(sensor(), 0.0).unwrap();
    if seconds > 0.0 {
        for (step, force) in [
            (PERIOD_S, 10.0),
            (seconds, 10.0),
            (PERIOD_S, 0.0),
            (1.0, 0.0),
        ] {
            sensor.advance(step, force);
        }
    }
    sensor
}

/// Returns the clean voltages of a sensor under a load.
pub fn voltages(mut sensor: TactileSensor, load: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let advance = |&[force, _]: &[f64; 2]| {
        sensor.advance(PERIOD_S, force);
        [sensor.piezoresistive_volts(), sensor.piezoelectric_volts()]
    };
    load.iter().map(advance).collect()
}

/// Sensor that measures the rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RateSensor {
    /// The piezoelectric cell with its charge amplifier.
    ChargeAmplifier,
    /// The simulation of the thesis, section 4.3.1.2: the rate times a gain \[V·s/N\].
    Ideal(f64),
}

/// Simulates a draw with a sensor that has crept for some time \[s\].
pub fn simulate(draw: &Draw, rate_sensor: RateSensor, crept_s: f64, seed: u64) -> Samples {
    let load = load(draw.shape, draw.peak, draw.hz, 1.0 + PERIODS / draw.hz);
    let mut volts = voltages(crept(crept_s), &load);
    let mut noise = [0, 1].map(|i| stream(seed, &format!("fused/noise/{}/{i}", draw.index)));
    for (volts, [_, rate]) in volts.iter_mut().zip(&load) {
        if let RateSensor::Ideal(gain) = rate_sensor {
            volts[1] = gain * rate;
        }
        volts[1] += draw.bias;
        for ((volts, noise), deviation) in volts.iter_mut().zip(&mut noise).zip(draw.noise) {
            *volts += deviation * noise.normal();
        }
    }
    Samples { load, volts }
}

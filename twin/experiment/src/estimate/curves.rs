//! Points of the figures.

use serde::Serialize;

use super::data::Signals;
use super::filter::FilterKind;
use super::identify::{Identification, simulated};
use super::validate::{EstimatePoint, Estimates, periods};

/// Frequencies of figures 4.13 and 4.15 \[Hz\].
pub(crate) const SHOWN_HZ: [f64; 2] = [1.0, 2.5];
/// Points of the loop at each frequency, about.
const LOOP_POINTS: usize = 60;
/// Points of a voltage over time, about.
const VOLTAGE_POINTS: usize = 160;

/// Point of the hysteresis loop (figure 4.11).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoopPoint {
    /// Force \[N\].
    pub force: f64,
    /// Whether it rises.
    pub rising: bool,
    /// Measured voltage \[V\].
    pub measured: f64,
    /// Voltage of the fitted model \[V\].
    pub fitted: f64,
}

/// Piezoelectric voltage of one instant (figure 4.13).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VoltagePoint {
    /// Time from the first point \[s\].
    pub at_s: f64,
    /// Measured voltage \[V\].
    pub measured: f64,
    /// In proportion to the rate \[V\].
    pub rate_sensor: f64,
    /// By rate and acceleration, with the coefficients of this frequency \[V\].
    pub coefficients: f64,
    /// Of the charge amplifier \[V\].
    pub amplifier: f64,
}

/// Piezoelectric voltage over two periods.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct VoltageCurve {
    /// Frequency \[Hz\].
    pub hz: f64,
    /// Points.
    pub points: Vec<VoltagePoint>,
}

/// Estimate over two periods (figure 4.15).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EstimateCurve {
    /// Name of the filter.
    pub filter: &'static str,
    /// Frequency \[Hz\].
    pub hz: f64,
    /// Points.
    pub points: Vec<EstimatePoint>,
}

/// Points of one period of each frequency.
pub(crate) fn loop_points(signals: &Signals, found: &Identification) -> Vec<LoopPoint> {
    let mut points = Vec::new();
    for part in &signals.parts {
        let Some(period) = periods(&signals.force, part.samples.clone())
            .into_iter()
            .next()
        else {
            continue;
        };
        let every = (period.len() / LOOP_POINTS).max(1);
        points.extend(period.step_by(every).map(|i| {
            let (force, rate) = (signals.force[i], signals.rate[i]);
            LoopPoint {
                force,
                rising: rate > 0.0,
                measured: signals.volts[0][i],
                fitted: found.hysteresis.model.at(force, rate).voltage,
            }
        }));
    }
    points
}

/// Voltages of two periods at the frequencies of the thesis' figures.
pub(crate) fn voltages(signals: &Signals, found: &Identification) -> Vec<VoltageCurve> {
    let amplifier = simulated(signals, &found.amplifier.model);
    let [gain, offset] = found.rate_sensor.model;
    let curve = |(index, part): (usize, &super::data::Part)| {
        if !SHOWN_HZ.iter().any(|hz| (part.hz - hz).abs() < 0.01 * hz) {
            return None;
        }
        let [a, b, bias] = found.coefficients.runs[index].model;
        let mut found = periods(&signals.force, part.samples.clone()).into_iter();
        let range = found.next()?.start..found.next()?.end;
        let (start, every) = (range.start, (range.len() / VOLTAGE_POINTS).max(1));
        let point = |i: usize| {
            let (rate, acceleration) = (signals.rate[i], signals.acceleration[i]);
            VoltagePoint {
                at_s: (i - start) as f64 * signals.period_s,
                measured: signals.volts[1][i],
                rate_sensor: gain * rate + offset,
                coefficients: a * rate + b * acceleration + bias,
                amplifier: amplifier[i],
            }
        };
        Some(VoltageCurve {
            hz: part.hz,
            points: range.step_by(every).map(point).collect(),
        })
    };
    signals.parts.iter().enumerate().filter_map(curve).collect()
}

/// Estimates of a filter at the frequencies of the thesis' figure.
pub(crate) fn estimates(
    kind: FilterKind,
    found: &Estimates,
    signals: &Signals,
) -> Vec<EstimateCurve> {
    let curve = |hz: f64| EstimateCurve {
        filter: kind.name(),
        hz,
        points: found.points(signals, hz),
    };
    let curves = SHOWN_HZ.map(curve).into_iter();
    curves.filter(|curve| !curve.points.is_empty()).collect()
}

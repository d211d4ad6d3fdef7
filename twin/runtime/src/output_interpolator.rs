use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Field, SignalKind};

/// Number of stored rows: the support of a cubic.
const ROWS: usize = 4;

/// Outputs of a plant at the last grid instants, interpolated between the last two or extrapolated
/// beyond the last.
///
/// | signal | interpolation | extrapolation (less than a step) |
/// |---|---|---|
/// | length or angle with an output rate | cubic Hermite | linear, along the rate |
/// | length or angle without | cubic through four rows | linear through two rows |
/// | orientation (quaternion) | the same per component, normalised | the same |
/// | rates, forces, torques, energies | linear | constant |
///
/// Quaternions are first moved to one hemisphere. Positions are continuous. Signals with jumps
/// would ring for three steps if interpolated by a cubic, and overshoot if extrapolated linearly: a
/// controller would react to forces that do not exist. The errors for a smooth position are
/// H⁴|x⁗|/384 (Hermite) and H⁴|x⁗|/24 (four rows), both of fourth order, and H²|ẍ|/2 for
/// extrapolation along the rate, of second order. Extrapolation along a parabola would be of third
/// order, but would retain half of a velocity jump in the preceding step, which disturbs loops with
/// high gain and low phase margin. If a velocity jumps within a step, every curve is wrong by the
/// displacement due to the jump; with the rate the error vanishes at the next instant, with the
/// cubic through four rows only when the jump is three steps old.
#[derive(Clone, Debug)]
pub(crate) struct OutputInterpolator {
    /// Time between two rows \[s\].
    step_s: f64,
    width: usize,
    curves: Vec<(std::ops::Range<usize>, Curve)>,
}

/// Ring buffer of the last rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rows {
    values: Vec<f64>,
    /// Index of the newest row, and number of valid rows.
    newest: usize,
    filled: usize,
}

#[derive(Clone, Copy, Debug)]
enum Curve {
    /// With the index of its rate.
    Hermite {
        rate: usize,
        wraps: bool,
    },
    Cubic {
        wraps: bool,
    },
    Orientation,
    Linear,
}

impl Rows {
    fn new(width: usize) -> Self {
        Self {
            values: vec![0.0; ROWS * width],
            newest: 0,
            filled: 0,
        }
    }

    /// Returns the number of values per row.
    pub(crate) fn width(&self) -> usize {
        self.values.len() / ROWS
    }

    /// Returns whether the indices are valid: a snapshot may contain arbitrary values.
    pub(crate) fn is_consistent(&self) -> bool {
        self.newest < ROWS && self.filled <= ROWS
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.filled == 0
    }

    pub(crate) fn clear(&mut self) {
        self.filled = 0;
    }

    /// Returns the oldest row, to be overwritten as the newest.
    pub(crate) fn push(&mut self) -> &mut [f64] {
        self.newest = (self.newest + 1) % ROWS;
        self.filled = (self.filled + 1).min(ROWS);
        let width = self.width();
        &mut self.values[self.newest * width..][..width]
    }

    /// Returns the row pushed `age` rows before the newest.
    fn row(&self, age: usize) -> &[f64] {
        let width = self.width();
        &self.values[(self.newest + ROWS - age) % ROWS * width..][..width]
    }
}

/// Times of the rows, newest first, in steps relative to the second newest.
const NODES: [f64; ROWS] = [1.0, 0.0, -1.0, -2.0];

/// Returns the Lagrange weights of the first `filled` nodes at time `at`.
fn lagrange(at: f64, filled: usize) -> [f64; ROWS] {
    let mut weights = [0.0; ROWS];
    for (i, weight) in weights.iter_mut().enumerate().take(filled) {
        let others = (0..filled).filter(|&j| j != i);
        *weight = others
            .map(|j| (at - NODES[j]) / (NODES[i] - NODES[j]))
            .product();
    }
    weights
}

/// Returns the cubic Hermite basis on the unit interval: weights of the total displacement and of
/// the slopes at its beginning and end.
fn hermite(at: f64) -> [f64; 3] {
    let rest = 1.0 - at;
    [
        at * at * (3.0 - 2.0 * at),
        at * rest * rest,
        -at * at * rest,
    ]
}

/// Wraps an angle to [−π, π].
fn wrap_angle(angle: f64) -> f64 {
    angle - TAU * libm::round(angle / TAU)
}

impl OutputInterpolator {
    pub(crate) fn new(step_s: f64, width: usize, fields: &[Field]) -> Self {
        let curve = |field: &Field| (field.range(), Curve::of(field, fields));
        Self {
            step_s,
            width,
            curves: fields.iter().map(curve).collect(),
        }
    }

    /// Creates an empty row buffer.
    pub(crate) fn rows(&self) -> Rows {
        Rows::new(self.width)
    }

    /// Interpolates the signal with index `field` at `at`: 0 at the second newest row, 1 at the
    /// newest.
    ///
    /// Requires two rows; with fewer than four, cubics are replaced by the polynomial through the
    /// available rows.
    pub(crate) fn interpolate(&self, rows: &Rows, at: f64, field: usize, out: &mut [f64]) {
        let Some((range, curve)) = self.curves.get(field) else {
            return;
        };
        let range = range.clone();
        match *curve {
            Curve::Hermite { rate, wraps } => {
                for (n, out) in out.iter_mut().enumerate() {
                    *out = self.hermite(rows, at, range.start + n, rate + n, wraps);
                }
            }
            Curve::Cubic { wraps } => {
                let weights = lagrange(at, rows.filled);
                for (index, out) in range.zip(out) {
                    *out = cubic(rows, &weights, index, wraps);
                }
            }
            Curve::Orientation => orientation(rows, &lagrange(at, rows.filled), range, out),
            Curve::Linear => {
                let (from, to) = (&rows.row(1)[range.clone()], &rows.row(0)[range]);
                for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
                    *out = from + at * (to - from);
                }
            }
        }
    }

    /// Extrapolates the signal with index `field` at `at`: 0 at the newest row, 1 one step later.
    /// Requires one row.
    pub(crate) fn extrapolate(&self, rows: &Rows, at: f64, field: usize, out: &mut [f64]) {
        let Some((range, curve)) = self.curves.get(field) else {
            return;
        };
        // In the nodes' scale, one step after the newest row is at 2.
        let weights = lagrange(1.0 + at, rows.filled.min(2));
        let newest = rows.row(0);
        match *curve {
            Curve::Hermite { rate, .. } => {
                let rates = &newest[rate..];
                for ((out, value), rate) in out.iter_mut().zip(&newest[range.clone()]).zip(rates) {
                    *out = value + at * self.step_s * rate;
                }
            }
            Curve::Cubic { wraps } => {
                let last = rows.row(rows.filled.min(2) - 1);
                for (index, out) in range.clone().zip(out) {
                    let difference = newest[index] - last[index];
                    let wrapped = wraps && difference.abs() > PI;
                    let difference = if wrapped {
                        wrap_angle(difference)
                    } else {
                        difference
                    };
                    *out = newest[index] + at * difference;
                }
            }
            Curve::Orientation => orientation(rows, &weights, range.clone(), out),
            Curve::Linear => out.copy_from_slice(&newest[range.clone()]),
        }
    }

    fn hermite(&self, rows: &Rows, at: f64, index: usize, rate: usize, wraps: bool) -> f64 {
        let (last, newest) = (rows.row(1), rows.row(0));
        let (slope_begin, slope_end) = (self.step_s * last[rate], self.step_s * newest[rate]);
        let mut difference = newest[index] - last[index];
        // The mean rate resolves the ambiguity by multiples of 2π: an unwrapped angle needs no
        // correction, an angle wrapped at ±π does.
        let correction = if wraps {
            TAU * libm::round((0.5 * (slope_begin + slope_end) - difference) / TAU)
        } else {
            0.0
        };
        difference += correction;
        let [displacement, first, second] = hermite(at);
        let value =
            last[index] + (displacement * difference + first * slope_begin + second * slope_end);
        if correction == 0.0 {
            value
        } else {
            wrap_angle(value)
        }
    }
}

/// Interpolates by weighted differences from the second newest row: a constant signal is reproduced
/// bit for bit.
fn cubic(rows: &Rows, weights: &[f64; ROWS], index: usize, wraps: bool) -> f64 {
    let base = rows.row(1)[index];
    let (mut sum, mut wrapped) = (0.0, false);
    for (age, weight) in weights.iter().enumerate().take(rows.filled) {
        let mut difference = rows.row(age)[index] - base;
        if wraps && difference.abs() > PI {
            (difference, wrapped) = (wrap_angle(difference), true);
        }
        sum += weight * difference;
    }
    if wrapped {
        wrap_angle(base + sum)
    } else {
        base + sum
    }
}

/// Interpolates quaternions. Since q and −q are the same rotation, rows in the other hemisphere are
/// negated first.
fn orientation(rows: &Rows, weights: &[f64; ROWS], range: std::ops::Range<usize>, out: &mut [f64]) {
    let base = &rows.row(0)[range.clone()];
    out.fill(0.0);
    for (age, weight) in weights.iter().enumerate().take(rows.filled) {
        let row = &rows.row(age)[range.clone()];
        let dot: f64 = row.iter().zip(base).map(|(a, b)| a * b).sum();
        let weight = if dot < 0.0 { -weight } else { *weight };
        for (out, value) in out.iter_mut().zip(row) {
            *out += weight * value;
        }
    }
    let norm = out.iter().map(|value| value * value).sum::<f64>().sqrt();
    if norm > 0.0 {
        for value in out {
            *value /= norm;
        }
    }
}

impl Curve {
    fn of(field: &Field, all: &[Field]) -> Self {
        let port = &field.port;
        let wraps = match port.kind {
            SignalKind::Position => false,
            SignalKind::Angle => true,
            SignalKind::Rotation => return Self::Orientation,
            SignalKind::Linear | SignalKind::RateOf(_) => return Self::Linear,
        };
        let is_rate = |other: &&Field| {
            let kind = &other.port.kind;
            matches!(kind, SignalKind::RateOf(of) if *of == port.name)
                && other.port.size == port.size
        };
        match all.iter().find(is_rate) {
            Some(rate) => Self::Hermite {
                rate: rate.offset,
                wraps,
            },
            None => Self::Cubic { wraps },
        }
    }
}

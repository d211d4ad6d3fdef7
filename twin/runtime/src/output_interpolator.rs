use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Field, Unit};

/// Rows of outputs that are kept: as many as a cubic takes.
const ROWS: usize = 4;

/// What a plant said at the last instants of its grid, and what it would say between the last two or after the last.
///
/// | signal | between two instants | less than a step after the last |
/// |---|---|---|
/// | length or angle whose rate the plant tells | Hermite's cubic | along its rate |
/// | length or angle without | the cubic through the last four | along the line through the last two |
/// | orientation, a quaternion | the same, component by component on one side of the sphere, made a unit again | the same |
/// | all others: rates, forces, torques, energies | a straight line | what it was |
///
/// Positions have no jumps. What has, would ring for three steps after one if a cubic went through it, and overshoot
/// on a line beyond its end: a controller would feel forces that never were. Of a smooth position cubics are of fourth order,
/// H⁴|x⁗|/384 and H⁴|x⁗|/24, and going along the rate is of second, H²|ẍ|/2; going along a parabola would be of third, but half of what a velocity
/// has jumped by in the step before would then still be in it, and loops with much gain and little phase feel that. Where a
/// velocity jumps within a step, every curve is wrong by what the jump covers in it; one that has the rate is right again from
/// the next instant on, the cubic through four only when the jump is three steps behind.
#[derive(Clone, Debug)]
pub(crate) struct OutputInterpolator {
    /// Seconds between two rows.
    step_s: f64,
    width: usize,
    curves: Vec<(std::ops::Range<usize>, Curve)>,
}

/// The rows themselves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rows {
    values: Vec<f64>,
    /// Which row is the newest, and how many there are.
    newest: usize,
    known: usize,
}

#[derive(Clone, Copy, Debug)]
enum Curve {
    /// With its rate at that place.
    Hermite {
        rate: usize,
        turns: bool,
    },
    Cubic {
        turns: bool,
    },
    Orientation,
    Straight,
}

impl Rows {
    fn new(width: usize) -> Self {
        Self {
            values: vec![0.0; ROWS * width],
            newest: 0,
            known: 0,
        }
    }

    /// How many values a row has.
    pub(crate) fn width(&self) -> usize {
        self.values.len() / ROWS
    }

    /// Whether they can be rows: a snapshot may be of anything.
    pub(crate) fn is_sound(&self) -> bool {
        self.newest < ROWS && self.known <= ROWS
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.known == 0
    }

    pub(crate) fn clear(&mut self) {
        self.known = 0;
    }

    /// A new row in place of the oldest, to be written.
    pub(crate) fn push(&mut self) -> &mut [f64] {
        self.newest = (self.newest + 1) % ROWS;
        self.known = (self.known + 1).min(ROWS);
        let width = self.width();
        &mut self.values[self.newest * width..][..width]
    }

    /// The row that was pushed so many before the newest.
    fn row(&self, before: usize) -> &[f64] {
        let width = self.width();
        &self.values[(self.newest + ROWS - before) % ROWS * width..][..width]
    }
}

/// Where the rows stand, newest first, in steps from the last but one.
const NODES: [f64; ROWS] = [1.0, 0.0, -1.0, -2.0];

/// Lagrange's weights of the first `known` nodes.
fn lagrange(at: f64, known: usize) -> [f64; ROWS] {
    let mut weights = [0.0; ROWS];
    for (i, weight) in weights.iter_mut().enumerate().take(known) {
        let others = (0..known).filter(|&j| j != i);
        *weight = others
            .map(|j| (at - NODES[j]) / (NODES[i] - NODES[j]))
            .product();
    }
    weights
}

/// Hermite's cubic from 0: what the whole way and the rates at its beginning and end count for, with a step of 1.
fn hermite(at: f64) -> [f64; 3] {
    let rest = 1.0 - at;
    [
        at * at * (3.0 - 2.0 * at),
        at * rest * rest,
        -at * at * rest,
    ]
}

/// An angle between −π and π.
fn within_a_turn(angle: f64) -> f64 {
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

    /// As many values as a row.
    pub(crate) fn rows(&self) -> Rows {
        Rows::new(self.width)
    }

    /// Writes a signal, the one of number `field`, at `at`: 0 at the last row but one, 1 at the last.
    ///
    /// There are at least two rows; as long as there are no four, it is the curve through what there is.
    pub(crate) fn interpolate(&self, rows: &Rows, at: f64, field: usize, out: &mut [f64]) {
        let Some((range, curve)) = self.curves.get(field) else {
            return;
        };
        let range = range.clone();
        match *curve {
            Curve::Hermite { rate, turns } => {
                for (n, out) in out.iter_mut().enumerate() {
                    *out = self.hermite(rows, at, range.start + n, rate + n, turns);
                }
            }
            Curve::Cubic { turns } => {
                let weights = lagrange(at, rows.known);
                for (place, out) in range.zip(out) {
                    *out = cubic(rows, &weights, place, turns);
                }
            }
            Curve::Orientation => orientation(rows, &lagrange(at, rows.known), range, out),
            Curve::Straight => {
                let (from, to) = (&rows.row(1)[range.clone()], &rows.row(0)[range]);
                for ((out, from), to) in out.iter_mut().zip(from).zip(to) {
                    *out = from + at * (to - from);
                }
            }
        }
    }

    /// Writes a signal at `at`: 0 at the last row, 1 a step later. There is at least one row.
    pub(crate) fn extrapolate(&self, rows: &Rows, at: f64, field: usize, out: &mut [f64]) {
        let Some((range, curve)) = self.curves.get(field) else {
            return;
        };
        // One step on from the last row is two on from the one before.
        let line = lagrange(1.0 + at, rows.known.min(2));
        let newest = rows.row(0);
        match *curve {
            Curve::Hermite { rate, .. } => {
                let rates = &newest[rate..];
                for ((out, value), rate) in out.iter_mut().zip(&newest[range.clone()]).zip(rates) {
                    *out = value + at * self.step_s * rate;
                }
            }
            Curve::Cubic { turns } => {
                let last = rows.row(rows.known.min(2) - 1);
                for (place, out) in range.clone().zip(out) {
                    let way = newest[place] - last[place];
                    let turned = turns && way.abs() > PI;
                    let way = if turned { within_a_turn(way) } else { way };
                    *out = newest[place] + at * way;
                }
            }
            Curve::Orientation => orientation(rows, &line, range.clone(), out),
            Curve::Straight => out.copy_from_slice(&newest[range.clone()]),
        }
    }

    fn hermite(&self, rows: &Rows, at: f64, place: usize, rate: usize, turns: bool) -> f64 {
        let (last, newest) = (rows.row(1), rows.row(0));
        let (begins, ends) = (self.step_s * last[rate], self.step_s * newest[rate]);
        let mut way = newest[place] - last[place];
        // The rates say which way round: an angle that is counted on needs nothing, one that begins again at a half turn does.
        let turned = if turns {
            TAU * libm::round((0.5 * (begins + ends) - way) / TAU)
        } else {
            0.0
        };
        way += turned;
        let [whole, first, second] = hermite(at);
        let value = last[place] + (whole * way + first * begins + second * ends);
        if turned == 0.0 {
            value
        } else {
            within_a_turn(value)
        }
    }
}

/// Differences from the last row but one, weighed: what does not move stays as it is, to the bit.
fn cubic(rows: &Rows, weights: &[f64; ROWS], place: usize, turns: bool) -> f64 {
    let base = rows.row(1)[place];
    let (mut sum, mut turned) = (0.0, false);
    for (before, weight) in weights.iter().enumerate().take(rows.known) {
        let mut way = rows.row(before)[place] - base;
        if turns && way.abs() > PI {
            (way, turned) = (within_a_turn(way), true);
        }
        sum += weight * way;
    }
    if turned {
        within_a_turn(base + sum)
    } else {
        base + sum
    }
}

/// A quaternion and its negative are the same: those on the other side of the sphere are turned round first.
fn orientation(rows: &Rows, weights: &[f64; ROWS], range: std::ops::Range<usize>, out: &mut [f64]) {
    let base = &rows.row(0)[range.clone()];
    out.fill(0.0);
    for (before, weight) in weights.iter().enumerate().take(rows.known) {
        let row = &rows.row(before)[range.clone()];
        let along: f64 = row.iter().zip(base).map(|(a, b)| a * b).sum();
        let weight = if along < 0.0 { -weight } else { *weight };
        for (out, value) in out.iter_mut().zip(row) {
            *out += weight * value;
        }
    }
    let length = out.iter().map(|value| value * value).sum::<f64>().sqrt();
    if length > 0.0 {
        for value in out {
            *value /= length;
        }
    }
}

impl Curve {
    fn of(field: &Field, all: &[Field]) -> Self {
        let port = &field.port;
        let turns = port.unit == Unit::Radian;
        match port.unit {
            Unit::Meter | Unit::Radian => {
                let rate = rate_names(&port.name)
                    .filter_map(|name| all.iter().find(|other| other.port.name == name))
                    .find(|other| {
                        other.port.size == port.size && Some(other.port.unit) == rate_of(port.unit)
                    });
                match rate {
                    Some(rate) => Self::Hermite {
                        rate: rate.offset,
                        turns,
                    },
                    None => Self::Cubic { turns },
                }
            }
            Unit::One if port.size == 4 && port.name.ends_with("orientation") => Self::Orientation,
            _ => Self::Straight,
        }
    }
}

fn rate_of(unit: Unit) -> Option<Unit> {
    match unit {
        Unit::Meter => Some(Unit::MeterPerSecond),
        Unit::Radian => Some(Unit::RadianPerSecond),
        _ => None,
    }
}

const POSITION: &str = "/position";
const RATES: [&str; 2] = ["/rate", "/velocity"];

/// What the rate of a signal would be called: `leg/LF/hip/rate` of `leg/LF/hip/position`.
fn rate_names(name: &str) -> impl Iterator<Item = String> {
    let stem = name.strip_suffix(POSITION);
    stem.into_iter()
        .flat_map(|stem| RATES.map(|rate| format!("{stem}{rate}")))
}

/// What `name` would be the rate of.
pub(crate) fn integral_of(name: &str) -> Option<String> {
    let stem = RATES.iter().find_map(|rate| name.strip_suffix(rate))?;
    Some(format!("{stem}{POSITION}"))
}

//! Tabulated spring energy: bicubic in span and angle between knee and foot.

use libm::{atan2, cos, sin, sqrt};

use crate::leg::LegError;
use crate::leg::pantograph::{Pantograph, Planar, rotated};
use crate::leg::pose::Gradient;

/// Sine of the ankle angle below which the leg counts as folded: the energy's derivatives grow
/// without bound there, and the error bound excludes it.
const FOLDED: f64 = 0.4;

/// Bicubic Hermite table of the spring energy over the foot position in the frame of the first
/// segment.
///
/// Force and hip torque are the gradient of the interpolated energy, so the force field of the
/// table is conservative. That of a table of forces as in the thesis (section 2.7.2,
/// [`Self::with_linear_forces`]) is not. The energy is smooth over the whole table because the
/// stops are not part of it but constraints; no cell contains a kink.
#[derive(Debug, Clone)]
pub struct EnergyTable {
    leg: Pantograph,
    span: Axis,
    angle: Axis,
    /// Energy, its derivatives by span and by angle, and the mixed derivative, of each node; span
    /// varies fastest.
    nodes: Vec<[f64; 4]>,
    linear_forces: bool,
    error: TableError,
}

/// Greatest error of a table over the poses within the stops whose ankle is not folded, sampled at
/// the quarter points of every cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableError {
    /// Error of the energy \[J\].
    pub energy: f64,
    /// Error of the force on the foot \[N\].
    pub force: f64,
    /// Error of the hip torque \[N·m\].
    pub torque: f64,
}

#[derive(Debug, Clone, Copy)]
struct Axis {
    start: f64,
    step: f64,
    cells: usize,
}

impl Axis {
    fn over(start: f64, end: f64, cells: usize) -> Self {
        Self {
            start,
            step: (end - start) / cells as f64,
            cells,
        }
    }

    fn at(self, node: f64) -> f64 {
        self.start + self.step * node
    }

    /// Returns the cell and the position within it in [0, 1], or `None` outside the table.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 ≤ position < cells + 1"
    )]
    fn cell(self, value: f64) -> Option<(usize, f64)> {
        let position = (value - self.start) / self.step;
        if !(position >= 0.0 && position <= self.cells as f64) {
            return None;
        }
        let cell = (position as usize).min(self.cells - 1);
        Some((cell, position - cell as f64))
    }
}

/// Returns values and derivatives at `s` of the cubic Hermite basis (value left, slope left, value
/// right, slope right).
fn basis(s: f64) -> ([f64; 4], [f64; 4]) {
    let (s2, s3) = (s * s, s * s * s);
    (
        [
            2.0 * s3 - 3.0 * s2 + 1.0,
            s3 - 2.0 * s2 + s,
            3.0 * s2 - 2.0 * s3,
            s3 - s2,
        ],
        [
            6.0 * (s2 - s),
            3.0 * s2 - 4.0 * s + 1.0,
            6.0 * (s - s2),
            3.0 * s2 - 2.0 * s,
        ],
    )
}

impl EnergyTable {
    /// Tabulates a leg with `cells` cells along each axis, over the workspace within its stops and
    /// a margin.
    ///
    /// # Errors
    /// [`LegError`] where the leg has no pose at a node.
    pub fn new(leg: &Pantograph, cells: usize) -> Result<Self, LegError> {
        let (span, angle) = domain(leg, cells)?;
        let mut table = Self {
            leg: leg.clone(),
            span,
            angle,
            nodes: Vec::new(),
            linear_forces: false,
            error: TableError {
                energy: 0.0,
                force: 0.0,
                torque: 0.0,
            },
        };
        for j in 0..=cells {
            for i in 0..=cells {
                let (r, a) = (span.at(i as f64), angle.at(j as f64));
                let (energy, by_span, by_angle) = table.exact(r, a)?;
                // Central differences of exact slopes replace a lengthy closed form of the mixed
                // derivative; their error is far below that of the table.
                let h = 1e-5 * span.step;
                let mixed = (table.exact(r + h, a)?.2 - table.exact(r - h, a)?.2) / (2.0 * h);
                table.nodes.push([energy, by_span, by_angle, mixed]);
            }
        }
        table.error = table.greatest_error()?;
        Ok(table)
    }

    /// Interpolates the forces linearly between those of the nodes, along span and angle. The
    /// energy remains that of the cubic interpolation, of which these forces are not the gradient.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_linear_forces(mut self) -> Result<Self, LegError> {
        self.linear_forces = true;
        self.error = self.greatest_error()?;
        Ok(self)
    }

    fn greatest_error(&self) -> Result<TableError, LegError> {
        let mut error = TableError {
            energy: 0.0,
            force: 0.0,
            torque: 0.0,
        };
        for j in 0..4 * self.angle.cells {
            for i in 0..4 * self.span.cells {
                let (r, a) = (
                    self.span.at((i as f64 + 0.5) / 4.0),
                    self.angle.at((j as f64 + 0.5) / 4.0),
                );
                let foot = Planar::new(sin(a), -cos(a)) * r + Planar::new(0.0, -self.leg.l1);
                let pose = self.leg.pose(0.0, 1.0, foot)?;
                if !self.leg.allows(&pose) || pose.ankle_sine < FOLDED {
                    continue;
                }
                let exact = self.leg.spring_gradient(&pose);
                let (energy, gradient) = self.look_up(0.0, 1.0, foot)?;
                error.energy = error
                    .energy
                    .max((energy - self.leg.spring_energy(&pose)).abs());
                error.force = error.force.max((gradient.foot - exact.foot).norm());
                error.torque = error.torque.max((gradient.hip - exact.hip).abs());
            }
        }
        Ok(error)
    }

    /// Returns the greatest error of the table.
    pub fn error(&self) -> TableError {
        self.error
    }

    /// Returns spring energy \[J\] and its gradient at a hip angle (absolute, as sine and cosine)
    /// and a foot position.
    ///
    /// # Errors
    /// [`LegError::NoTriangle`] outside the table.
    pub fn look_up(
        &self,
        hip_sine: f64,
        hip_cosine: f64,
        foot: Planar,
    ) -> Result<(f64, Gradient), LegError> {
        let first = Planar::new(hip_sine, -hip_cosine);
        let span = foot - first * self.leg.l1;
        let r = span.norm();
        let angle = atan2(first.x * span.y - first.y * span.x, first.dot(&span));
        let (Some((i, s)), Some((j, t))) = (self.span.cell(r), self.angle.cell(angle)) else {
            let (least, greatest) = (self.span.start, self.span.at(self.span.cells as f64));
            return Err(LegError::NoTriangle {
                distance: r,
                least,
                greatest,
            });
        };
        let (bs, ds) = basis(s);
        let (bt, dt) = basis(t);
        let row = self.span.cells + 1;
        let (mut energy, mut by_s, mut by_t) = (0.0, 0.0, 0.0);
        for (node, right, up) in [
            (j * row + i, 0, 0),
            (j * row + i + 1, 2, 0),
            ((j + 1) * row + i, 0, 2),
            ((j + 1) * row + i + 1, 2, 2),
        ] {
            let [value, by_span, by_angle, mixed] = self.nodes[node];
            let (slope_s, slope_t) = (by_span * self.span.step, by_angle * self.angle.step);
            let twist = mixed * self.span.step * self.angle.step;
            let along =
                |b: &[f64; 4], value: f64, slope: f64| b[right] * value + b[right + 1] * slope;
            energy += bt[up] * along(&bs, value, slope_s) + bt[up + 1] * along(&bs, slope_t, twist);
            by_s += bt[up] * along(&ds, value, slope_s) + bt[up + 1] * along(&ds, slope_t, twist);
            by_t += dt[up] * along(&bs, value, slope_s) + dt[up + 1] * along(&bs, slope_t, twist);
        }
        if self.linear_forces {
            (by_s, by_t) = self.linear((i, s), (j, t));
        }
        let outward = span / r;
        let foot_force =
            outward * (by_s / self.span.step) + rotated(outward) * (by_t / self.angle.step / r);
        // The hip angle moves the knee and rotates the frame of the angle.
        let hip = -rotated(first).dot(&foot_force) * self.leg.l1 - by_t / self.angle.step;
        Ok((
            energy,
            Gradient {
                hip,
                foot: foot_force,
            },
        ))
    }

    /// Returns the derivatives of the energy by the places in a cell, each interpolated linearly.
    fn linear(&self, (i, s): (usize, f64), (j, t): (usize, f64)) -> (f64, f64) {
        let row = self.span.cells + 1;
        let (mut by_span, mut by_angle) = (0.0, 0.0);
        for (node, weight) in [
            (j * row + i, (1.0 - s) * (1.0 - t)),
            (j * row + i + 1, s * (1.0 - t)),
            ((j + 1) * row + i, (1.0 - s) * t),
            ((j + 1) * row + i + 1, s * t),
        ] {
            let [_, along_span, along_angle, _] = self.nodes[node];
            by_span += weight * along_span;
            by_angle += weight * along_angle;
        }
        (by_span * self.span.step, by_angle * self.angle.step)
    }

    /// Returns the energy and its derivatives by span and angle.
    fn exact(&self, span: f64, angle: f64) -> Result<(f64, f64, f64), LegError> {
        let outward = Planar::new(sin(angle), -cos(angle));
        let pose = self
            .leg
            .pose(0.0, 1.0, outward * span + Planar::new(0.0, -self.leg.l1))?;
        let foot = self.leg.spring_gradient(&pose).foot;
        Ok((
            self.leg.spring_energy(&pose),
            foot.dot(&outward),
            foot.dot(&rotated(outward)) * span,
        ))
    }
}

/// Returns the ranges of span and angle within the stops, with a margin for poses slightly beyond a
/// stop.
fn domain(leg: &Pantograph, cells: usize) -> Result<(Axis, Axis), LegError> {
    const MARGIN: f64 = 0.05;
    const SAMPLES: usize = 32;
    let bottomed =
        (leg.diagonal_min * leg.diagonal_min - leg.l2 * leg.l2 - leg.l_delta * leg.l_delta)
            / (2.0 * leg.l2 * leg.l_delta);
    let flexed = -crate::leg::pantograph::angle_of(bottomed, "diagonal_min", leg.diagonal_min)?;
    let (mut spans, mut angles) = ((f64::INFINITY, 0.0_f64), (f64::INFINITY, f64::NEG_INFINITY));
    for i in 0..=SAMPLES {
        let q2_bar = flexed + (-leg.q2_ref - flexed) * i as f64 / SAMPLES as f64;
        let widest = leg
            .opening_stop(q2_bar + leg.q2_ref)
            .map_or(0.0, |stop| stop.value);
        for j in 0..=SAMPLES {
            let opening = widest * j as f64 / SAMPLES as f64;
            if sin(opening - q2_bar) < FOLDED {
                continue;
            }
            let (x, z) = (
                leg.l2 * cos(q2_bar) + leg.b * cos(opening),
                leg.l2 * sin(q2_bar) + leg.b * sin(opening),
            );
            let (span, angle) = (sqrt(x * x + z * z), atan2(z, x));
            spans = (spans.0.min(span), spans.1.max(span));
            angles = (angles.0.min(angle), angles.1.max(angle));
        }
    }
    let reach = leg.l2 + leg.b;
    let pad = MARGIN * (angles.1 - angles.0);
    let outer = (spans.1 + MARGIN * (spans.1 - spans.0)).min(0.5 * (spans.1 + reach));
    let inner =
        (spans.0 - MARGIN * (spans.1 - spans.0)).max(0.5 * (spans.0 + (leg.l2 - leg.b).abs()));
    Ok((
        Axis::over(inner, outer, cells),
        Axis::over(angles.0 - pad, angles.1 + pad, cells),
    ))
}

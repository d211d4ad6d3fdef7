//! The linear systems of the stages, reduced to the legs' velocities: of each leg on a fixed trunk,
//! or of trunk and legs together.

use twinrig_contact::Factors;

use super::coefficients::GAMMA;
use crate::constraints::workspace::Workspace;
use crate::integrators::jacobian::{Direction, Jacobian};
use crate::integrators::lanewise::{Column, LaneFactors, ROWS};
use crate::model::real::{Dual, Lanes, Real};
use crate::model::state::Slope;

/// Number of trunk coordinates: position, attitude, velocity, angular velocity.
pub(super) const TRUNK: usize = 13;

/// Memory of the factorisation.
#[derive(Debug, Clone)]
pub(super) struct Memory<const N: usize> {
    workspace: Workspace<Dual<f64>, N>,
    /// Derivatives of the right-hand side with respect to the trunk's coordinates, to the legs'
    /// positions, and to their velocities including their effect on positions.
    columns: Vec<Slope<Lanes, N>>,
    factors: Factors,
}

impl<const N: usize> Default for Memory<N> {
    fn default() -> Self {
        Self {
            workspace: Workspace::default(),
            columns: Vec::new(),
            factors: Factors::default(),
        }
    }
}

/// Factorisation of I − hγJ.
#[expect(
    clippy::large_enum_variant,
    reason = "one instance per step; heap allocation must be avoided"
)]
pub(super) enum System<'a, const N: usize> {
    Islands(Islands),
    Coupled(&'a Memory<N>),
}

/// Factorisations of independent legs.
pub(super) struct Islands {
    factors: LaneFactors,
    /// ∂a/∂x by columns.
    stiffness: [Column; ROWS],
    /// Derivatives of dissipated, actuator and external power with respect to positions and
    /// velocities.
    powers: [[[Lanes; 3]; ROWS]; 2],
}

impl<const N: usize> Memory<N> {
    /// Factors the system of a step; none if it is singular. The length may differ from lane to
    /// lane on a fixed trunk only.
    pub(super) fn factor(
        &mut self,
        jacobian: &mut Jacobian<'_, N>,
        h: Lanes,
    ) -> Option<System<'_, N>> {
        if !jacobian.model.is_free() {
            return Some(System::Islands(self.factor_islands(jacobian, h)));
        }
        let regular = self.factor_coupled(jacobian, h.lane(0));
        regular.then_some(System::Coupled(self))
    }

    /// Factors the systems of the legs on a fixed trunk.
    pub(super) fn factor_islands(&mut self, jacobian: &mut Jacobian<'_, N>, h: Lanes) -> Islands {
        let (zero, one) = (Lanes::zero(), Lanes::splat(1.0));
        let step = h * Lanes::splat(GAMMA);
        let coordinates = jacobian.model.coordinates();
        let mut matrix = [[zero; ROWS]; ROWS];
        let mut stiffness = [[zero; ROWS]; ROWS];
        let mut powers = [[[zero; 3]; ROWS]; 2];
        for k in 0..coordinates {
            let [by_x, by_v] =
                directions::<N>(k).map(|to| jacobian.column(to, one, &mut self.workspace));
            stiffness[k] = velocities(&by_x);
            let damping = velocities(&by_v);
            for i in 0..coordinates {
                matrix[i][k] = -(step * (damping[i] + step * stiffness[k][i]));
            }
            matrix[k][k] += one;
            powers[0][k] = powers_of(&by_x);
            powers[1][k] = powers_of(&by_v);
        }
        Islands {
            factors: LaneFactors::new(matrix, coordinates),
            stiffness,
            powers,
        }
    }

    /// Factors the system of trunk and legs; returns false if it is singular.
    pub(super) fn factor_coupled(&mut self, jacobian: &mut Jacobian<'_, N>, h: f64) -> bool {
        let step = h * GAMMA;
        let (coordinates, count) = (jacobian.model.coordinates(), jacobian.model.legs.len());
        let one = Lanes::splat(1.0);
        self.columns.clear();
        for number in 0..TRUNK {
            let direction = trunk_direction(number);
            // Without contacts the dynamics are invariant under translation.
            let invariant =
                matches!(direction, Direction::Position(_)) && jacobian.mode.contacts.is_empty();
            let column = if invariant {
                Slope::zero()
            } else {
                jacobian.column(direction, one, &mut self.workspace)
            };
            self.columns.push(column);
        }
        for which in 0..2 {
            for leg in 0..count {
                let seed = Lanes::zero().with_lane(leg, 1.0);
                for k in 0..coordinates {
                    let to = directions::<N>(k)[which];
                    let mut column = jacobian.column(to, seed, &mut self.workspace);
                    if which == 1 {
                        let by_x = self.columns[TRUNK + leg * coordinates + k];
                        column.add(step, &by_x, true);
                    }
                    self.columns.push(column);
                }
            }
        }
        let rows = TRUNK + count * coordinates;
        let matrix = self.factors.matrix(rows);
        let stride = matrix.len() / rows;
        for row in 0..rows {
            for column in 0..rows {
                // The columns of the legs' velocities follow those of their positions.
                let from = if column < TRUNK {
                    column
                } else {
                    column + count * coordinates
                };
                let entry = -step * number(&self.columns[from], row, coordinates);
                matrix[row * stride + column] = entry + if row == column { 1.0 } else { 0.0 };
            }
        }
        self.factors.factor().is_ok()
    }
}

impl Islands {
    /// Solves (I − hγJ) U = R in every lane; `step` is hγ.
    pub(super) fn solve<const N: usize>(
        &self,
        right: &Slope<Lanes, N>,
        step: Lanes,
        coordinates: usize,
    ) -> Slope<Lanes, N> {
        let mut x = positions(right);
        let mut v = velocities(right);
        for i in 0..coordinates {
            let mut stiff = Lanes::zero();
            for (column, r) in self.stiffness.iter().zip(&x).take(coordinates) {
                stiff += column[i] * *r;
            }
            v[i] += step * stiff;
        }
        v = self.factors.solve(v);
        let mut powers = powers_of(right);
        for k in 0..coordinates {
            x[k] += step * v[k];
            for (p, power) in powers.iter_mut().enumerate() {
                *power += step * (self.powers[0][k][p] * x[k] + self.powers[1][k][p] * v[k]);
            }
        }
        let mut solution = Slope::zero();
        for k in 0..N {
            (solution.angles[k], solution.rates[k]) = (x[k], v[k]);
        }
        if coordinates > N {
            (solution.pulley, solution.pulley_rate) = (x[N], v[N]);
        }
        [solution.dissipated, solution.actuator, solution.external] = powers;
        solution
    }
}

impl<const N: usize> Memory<N> {
    /// Solves (I − hγJ) U = R for the whole robot; `step` is hγ.
    pub(super) fn solve(
        &self,
        mut right: Slope<Lanes, N>,
        step: f64,
        coordinates: usize,
        legs: usize,
    ) -> Slope<Lanes, N> {
        let size = legs * coordinates;
        let known = right;
        for (at, column) in self.columns[TRUNK..TRUNK + size].iter().enumerate() {
            let r = positions(&known)[at % coordinates].lane(at / coordinates);
            right.add(step * r, column, true);
        }
        let mut numbers = [0.0; NUMBERS_MAX];
        for (row, to) in numbers.iter_mut().enumerate().take(TRUNK + size) {
            *to = number(&right, row, coordinates);
        }
        let padded = self.factors.stride();
        self.factors.solve(&mut numbers[..padded]);
        let mut solution = Slope::zero();
        solution.dissipated = right.dissipated;
        solution.actuator = right.actuator;
        solution.external = right.external;
        for (row, &u) in numbers.iter().enumerate().take(TRUNK + size) {
            let from = if row < TRUNK { row } else { row + size };
            let column = &self.columns[from];
            solution.dissipated += Lanes::splat(step * u) * column.dissipated;
            solution.actuator += Lanes::splat(step * u) * column.actuator;
            solution.external += Lanes::splat(step * u) * column.external;
            if let Some(trunk) = trunk_number(&mut solution, row) {
                *trunk = u;
                continue;
            }
            let (leg, k) = ((row - TRUNK) / coordinates, (row - TRUNK) % coordinates);
            let x = positions(&known)[k].lane(leg) + step * u;
            let [to_x, to_v] = if k < N {
                [&mut solution.angles[k], &mut solution.rates[k]]
            } else {
                [&mut solution.pulley, &mut solution.pulley_rate]
            };
            *to_x = to_x.with_lane(leg, x);
            *to_v = to_v.with_lane(leg, u);
        }
        solution
    }
}

/// Maximum number of trunk coordinates and leg velocities, in blocks of four.
const NUMBERS_MAX: usize = 36;
const _: () = assert!(NUMBERS_MAX >= TRUNK + 4 * ROWS);

/// Returns the directions of position and velocity of a leg coordinate.
pub(super) fn directions<const N: usize>(k: usize) -> [Direction; 2] {
    if k < N {
        [Direction::Angle(k), Direction::Rate(k)]
    } else {
        [Direction::Pulley, Direction::PulleyRate]
    }
}

pub(super) fn trunk_direction(number: usize) -> Direction {
    match number {
        0..3 => Direction::Position(number),
        3..7 => Direction::Attitude(number - 3),
        7..10 => Direction::Velocity(number - 7),
        _ => Direction::Turning(number - 10),
    }
}

/// Returns a coordinate of the trunk, in the order of [`trunk_direction`].
fn trunk_number<const N: usize>(slope: &mut Slope<Lanes, N>, number: usize) -> Option<&mut f64> {
    Some(match number {
        0..3 => &mut slope.position[number],
        3..7 => &mut slope.attitude[number - 3],
        7..10 => &mut slope.velocity[number - 7],
        10..TRUNK => &mut slope.turning[number - 10],
        _ => return None,
    })
}

/// Returns a row of the coupled system: the trunk's coordinates, then the legs' velocities, leg by
/// leg.
pub(super) fn number<const N: usize>(
    slope: &Slope<Lanes, N>,
    row: usize,
    coordinates: usize,
) -> f64 {
    match row {
        0..3 => slope.position[row],
        3..7 => slope.attitude[row - 3],
        7..10 => slope.velocity[row - 7],
        10..TRUNK => slope.turning[row - 10],
        _ => {
            let (leg, k) = ((row - TRUNK) / coordinates, (row - TRUNK) % coordinates);
            let lanes = if k < N {
                slope.rates[k]
            } else {
                slope.pulley_rate
            };
            lanes.lane(leg)
        }
    }
}

/// Returns the powers: dissipated, actuator, external.
fn powers_of<const N: usize>(slope: &Slope<Lanes, N>) -> [Lanes; 3] {
    [slope.dissipated, slope.actuator, slope.external]
}

/// Returns the slopes of angles and pulley angle.
pub(super) fn positions<const N: usize>(slope: &Slope<Lanes, N>) -> Column {
    let mut column = [slope.pulley; ROWS];
    column[..N].copy_from_slice(&slope.angles);
    column
}

/// Returns the slopes of rates and pulley rate.
pub(super) fn velocities<const N: usize>(slope: &Slope<Lanes, N>) -> Column {
    let mut column = [slope.pulley_rate; ROWS];
    column[..N].copy_from_slice(&slope.rates);
    column
}

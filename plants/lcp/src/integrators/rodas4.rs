//! RODAS: a six-stage Rosenbrock method of order 4 with an embedded method of order 3, L-stable and
//! stiffly accurate (Hairer and Wanner, *Solving Ordinary Differential Equations II*, 1996, section
//! IV.7; the coefficients are those of their code of that name, in the variables U of equation
//! 7.25).
//!
//! ```text
//! (I − hγ J) Uᵢ = hγ f(y + Σⱼ aᵢⱼ Uⱼ) + γ Σⱼ cᵢⱼ Uⱼ        y⁺ = y + Σⱼ mⱼ Uⱼ        y⁺ − ŷ⁺ = U₆
//! ```
//!
//! Within a step the system is autonomous, as commands are constant. Of the state y = (x, v),
//! angles and rates of links and pulleys satisfy ẋ = v, so that U = (X, V) with the right-hand side
//! (r, s) follows from half as many equations:
//!
//! ```text
//! X = r + hγ V        (I − hγ ∂a/∂v − h²γ² ∂a/∂x) V = s + hγ ∂a/∂x r        a = v̇
//! ```
//!
//! The attitude of the trunk is integrated as a quaternion, whose length is not determined by the
//! equations, and normalised after the step; the change is below the error of the method. The work
//! of friction and the work of the motors are two more states on which nothing depends: their rows
//! are filled in afterwards, and the energy balance has the order of the method.

use twinrig_contact::Factors;

use crate::constraints::motion::{Motion, Workspace};
use crate::integrators::flow::Flow;
use crate::integrators::jacobian::Direction;
use crate::integrators::lanewise::{Column, LaneFactors, ROWS};
use crate::model::real::{Dual, Lanes, Real};
use crate::model::state::{Slope, State, normalised};

const STAGES: usize = 6;

/// γ.
const GAMMA: f64 = 0.25;

/// aᵢⱼ of the second to the last stage. The solution is that of the last stage plus U₆: mⱼ = a₆ⱼ,
/// m₆ = 1.
const A: [[f64; STAGES - 1]; STAGES - 1] = [
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [
        0.946_678_528_081_582_6,
        0.255_701_169_898_328_4,
        0.0,
        0.0,
        0.0,
    ],
    [
        3.314_825_187_068_521,
        2.896_124_015_972_201,
        0.998_641_913_997_781_7,
        0.0,
        0.0,
    ],
    [
        1.221_224_509_226_641,
        6.019_134_481_288_629,
        12.537_083_329_320_87,
        -0.687_886_036_105_895,
        0.0,
    ],
    [
        1.221_224_509_226_641,
        6.019_134_481_288_629,
        12.537_083_329_320_87,
        -0.687_886_036_105_895,
        1.0,
    ],
];

/// cᵢⱼ of the second to the last stage.
const C: [[f64; STAGES - 1]; STAGES - 1] = [
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [
        -2.430_093_356_833_875,
        -0.206_359_915_709_191_5,
        0.0,
        0.0,
        0.0,
    ],
    [
        -0.107_352_905_815_137_5,
        -9.594_562_251_023_355,
        -20.470_286_148_096_16,
        0.0,
        0.0,
    ],
    [
        7.496_443_313_967_647,
        -10.246_804_314_643_52,
        -33.999_903_528_199_05,
        11.708_908_932_061_6,
        0.0,
    ],
    [
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
    ],
];

/// Number of trunk coordinates: position, attitude, velocity, angular velocity.
const TRUNK: usize = 13;

/// Result of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rodas<const N: usize> {
    pub(crate) end: State<Lanes, N>,
    /// Work dissipated by friction and work of the motors, by leg \[J\].
    pub(crate) dissipated: Lanes,
    pub(crate) actuator: Lanes,
    /// Difference of the two methods as a displacement of a foot or the trunk \[m\]. Infinite for a
    /// failed step, for instance where I − hγJ is singular; a shorter step may succeed.
    pub(crate) error: Lanes,
}

/// Memory of a step.
#[derive(Debug, Clone)]
pub(crate) struct Memory<const N: usize> {
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
enum System<'a, const N: usize> {
    Islands(Islands),
    Coupled(&'a Memory<N>),
}

/// Factorisations of independent legs.
struct Islands {
    factors: LaneFactors,
    /// ∂a/∂x by columns.
    stiffness: [Column; ROWS],
    /// Derivatives of dissipated and actuator power with respect to positions and velocities.
    powers: [[[Lanes; 2]; ROWS]; 2],
}

impl<const N: usize> Flow<N> {
    /// Computes one step; its length may differ from lane to lane on a fixed trunk only. `start` is
    /// the motion at `state`, in the present mode.
    pub(crate) fn rodas4_step(
        &mut self,
        state: &State<Lanes, N>,
        start: &Motion<Lanes, N>,
        h: Lanes,
        recovery: f64,
    ) -> Rodas<N> {
        let free = self.model.is_free();
        let coordinates = self.coordinates();
        let mut memory = core::mem::take(&mut self.rodas4);
        self.run.counts.factorisations += 1;
        let system = if free {
            if !self.factor_coupled(state, h.lane(0), recovery, &mut memory) {
                self.rodas4 = memory;
                return Rodas::failed(state);
            }
            System::Coupled(&memory)
        } else {
            System::Islands(self.factor_islands(state, h, recovery, &mut memory))
        };
        let mut stages = [Slope::zero(); STAGES];
        let mut sum = Slope::zero();
        for i in 0..STAGES {
            let mut right;
            if i == 0 {
                right = scaled(&start.slope, h, free);
            } else {
                sum = Slope::zero();
                let mut linear = Slope::zero();
                for j in 0..i {
                    sum.add(A[i - 1][j], &stages[j], free);
                    linear.add(C[i - 1][j], &stages[j], free);
                }
                let at = state.along(Lanes::splat(1.0), &sum, free);
                right = scaled(
                    &self
                        .rhs
                        .motion(&self.model, &mut self.run, &at, recovery)
                        .slope,
                    h,
                    free,
                );
                right.add(GAMMA, &linear, free);
            }
            stages[i] = match &system {
                System::Islands(islands) => {
                    islands.solve(&right, h * Lanes::splat(GAMMA), coordinates)
                }
                System::Coupled(memory) => {
                    memory.solve(right, h.lane(0) * GAMMA, coordinates, self.model.legs.len())
                }
            };
        }
        self.rodas4 = memory;
        // With feet on the ground the estimate for velocities converges more slowly than the
        // method, and would reduce the step size without need.
        let in_flight = self.run.mode.contacts.iter().next().is_none();
        let last = &stages[STAGES - 1];
        sum.add(1.0, last, free);
        Rodas {
            end: normalised(&state.along(Lanes::splat(1.0), &sum, free), free),
            dissipated: sum.dissipated,
            actuator: sum.actuator,
            error: self.error_of(last, in_flight),
        }
    }

    /// Returns the number of coordinates of a leg: its links, and its pulley where there are
    /// drives.
    fn coordinates(&self) -> usize {
        N + usize::from(self.model.drives.is_some())
    }

    /// Factors the systems of the legs on a fixed trunk.
    fn factor_islands(
        &mut self,
        state: &State<Lanes, N>,
        h: Lanes,
        recovery: f64,
        memory: &mut Memory<N>,
    ) -> Islands {
        let (zero, one) = (Lanes::zero(), Lanes::splat(1.0));
        let step = h * Lanes::splat(GAMMA);
        let coordinates = self.coordinates();
        let legs = self.model.side_by_side.as_dual();
        let mut matrix = [[zero; ROWS]; ROWS];
        let mut stiffness = [[zero; ROWS]; ROWS];
        let mut powers = [[[zero; 2]; ROWS]; 2];
        for k in 0..coordinates {
            let [by_x, by_v] = directions::<N>(k)
                .map(|to| self.column(&legs, state, to, one, recovery, &mut memory.workspace));
            stiffness[k] = velocities(&by_x);
            let damping = velocities(&by_v);
            for i in 0..coordinates {
                matrix[i][k] = -(step * (damping[i] + step * stiffness[k][i]));
            }
            matrix[k][k] += one;
            powers[0][k] = [by_x.dissipated, by_x.actuator];
            powers[1][k] = [by_v.dissipated, by_v.actuator];
        }
        Islands {
            factors: LaneFactors::new(matrix, coordinates),
            stiffness,
            powers,
        }
    }

    /// Factors the system of trunk and legs; returns false if it is singular.
    fn factor_coupled(
        &mut self,
        state: &State<Lanes, N>,
        h: f64,
        recovery: f64,
        memory: &mut Memory<N>,
    ) -> bool {
        let step = h * GAMMA;
        let legs = self.model.side_by_side.as_dual();
        let (coordinates, count) = (self.coordinates(), self.model.legs.len());
        let one = Lanes::splat(1.0);
        memory.columns.clear();
        for number in 0..TRUNK {
            let direction = trunk_direction(number);
            // Without contacts the dynamics are invariant under translation.
            let invariant =
                matches!(direction, Direction::Position(_)) && self.run.mode.contacts.is_empty();
            let column = if invariant {
                Slope::zero()
            } else {
                self.column(
                    &legs,
                    state,
                    direction,
                    one,
                    recovery,
                    &mut memory.workspace,
                )
            };
            memory.columns.push(column);
        }
        for which in 0..2 {
            for leg in 0..count {
                let seed = Lanes::zero().with_lane(leg, 1.0);
                for k in 0..coordinates {
                    let to = directions::<N>(k)[which];
                    let mut column =
                        self.column(&legs, state, to, seed, recovery, &mut memory.workspace);
                    if which == 1 {
                        let by_x = memory.columns[TRUNK + leg * coordinates + k];
                        column.add(step, &by_x, true);
                    }
                    memory.columns.push(column);
                }
            }
        }
        let rows = TRUNK + count * coordinates;
        let matrix = memory.factors.matrix(rows);
        let stride = matrix.len() / rows;
        for row in 0..rows {
            for column in 0..rows {
                // The columns of the legs' velocities follow those of their positions.
                let from = if column < TRUNK {
                    column
                } else {
                    column + count * coordinates
                };
                let entry = -step * number(&memory.columns[from], row, coordinates);
                matrix[row * stride + column] = entry + if row == column { 1.0 } else { 0.0 };
            }
        }
        memory.factors.factor().is_ok()
    }
}

impl<const N: usize> Rodas<N> {
    /// Returns a failed step.
    fn failed(state: &State<Lanes, N>) -> Self {
        Self {
            end: *state,
            dissipated: Lanes::zero(),
            actuator: Lanes::zero(),
            error: Lanes::splat(f64::INFINITY),
        }
    }
}

impl Islands {
    /// Solves (I − hγJ) U = R in every lane; `step` is hγ.
    fn solve<const N: usize>(
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
        let mut powers = [right.dissipated, right.actuator];
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
        [solution.dissipated, solution.actuator] = powers;
        solution
    }
}

impl<const N: usize> Memory<N> {
    /// Solves (I − hγJ) U = R for the whole robot; `step` is hγ.
    fn solve(
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
        for (row, &u) in numbers.iter().enumerate().take(TRUNK + size) {
            let from = if row < TRUNK { row } else { row + size };
            let column = &self.columns[from];
            solution.dissipated += Lanes::splat(step * u) * column.dissipated;
            solution.actuator += Lanes::splat(step * u) * column.actuator;
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
fn directions<const N: usize>(k: usize) -> [Direction; 2] {
    if k < N {
        [Direction::Angle(k), Direction::Rate(k)]
    } else {
        [Direction::Pulley, Direction::PulleyRate]
    }
}

fn trunk_direction(number: usize) -> Direction {
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
fn number<const N: usize>(slope: &Slope<Lanes, N>, row: usize, coordinates: usize) -> f64 {
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

/// Returns the slopes of angles and pulley angle.
fn positions<const N: usize>(slope: &Slope<Lanes, N>) -> Column {
    let mut column = [slope.pulley; ROWS];
    column[..N].copy_from_slice(&slope.angles);
    column
}

/// Returns the slopes of rates and pulley rate.
fn velocities<const N: usize>(slope: &Slope<Lanes, N>) -> Column {
    let mut column = [slope.pulley_rate; ROWS];
    column[..N].copy_from_slice(&slope.rates);
    column
}

/// Returns hγ times a slope.
fn scaled<const N: usize>(slope: &Slope<Lanes, N>, h: Lanes, free: bool) -> Slope<Lanes, N> {
    let h = h * Lanes::splat(GAMMA);
    let mut change = Slope::zero();
    if free {
        change.add(h.lane(0), slope, true);
        return change;
    }
    change.angles = slope.angles.map(|x| h * x);
    change.rates = slope.rates.map(|x| h * x);
    change.pulley = h * slope.pulley;
    change.pulley_rate = h * slope.pulley_rate;
    change.dissipated = h * slope.dissipated;
    change.actuator = h * slope.actuator;
    change
}

#[cfg(test)]
mod tests;

//! Stiff mode of a leg with a motor: rotors of hip and pulley against the dampers of the cable, of
//! the stops and of the joints.
//!
//! With the velocities v of first link, pulley and foot, the masses M that bear them, and damping D
//! and stiffness K of the leg, the mode (u, λ) is the fastest of (λ² M + λ D + K) u = 0. The vector
//! r of the state has u in the positions and λu in the velocities, ℓ has −Ku/λ and Mu, over
//! ℓ·r = λ uᵀMu − uᵀKu/λ. The trunk is at rest in it: it is heavy.
//!
//! Of Oncilla in a trot λ is −2000 to −28 000 1/s while the cable is taut, in swing more than in
//! stance and most where it pulls the pantograph against its stop; that of the fastest leg is
//! beyond −17 000 1/s half of the time. Without these modes no motion is faster than 4300 1/s, and
//! half of the time than 2200 1/s: there is one stiff mode of each leg, and no second.

use twinrig_compliant::lanes::{Lanes, Task};
use twinrig_compliant::{Joints, Mode, Tangent, Turns};

use super::model::Legs;
use super::state::{Slope, State};

/// Least share of the discriminant in that of a mode without stiffness: below it, of an
/// oscillation, the stiffness is left to the explicit method.
const OVERDAMPED: f64 = 0.04;

/// Rate in place of that of a leg without damping \[1/s\].
const SLOWEST: f64 = -1e-3;

/// Mode of each leg.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StiffMode<L, const A: usize = 0, const B: usize = 0> {
    /// λ \[1/s\].
    rate: L,
    /// r and ℓ: angles of links and pulley, rates of hip and pulley, velocity of the foot.
    vector: [[L; 4]; 2],
    covector: [[L; 4]; 2],
    /// Loads on hip and pulley, and tension of the cable, for a unit of r.
    pub(crate) loads: [L; 2],
    pub(crate) tension: L,
    /// Power of the drives and dissipated power: coefficients of x and x².
    pub(crate) driven: [L; 2],
    pub(crate) lost: [L; 2],
}

impl<L: Lanes, const A: usize, const B: usize> Mode for StiffMode<L, A, B> {
    type State = State<L, A, B>;
    type Slope = Slope<L, A, B>;
    type Lanes = L;

    #[inline(always)]
    fn rate(&self) -> L {
        self.rate
    }

    #[inline(always)]
    fn part(&self, slope: &Slope<L, A, B>) -> L {
        let rates = &slope.state;
        let ([first, second, third], [ahead, up]) = (rates.angles, rates.foot);
        let [angles, velocities] = self.covector;
        dot(angles, [first, second, third, rates.pulley])
            + dot(velocities, [rates.hip_rate, rates.pulley_rate, ahead, up])
    }

    #[inline(always)]
    fn added(&self, state: &State<L, A, B>, amount: L) -> State<L, A, B> {
        let ([first, second, third, pulley], [hip_rate, pulley_rate, ahead, up]) =
            (self.vector[0], self.vector[1]);
        let [a, b, c] = state.angles;
        State {
            angles: [a + first * amount, b + second * amount, c + third * amount],
            hip_rate: state.hip_rate + hip_rate * amount,
            pulley: state.pulley + pulley * amount,
            pulley_rate: state.pulley_rate + pulley_rate * amount,
            foot: [state.foot[0] + ahead * amount, state.foot[1] + up * amount],
            ..*state
        }
    }
}

/// Computation of the mode in a state with this slope.
pub(crate) struct Find<'a, L, const A: usize, const B: usize> {
    pub(crate) legs: &'a Legs<L, A>,
    pub(crate) state: &'a State<L, A, B>,
    pub(crate) slope: &'a Slope<L, A, B>,
    /// Inertias and damping of the motors of hip and pulley.
    pub(crate) inertias: [f64; 2],
    pub(crate) damping: [L; 2],
}

impl<L: Lanes, const A: usize, const B: usize> Task for Find<'_, L, A, B> {
    type Output = StiffMode<L, A, B>;

    #[inline(always)]
    fn run(self) -> StiffMode<L, A, B> {
        let Self {
            legs, state, slope, ..
        } = self;
        let turns = Turns::new(&state.angles);
        let (angles, rates) = (&state.angles, &slope.state.angles);
        let joints = Joints {
            angles,
            rates,
            pulley: state.pulley,
            pulley_rate: state.pulley_rate,
        };
        let tangent = Tangent::new(&legs.pantographs, &turns, &joints);
        let zero = state.hip_rate.zero();
        let [hip, pulley] = self.inertias;
        let leg = Linear {
            tangent,
            links: Links::new(legs, &turns),
            motors: self.damping,
            masses: [zero.like(hip), zero.like(pulley), legs.mass, legs.mass],
            per_mass: [
                zero.like(1.0 / hip),
                zero.like(1.0 / pulley),
                legs.per_mass,
                legs.per_mass,
            ],
        };
        // The response to a unit rate of the hip, and a round of the power method.
        let (force, ..) = leg.damped([zero.like(1.0), zero, zero, zero]);
        let u = leg.response(force);
        let force = leg.resisted(u, leg.damped(u).0);
        let (stiff, ..) = leg.held(u);
        let (_, per_rate) = fast_root(dot(u, force), dot(u, stiff));
        let u = leg.response(sum(force, scaled(stiff, per_rate)));
        let (resisting, torques, damper) = leg.damped(u);
        let (stiff, held, spring) = leg.held(u);
        let stiffness = dot(u, stiff);
        let (rate, per_rate) = fast_root(dot(u, leg.resisted(u, resisting)), stiffness);
        let norm = (rate - stiffness * per_rate).min(zero.like(SLOWEST));
        let per_norm = norm.reciprocal();
        let velocities = scaled(u, rate);
        let loads = [
            resisting[0] * rate + stiff[0],
            resisting[1] * rate + stiff[1],
        ];
        let [hip_rate, pulley_rate, ..] = velocities;
        let [first, second, third] = *rates;
        let turning = [first, second, third, state.pulley_rate];
        StiffMode {
            rate,
            vector: [leg.links.rates(u), velocities],
            covector: [
                scaled(held, -(per_rate * per_norm)),
                scaled(times(leg.masses, u), per_norm),
            ],
            loads,
            tension: damper * rate + spring,
            driven: [
                loads[0] * state.hip_rate
                    + slope.flows.hip * hip_rate
                    + loads[1] * state.pulley_rate
                    + slope.flows.knee * pulley_rate,
                loads[0] * hip_rate + loads[1] * pulley_rate,
            ],
            lost: [
                dot(torques, turning) * rate * 2.0,
                dot(u, resisting) * rate * rate,
            ],
        }
    }
}

/// Linear motion of legs about a state.
struct Linear<L> {
    tangent: Tangent<L>,
    links: Links<L>,
    /// Damping of the motors.
    motors: [L; 2],
    masses: [L; 4],
    per_mass: [L; 4],
}

impl<L: Lanes> Linear<L> {
    /// Returns the forces of dampers inside the leg against velocities, the torques, and the
    /// tension.
    #[inline(always)]
    fn damped(&self, u: [L; 4]) -> ([L; 4], [L; 4], L) {
        let (torques, tension) = self.tangent.damped(self.links.rates(u));
        (self.links.forces(torques), torques, tension)
    }

    /// Returns the forces of springs against displacements, the torques, and the tension.
    #[inline(always)]
    fn held(&self, u: [L; 4]) -> ([L; 4], [L; 4], L) {
        let (torques, tension) = self.tangent.held(self.links.rates(u));
        (self.links.forces(torques), torques, tension)
    }

    /// Adds the damping of the motors to forces against velocities.
    #[inline(always)]
    fn resisted(&self, u: [L; 4], forces: [L; 4]) -> [L; 4] {
        let [hip, pulley, ahead, up] = forces;
        let [at_hip, at_pulley] = self.motors;
        [hip + at_hip * u[0], pulley + at_pulley * u[1], ahead, up]
    }

    /// Returns the direction of the accelerations under forces, with uᵀMu = 1.
    #[inline(always)]
    fn response(&self, forces: [L; 4]) -> [L; 4] {
        let u = times(forces, self.per_mass);
        let square = dot(u, times(u, self.masses));
        scaled(u, square.max(square.like(1e-200)).sqrt().reciprocal())
    }
}

/// Rates of second and third link for those of the first link and the velocity of the foot.
struct Links<L> {
    second: [L; 3],
    third: [L; 3],
}

impl<L: Lanes> Links<L> {
    #[inline(always)]
    fn new<const A: usize>(legs: &Legs<L, A>, turns: &Turns<L, 3>) -> Self {
        let ([s1, s2, s3], [c1, c2, c3]) = (turns.sines, turns.cosines);
        let per_sine = turns.sine_of_ankle().reciprocal();
        let (second, third) = (per_sine * legs.per_links[0], per_sine * legs.per_links[1]);
        let l1 = legs.pantographs.links[0];
        let (ahead, up) = (l1 * c1, l1 * s1);
        Self {
            second: [(up * c3 - ahead * s3) * second, s3 * second, -(c3 * second)],
            third: [(ahead * s2 - up * c2) * third, -(s2 * third), c2 * third],
        }
    }

    /// Returns the rates of three links and the pulley.
    #[inline(always)]
    fn rates(&self, [hip, pulley, ahead, up]: [L; 4]) -> [L; 4] {
        let ([a, b, c], [d, e, f]) = (self.second, self.third);
        let second = a * hip + b * ahead + c * up;
        [hip, second, d * hip + e * ahead + f * up, pulley]
    }

    /// Returns the forces on hip, pulley and foot that do the work of these torques.
    #[inline(always)]
    fn forces(&self, [first, second, third, pulley]: [L; 4]) -> [L; 4] {
        let ([a, b, c], [d, e, f]) = (self.second, self.third);
        [
            first + a * second + d * third,
            pulley,
            b * second + e * third,
            c * second + f * third,
        ]
    }
}

/// Returns the faster root λ of λ² + d λ + k, and its reciprocal; −d and zero where the motion
/// oscillates.
#[inline(always)]
fn fast_root<L: Lanes>(damping: L, stiffness: L) -> (L, L) {
    let (zero, square) = (damping.zero(), damping * damping);
    let discriminant = square - stiffness * 4.0;
    let real = discriminant.gt(square * OVERDAMPED);
    let root = (damping + discriminant.max(zero).sqrt()) * -0.5;
    let rate = root.or(real, -damping);
    let per_rate = rate.min(zero.like(SLOWEST)).reciprocal();
    (rate, per_rate.or(real, zero))
}

#[inline(always)]
fn scaled<L: Lanes>(a: [L; 4], by: L) -> [L; 4] {
    [a[0] * by, a[1] * by, a[2] * by, a[3] * by]
}

#[inline(always)]
fn dot<L: Lanes>(a: [L; 4], b: [L; 4]) -> L {
    a[0] * b[0] + a[1] * b[1] + (a[2] * b[2] + a[3] * b[3])
}

#[inline(always)]
fn times<L: Lanes>(a: [L; 4], b: [L; 4]) -> [L; 4] {
    [a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]]
}

#[inline(always)]
fn sum<L: Lanes>(a: [L; 4], b: [L; 4]) -> [L; 4] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]]
}

#[cfg(test)]
mod tests;

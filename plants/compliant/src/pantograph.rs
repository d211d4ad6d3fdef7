//! Pantographs of four legs: constants, lengths, and the forces of springs, stops, cable and joint
//! friction.
//!
//! Stops hold in the angles of the joints ([`crate::stop`]): at the straight and at the folded leg,
//! and where rod and third link are in one line, lengths have no derivative, and a stop in them
//! would let the leg through.

mod tangent;

pub use tangent::Tangent;

use twinrig_robot::leg::Pantograph;
use twinrig_robot::{Compliance, Leg};

use crate::element::Element;
use crate::events::{INSIDE, if_compressed, weight};
use crate::lanes::{LANES, Lanes, Quad, Simd};
use crate::stop::{DeadCentre, Ends, KneeRange};

/// Constants of one leg of `N` links: three segments, and the foot as the fourth where it is a
/// segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PantographConstants<const N: usize> {
    /// Lengths from joint to joint \[m\].
    pub links: [f64; N],
    /// Viscous friction of the joint above each link \[N·m·s/rad\].
    pub friction: [f64; N],
    /// Offset of the pantograph \[m\].
    pub l_delta: f64,
    /// Stiffness \[N/m\] and unloaded length \[m\] of the diagonal spring.
    pub diagonal: [f64; 2],
    /// The same of the parallel spring.
    pub parallel: [f64; 2],
    /// Stiffness \[N·m/rad\] and unloaded angle \[rad\] of the toe.
    pub toe: [f64; 2],
    /// Minimum and maximum of the diagonal \[m\].
    pub diagonal_range: [f64; 2],
    /// Maximum of the parallel rod \[m\].
    pub parallel_max: f64,
    /// Taut length of the cable with the pulley at zero \[m\].
    pub cable_max: f64,
    /// Radius of the pulley \[m\].
    pub pulley_radius: f64,
}

impl PantographConstants<3> {
    /// Returns the constants of a leg with a point foot.
    pub fn new(leg: &Leg, pantograph: &Pantograph) -> Self {
        let joints = leg.joint_friction;
        Self {
            links: [leg.l1, leg.l2, leg.l3 - leg.l_delta],
            friction: [joints.hip, joints.knee, joints.ankle],
            l_delta: leg.l_delta,
            diagonal: [
                leg.diagonal.stiffness,
                pantograph.diagonal_max() + leg.diagonal.preload,
            ],
            parallel: [leg.parallel.stiffness, leg.l2 - leg.parallel.preload],
            toe: [0.0; 2],
            diagonal_range: [leg.diagonal_min, pantograph.diagonal_max()],
            parallel_max: leg.l2 + leg.parallel_travel,
            cable_max: pantograph.cable_length(0.0),
            pulley_radius: leg.pulley_radius,
        }
    }
}

impl<const N: usize> PantographConstants<N> {
    /// Placeholder for an absent leg: without forces, and no divisor is zero.
    const ABSENT: Self = Self {
        links: [1.0; N],
        friction: [0.0; N],
        l_delta: 0.5,
        diagonal: [0.0, 1.0],
        parallel: [0.0, 1.0],
        toe: [0.0; 2],
        diagonal_range: [0.8, 1.2],
        parallel_max: 10.0,
        cable_max: 10.0,
        pulley_radius: 0.0,
    };

    /// Returns the range of the diagonal, and the sides that enclose the knee.
    fn range(&self) -> KneeRange {
        KneeRange {
            diagonal: self.diagonal_range,
            sides: [self.l_delta, self.links[1]],
        }
    }
}

/// Constants of four legs; `T` is [`Quad`] in memory, or lanes.
#[derive(Debug, Clone, Copy)]
pub struct Pantographs<T, const N: usize> {
    /// Lengths from joint to joint \[m\].
    pub links: [T; N],
    /// Radius of the pulley \[m\].
    pub pulley_radius: T,
    friction: [T; N],
    l_delta: T,
    sides: Sides<T>,
    diagonal: [T; 2],
    parallel: [T; 2],
    toe: [T; 2],
    ends: Ends<T>,
    /// lΔ/l₂.
    ratio: T,
    parallel_max: T,
    cable_max: T,
    /// Stops of the pantograph.
    pub stops: Element<T>,
    cable: Element<T>,
}

/// Lengths ℓ² = square + Σ 2 · product · cos(difference of angles).
#[derive(Debug, Clone, Copy)]
struct Sides<T> {
    /// Squares of diagonal, parallel rod and cable.
    squares: [T; 3],
    /// lΔ l₂, lΔ² and l₁ l₂.
    products: [T; 3],
}

impl<const N: usize> Pantographs<Quad, N> {
    /// Places up to four legs side by side.
    pub fn side_by_side(legs: &[PantographConstants<N>], compliances: &[Compliance]) -> Self {
        let legs: [PantographConstants<N>; LANES] = std::array::from_fn(|lane| {
            legs.get(lane)
                .copied()
                .unwrap_or(PantographConstants::ABSENT)
        });
        let quad = |of: &dyn Fn(&PantographConstants<N>) -> f64| Quad(legs.each_ref().map(of));
        let pair = |of: &dyn Fn(&PantographConstants<N>) -> [f64; 2]| {
            [quad(&|leg| of(leg)[0]), quad(&|leg| of(leg)[1])]
        };
        Self {
            links: std::array::from_fn(|j| quad(&|leg| leg.links[j])),
            friction: std::array::from_fn(|j| quad(&|leg| leg.friction[j])),
            l_delta: quad(&|leg| leg.l_delta),
            sides: Sides {
                squares: [
                    quad(&|leg| leg.l_delta * leg.l_delta + leg.links[1] * leg.links[1]),
                    quad(&|leg| 2.0 * leg.l_delta * leg.l_delta + leg.links[1] * leg.links[1]),
                    quad(&|leg| leg.links[0] * leg.links[0] + leg.links[1] * leg.links[1]),
                ],
                products: [
                    quad(&|leg| leg.l_delta * leg.links[1]),
                    quad(&|leg| leg.l_delta * leg.l_delta),
                    quad(&|leg| leg.links[0] * leg.links[1]),
                ],
            },
            diagonal: pair(&|leg| leg.diagonal),
            parallel: pair(&|leg| leg.parallel),
            toe: pair(&|leg| leg.toe),
            ends: Ends::side_by_side(&legs.each_ref().map(PantographConstants::range)),
            ratio: quad(&|leg| leg.l_delta / leg.links[1]),
            parallel_max: quad(&|leg| leg.parallel_max),
            cable_max: quad(&|leg| leg.cable_max),
            pulley_radius: quad(&|leg| leg.pulley_radius),
            stops: Element::side_by_side(compliances.iter().map(|c| c.stops)),
            cable: Element::side_by_side(compliances.iter().map(|c| c.cable)),
        }
    }

    /// Loads the constants into lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> Pantographs<S::Lanes, N> {
        Pantographs {
            links: simd.load_all(&self.links),
            friction: simd.load_all(&self.friction),
            l_delta: simd.load(self.l_delta),
            sides: Sides {
                squares: simd.load_all(&self.sides.squares),
                products: simd.load_all(&self.sides.products),
            },
            diagonal: simd.load_all(&self.diagonal),
            parallel: simd.load_all(&self.parallel),
            toe: simd.load_all(&self.toe),
            ends: self.ends.load(simd),
            ratio: simd.load(self.ratio),
            parallel_max: simd.load(self.parallel_max),
            cable_max: simd.load(self.cable_max),
            pulley_radius: simd.load(self.pulley_radius),
            stops: self.stops.load(simd),
            cable: self.cable.load(simd),
        }
    }
}

/// Angles and rates of links and pulleys.
#[derive(Debug, Clone, Copy)]
pub struct Joints<'a, L, const N: usize> {
    /// Absolute angles of the links \[rad\].
    pub angles: &'a [L; N],
    /// Their rates \[rad/s\].
    pub rates: &'a [L; N],
    /// Angle of the pulley \[rad\].
    pub pulley: L,
    /// Its rate \[rad/s\].
    pub pulley_rate: L,
}

/// Directions of the links.
#[derive(Debug, Clone, Copy)]
pub struct Turns<L, const N: usize> {
    /// Sines of the angles.
    pub sines: [L; N],
    /// Cosines of the angles.
    pub cosines: [L; N],
    /// Sines and cosines of θᵢ − θⱼ, for i < j.
    sine: [[L; N]; N],
    cosine: [[L; N]; N],
}

impl<L: Lanes, const N: usize> Turns<L, N> {
    /// Computes the directions of angles \[rad\].
    #[inline(always)]
    pub fn new(angles: &[L; N]) -> Self {
        let (s, c) = L::sin_cos(*angles);
        let (mut sine, mut cosine) = ([s; N], [c; N]);
        for i in 0..N {
            for j in i + 1..N {
                sine[i][j] = s[i] * c[j] - c[i] * s[j];
                cosine[i][j] = c[i] * c[j] + s[i] * s[j];
            }
        }
        Self {
            sines: s,
            cosines: c,
            sine,
            cosine,
        }
    }

    /// Returns sine and cosine of the angle θ₁ − θ₂ by which the knee is bent.
    #[inline(always)]
    fn knee(&self) -> [L; 2] {
        [self.sine[0][1], self.cosine[0][1]]
    }

    /// Returns sin(θ₃ − θ₂).
    #[inline(always)]
    pub fn sine_of_ankle(&self) -> L {
        -self.sine[1][2]
    }

    /// Returns cos(θ₃ − θ₂).
    #[inline(always)]
    pub fn cosine_of_ankle(&self) -> L {
        self.cosine[1][2]
    }

    /// Returns Hᵢⱼ = Aᵢⱼ cos(θᵢ − θⱼ) on and below the diagonal, and Aᵢⱼ sin(θᵢ − θⱼ) above it.
    #[inline(always)]
    pub fn inertia_and_swing(&self, inertias: &[[L; N]; N]) -> [[L; N]; N] {
        let mut entries = *inertias;
        for i in 0..N {
            for j in i + 1..N {
                entries[j][i] = inertias[i][j] * self.cosine[i][j];
                entries[i][j] = inertias[i][j] * self.sine[i][j];
            }
        }
        entries
    }

    /// Returns diagonal, parallel rod and cable.
    #[inline(always)]
    fn lengths(&self, legs: &Pantographs<L, N>, rates: &[L; N]) -> Lengths<L> {
        let (squares, [p, q, r]) = (&legs.sides.squares, legs.sides.products);
        let (c01, c02, c12) = (self.cosine[0][1], self.cosine[0][2], self.cosine[1][2]);
        let (s01, s02, s12) = (self.sine[0][1], self.sine[0][2], self.sine[1][2]);
        let bent = p * c01;
        let diagonal = (squares[0] + bent * 2.0).sqrt();
        let parallel = (squares[1] + (bent - q * c02 - p * c12) * 2.0).sqrt();
        let cable = (squares[2] + r * c01 * 2.0).sqrt();
        let (d, per) = (p * s01, parallel.reciprocal());
        let (first, last) = ((q * s02 - d) * per, (-(q * s02) - p * s12) * per);
        let gradient = [first, -(first + last), last];
        let along = [d / diagonal, r * s01 / cable];
        let turn = rates[1] - rates[0];
        Lengths {
            diagonal,
            parallel,
            cable,
            along,
            gradient,
            turn,
            rates: [
                gradient[0] * rates[0] + gradient[1] * rates[1] + gradient[2] * rates[2],
                along[1] * turn,
            ],
        }
    }

    /// Returns the distance of rod and third link from one line.
    #[inline(always)]
    fn off_centre(&self, legs: &Pantographs<L, N>) -> DeadCentre<L> {
        DeadCentre {
            arm: legs.l_delta,
            ratio: legs.ratio,
            sines: [-self.sine[0][2], -self.sine[1][2]],
            cosines: [self.cosine[0][2], self.cosine[1][2]],
        }
    }
}

/// Lengths inside a leg.
#[derive(Debug, Clone, Copy)]
struct Lengths<L> {
    diagonal: L,
    parallel: L,
    cable: L,
    /// Derivatives of diagonal and cable with respect to θ₂ − θ₁ \[m/rad\].
    along: [L; 2],
    /// Gradient of the parallel rod \[m/rad\].
    gradient: [L; 3],
    /// Rate of θ₂ − θ₁ \[rad/s\].
    turn: L,
    /// Rates of parallel rod and cable \[m/s\].
    rates: [L; 2],
}

/// Torques and forces inside the legs.
#[derive(Debug, Clone, Copy)]
pub struct Internal<L, const N: usize> {
    /// Torques of springs, stops, cable and joint friction on the links \[N·m\].
    pub torques: [L; N],
    /// Tension of the cable \[N\].
    pub tension: L,
    /// Power dissipated by joints, stops and cable \[W\].
    pub dissipated: L,
    /// Compressed elements ([`if_compressed`]).
    pub compressed: L,
}

impl<L: Lanes, const N: usize> Internal<L, N> {
    /// Computes the forces; without drives there is no cable.
    #[inline(always)]
    pub fn new(
        legs: &Pantographs<L, N>,
        turns: &Turns<L, N>,
        joints: &Joints<'_, L, N>,
        has_cable: bool,
    ) -> Self {
        let rates = joints.rates;
        let lengths = turns.lengths(legs, rates);
        let zero = lengths.diagonal.zero();
        let (upper, end) = legs.ends.nearer(turns.knee());
        let pressed = legs.stops.press(end.depth, end.slope * lengths.turn);
        let either = zero.like(weight(0)).or(upper, zero.like(weight(1)));
        let mut compressed = either.or(end.depth.gt(zero), zero);
        let depth = legs.l_delta * (joints.angles[0] - joints.angles[2]);
        let rate = legs.l_delta * (rates[0] - rates[2]);
        let closed = legs.stops.press(depth, rate);
        compressed += if_compressed(3, depth);
        let mut dissipated = pressed.dissipated + closed.dissipated;
        let along_diagonal = legs.diagonal[0] * (legs.diagonal[1] - lengths.diagonal);
        let mut along_parallel = legs.parallel[0] * (legs.parallel[1] - lengths.parallel);
        // Rare: only where it is pressed.
        let depth = lengths.parallel - legs.parallel_max;
        if depth.any(depth.gt(zero)) {
            let open = legs.stops.press(depth, lengths.rates[0]);
            compressed += if_compressed(2, depth);
            along_parallel -= open.force;
            dissipated += open.dissipated;
        }
        let mut knee = along_diagonal * lengths.along[0] - pressed.force * end.slope;
        let mut tension = knee.zero();
        if has_cable {
            let wound = legs.pulley_radius * joints.pulley;
            let winding = legs.pulley_radius * joints.pulley_rate;
            let depth = lengths.cable - legs.cable_max + wound;
            let press = legs.cable.press(depth, lengths.rates[1] + winding);
            compressed += if_compressed(5, depth);
            tension = press.force;
            dissipated += press.dissipated;
            knee -= tension * lengths.along[1];
        }
        let pushed = legs.l_delta * closed.force;
        let mut torques = *rates;
        torques[0] = along_parallel * lengths.gradient[0] - knee - pushed;
        torques[1] = along_parallel * lengths.gradient[1] + knee;
        torques[2] = along_parallel * lengths.gradient[2] + pushed;
        let centre = turns.off_centre(legs);
        // Rare, too.
        if centre.is_reached() {
            let (depth, gradient) = centre.depth();
            let rate = gradient[0] * rates[0] + gradient[1] * rates[1] + gradient[2] * rates[2];
            let kept = legs.stops.press(depth, rate);
            compressed += if_compressed(4, depth);
            dissipated += kept.dissipated;
            for i in 0..3 {
                torques[i] -= kept.force * gradient[i];
            }
        }
        if N > 3 {
            let bent = joints.angles[N - 1] - joints.angles[2] - legs.toe[1];
            let torque = legs.toe[0] * bent;
            torques[N - 1] = -torque;
            torques[2] += torque;
        }
        let mut before = rates[0].zero();
        for i in 0..N {
            let turn = rates[i] - before;
            let torque = legs.friction[i] * turn;
            torques[i] -= torque;
            if i > 0 {
                torques[i - 1] += torque;
            }
            dissipated += torque * turn;
            before = rates[i];
        }
        Self {
            torques,
            tension,
            dissipated,
            compressed,
        }
    }
}

/// Lengths, and motion of the elements inside a leg, for their energy and their events.
#[derive(Debug, Clone, Copy)]
pub struct Depths<L> {
    /// Length of the diagonal \[m\].
    pub diagonal: L,
    /// Length of the parallel rod \[m\].
    pub parallel: L,
    /// Depths of the elements, in the order of [`INSIDE_NAMES`](crate::events::INSIDE_NAMES)
    /// \[m\].
    pub depths: [L; INSIDE],
    /// Their rates \[m/s\].
    pub rates: [L; INSIDE],
}

impl<L: Lanes> Depths<L> {
    /// Computes the lengths.
    #[inline(always)]
    pub fn new<const N: usize>(
        legs: &Pantographs<L, N>,
        turns: &Turns<L, N>,
        joints: &Joints<'_, L, N>,
    ) -> Self {
        let (angles, rates) = (joints.angles, joints.rates);
        let lengths = turns.lengths(legs, rates);
        let [extended, bottomed] = legs.ends.both(turns.knee());
        let (centre, slopes) = turns.off_centre(legs).depth();
        Self {
            diagonal: lengths.diagonal,
            parallel: lengths.parallel,
            depths: [
                extended.depth,
                bottomed.depth,
                lengths.parallel - legs.parallel_max,
                legs.l_delta * (angles[0] - angles[2]),
                centre,
                lengths.cable - legs.cable_max + legs.pulley_radius * joints.pulley,
            ],
            rates: [
                extended.slope * lengths.turn,
                bottomed.slope * lengths.turn,
                lengths.rates[0],
                legs.l_delta * (rates[0] - rates[2]),
                slopes[0] * rates[0] + slopes[1] * rates[1] + slopes[2] * rates[2],
                lengths.rates[1] + legs.pulley_radius * joints.pulley_rate,
            ],
        }
    }
}

impl<L: Lanes, const N: usize> Pantographs<L, N> {
    /// Returns the energy of springs, stops and cable \[J\].
    #[inline(always)]
    pub fn energy(&self, turns: &Turns<L, N>, joints: &Joints<'_, L, N>, has_cable: bool) -> L {
        let depths = Depths::new(self, turns, joints);
        let mut energy =
            spring(self.diagonal, depths.diagonal) + spring(self.parallel, depths.parallel);
        let [extended, bottomed, open, closed, centre, cable] = depths.depths;
        for depth in [extended, bottomed, open, closed, centre] {
            energy += self.stops.energy(depth);
        }
        if has_cable {
            energy += self.cable.energy(cable);
        }
        if N > 3 {
            energy += spring(self.toe, joints.angles[N - 1] - joints.angles[2]);
        }
        energy
    }
}

/// Returns the energy of a spring of a stiffness and an unloaded length.
#[inline(always)]
fn spring<L: Lanes>([stiffness, rest]: [L; 2], length: L) -> L {
    stiffness * ((length - rest) * (length - rest)) * 0.5
}

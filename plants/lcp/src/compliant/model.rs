//! Constants of the compliant model, of four legs side by side.

use twinrig_compliant::lanes::{LANES, Lanes, Quad, Simd};
use twinrig_compliant::{Element, ServoLaw, Sole};
use twinrig_legged::{Base, DriveModels};
use twinrig_robot::Compliance;

use crate::constants::Constants;
use crate::model::Model;

/// Constants of the legs; `T` is [`Quad`] in memory, or lanes. Symbols as in
/// [`Constants`](crate::constants::Constants).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Legs<T, const N: usize> {
    /// Hip in the trunk frame \[m\].
    pub(crate) hip: [T; 3],
    pub(crate) links: [T; N],
    /// M, and M times the hip.
    pub(crate) mass: T,
    pub(crate) mass_hip: [T; 3],
    /// bⱼ, and bⱼ times the hip.
    pub(crate) moments: [T; N],
    pub(crate) moments_hip: [[T; 3]; N],
    /// Aᵢⱼ.
    pub(crate) inertias: [[T; N]; N],
    pub(crate) friction: [T; N],
    pub(crate) l_delta: T,
    /// Squares and products of the sides of diagonal, parallel rod and cable.
    pub(crate) sides: Sides<T>,
    /// Stiffness and unloaded length of the springs.
    pub(crate) diagonal: [T; 2],
    pub(crate) parallel: [T; 2],
    pub(crate) toe: [T; 2],
    /// Middle and half of the range of the diagonal, maximum of the parallel rod and of the cable.
    pub(crate) diagonal_middle: T,
    pub(crate) diagonal_half: T,
    pub(crate) parallel_max: T,
    pub(crate) cable_max: T,
    pub(crate) pulley_radius: T,
    pub(crate) stops: Element<T>,
    pub(crate) cable: Element<T>,
    pub(crate) sole: Sole<T>,
}

/// Lengths ℓ² = square + Σ 2 · product · cos(difference of angles).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sides<T> {
    /// Squares of diagonal, parallel rod and cable.
    pub(crate) squares: [T; 3],
    /// lΔ l₂, lΔ² and l₁ l₂.
    pub(crate) products: [T; 3],
}

/// Constants of the compliant model.
#[derive(Debug, Clone)]
pub(crate) struct CompliantModel<const N: usize> {
    pub(crate) rigid: Model<N>,
    pub(crate) base: Base,
    /// Mass of trunk and legs, and of the trunk alone \[kg\], principal moments of the trunk alone \[kg·m²\].
    pub(crate) mass: f64,
    pub(crate) trunk_mass: f64,
    pub(crate) inertia: [f64; 3],
    pub(crate) legs: Legs<Quad, N>,
    pub(crate) drives: DriveLaws,
    /// Weights of the error: radius of an angle \[m\], length per energy \[m/J\].
    pub(crate) radius: f64,
    pub(crate) per_weight: f64,
}

/// Laws of the drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum DriveLaws {
    None,
    Servos {
        hip: ServoLaw,
        knee: ServoLaw,
    },
    /// Inertias of hip and pulley \[kg·m²\].
    Motors([f64; 2]),
}

impl<const N: usize> CompliantModel<N> {
    /// Adds the compliances of the legs to the rigid model.
    pub(crate) fn new(model: Model<N>, compliances: &[Compliance]) -> Self {
        let friction = model.ground.as_ref().map_or(0.0, |ground| ground.friction);
        let constants: Vec<_> = model.legs.iter().map(|leg| leg.constants).collect();
        Self {
            base: model.base,
            mass: model.trunk.mass,
            trunk_mass: model.trunk.mass - constants.iter().map(|leg| leg.mass).sum::<f64>(),
            inertia: model.trunk.inertia,
            legs: Legs::side_by_side(&constants, compliances, friction),
            drives: match &model.drives {
                None => DriveLaws::None,
                Some(DriveModels::Servos(servos)) => DriveLaws::Servos {
                    hip: ServoLaw::from(&servos.hip),
                    knee: ServoLaw::from(&servos.knee),
                },
                Some(drives @ DriveModels::Motors(_)) => DriveLaws::Motors(drives.inertias()),
            },
            radius: 0.5 * model.reach,
            per_weight: model.reach / model.energy_scale,
            rigid: model,
        }
    }

    /// Returns the inertias of the drives of hip and pulley \[kg·m²\].
    pub(crate) fn drive_inertias(&self) -> [f64; 2] {
        match &self.drives {
            DriveLaws::None => [0.0; 2],
            DriveLaws::Servos { hip, knee } => [hip.inertia(), knee.inertia()],
            DriveLaws::Motors(inertias) => *inertias,
        }
    }
}

impl<const N: usize> Legs<Quad, N> {
    fn side_by_side(legs: &[Constants<f64, N>], compliances: &[Compliance], friction: f64) -> Self {
        let absent = Constants::absent();
        let legs: [Constants<f64, N>; LANES] =
            std::array::from_fn(|lane| legs.get(lane).copied().unwrap_or(absent));
        let quad = |of: &dyn Fn(&Constants<f64, N>) -> f64| Quad(legs.each_ref().map(of));
        let many = |of: &dyn Fn(&Constants<f64, N>, usize) -> f64| {
            std::array::from_fn(|j| quad(&|leg| of(leg, j)))
        };
        let deflections: Vec<f64> = compliances.iter().map(|c| c.slip_deflection).collect();
        Self {
            hip: std::array::from_fn(|i| quad(&|leg| leg.hip[i])),
            links: many(&|leg, j| leg.links[j]),
            mass: quad(&|leg| leg.mass),
            mass_hip: std::array::from_fn(|i| quad(&|leg| leg.mass * leg.hip[i])),
            moments: many(&|leg, j| leg.moments[j]),
            moments_hip: std::array::from_fn(|j| {
                std::array::from_fn(|i| quad(&|leg| leg.moments[j] * leg.hip[i]))
            }),
            inertias: std::array::from_fn(|i| many(&|leg, j| leg.inertias[i][j])),
            friction: many(&|leg, j| leg.friction[j]),
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
            diagonal: std::array::from_fn(|i| quad(&|leg| leg.diagonal[i])),
            parallel: std::array::from_fn(|i| quad(&|leg| leg.parallel[i])),
            toe: std::array::from_fn(|i| quad(&|leg| leg.toe[i])),
            diagonal_middle: quad(&|leg| 0.5 * (leg.diagonal_max + leg.diagonal_min)),
            diagonal_half: quad(&|leg| 0.5 * (leg.diagonal_max - leg.diagonal_min)),
            parallel_max: quad(&|leg| leg.parallel_max),
            cable_max: quad(&|leg| leg.cable_max),
            pulley_radius: quad(&|leg| leg.pulley_radius),
            stops: Element::side_by_side(compliances.iter().map(|c| c.stops)),
            cable: Element::side_by_side(compliances.iter().map(|c| c.cable)),
            sole: Sole::new(
                Element::side_by_side(compliances.iter().map(|c| c.sole)),
                friction,
                &deflections,
            ),
        }
    }

    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> Legs<S::Lanes, N> {
        let load = |quad: Quad| simd.load(quad);
        let mut moments_hip = [simd.load_all(&self.moments_hip[0]); N];
        let mut inertias = [simd.load_all(&self.inertias[0]); N];
        for j in 1..N {
            moments_hip[j] = simd.load_all(&self.moments_hip[j]);
            inertias[j] = simd.load_all(&self.inertias[j]);
        }
        Legs {
            hip: simd.load_all(&self.hip),
            links: simd.load_all(&self.links),
            mass: load(self.mass),
            mass_hip: simd.load_all(&self.mass_hip),
            moments: simd.load_all(&self.moments),
            moments_hip,
            inertias,
            friction: simd.load_all(&self.friction),
            l_delta: load(self.l_delta),
            sides: Sides {
                squares: simd.load_all(&self.sides.squares),
                products: simd.load_all(&self.sides.products),
            },
            diagonal: simd.load_all(&self.diagonal),
            parallel: simd.load_all(&self.parallel),
            toe: simd.load_all(&self.toe),
            diagonal_middle: load(self.diagonal_middle),
            diagonal_half: load(self.diagonal_half),
            parallel_max: load(self.parallel_max),
            cable_max: load(self.cable_max),
            pulley_radius: load(self.pulley_radius),
            stops: self.stops.load(simd),
            cable: self.cable.load(simd),
            sole: self.sole.load(simd),
        }
    }
}

/// Set-points of the drives: values at the begin of a step, and their rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Commands<T> {
    /// Absolute angle of the hip \[rad\], or stall torque \[N·m\], and rate.
    pub(crate) hip: [T; 2],
    /// Angle of the pulley \[rad\], or stall torque \[N·m\], and rate.
    pub(crate) knee: [T; 2],
    /// Damping of hip and pulley motors \[N·m·s/rad\].
    pub(crate) damping: [T; 2],
}

impl Commands<Quad> {
    pub(crate) fn zero() -> Self {
        let zero = [Quad::splat(0.0); 2];
        Self {
            hip: zero,
            knee: zero,
            damping: zero,
        }
    }

    /// Returns whether the commands begin where others end, up to rounding errors of a ramp.
    pub(crate) fn continues(&self, end: &Self) -> bool {
        const ROUND_OFF: f64 = 1e-13;
        let starts = |commands: &Self| {
            let [hip, knee, [at_hip, at_knee]] = [commands.hip, commands.knee, commands.damping];
            [hip[0], knee[0], at_hip, at_knee]
        };
        let pairs = starts(self).into_iter().zip(starts(end));
        let mut pairs = pairs.flat_map(|(a, b)| a.0.into_iter().zip(b.0));
        pairs.all(|(a, b)| (a - b).abs() <= ROUND_OFF)
    }

    /// Returns the set-points after some time, at rest.
    pub(crate) fn at_end(&self, seconds: f64) -> Self {
        let end = |[start, rate]: [Quad; 2]| {
            let value = std::array::from_fn(|i| start.0[i] + rate.0[i] * seconds);
            [Quad(value), Quad::splat(0.0)]
        };
        Self {
            hip: end(self.hip),
            knee: end(self.knee),
            damping: self.damping,
        }
    }

    #[inline(always)]
    pub(crate) fn load<S: Simd>(&self, simd: S) -> Commands<S::Lanes> {
        Commands {
            hip: simd.load_all(&self.hip),
            knee: simd.load_all(&self.knee),
            damping: simd.load_all(&self.damping),
        }
    }
}

impl<L: Lanes> Commands<L> {
    /// Returns the set-points of hip and knee at a time.
    #[inline(always)]
    pub(crate) fn at(&self, time: f64) -> [L; 2] {
        [
            self.hip[0] + self.hip[1] * time,
            self.knee[0] + self.knee[1] * time,
        ]
    }
}

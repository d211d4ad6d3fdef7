//! Constants of the equations of a leg, from the robot file.

use twinrig_robot::leg::Pantograph;
use twinrig_robot::{Leg, LegMount};

use crate::model::real::Lanes;

/// Legs computed side by side in SIMD lanes.
pub(crate) const LANES: usize = 4;

/// Indices of the legs.
pub(crate) const ALL: [usize; LANES] = [0, 1, 2, 3];

/// Constants of a leg with `N` links: three segments, and the foot as the fourth where there is a
/// toe joint.
///
/// Every mass is at r = hip + Σⱼ cⱼ e(θⱼ), with e the direction of link j and cⱼ constant.
/// Therefore the sums over the masses are constants: M = Σm, bⱼ = Σ m cⱼ and Aᵢⱼ = Σ m cᵢcⱼ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Constants<R, const N: usize> {
    /// Position of the hip in the trunk frame, relative to the trunk's centre of mass \[m\].
    pub(crate) hip: [R; 3],
    /// Lengths from joint to joint \[m\].
    pub(crate) links: [R; N],
    /// M \[kg\].
    pub(crate) mass: R,
    /// bⱼ \[kg·m\].
    pub(crate) moments: [R; N],
    /// Aᵢⱼ, symmetric \[kg·m²\].
    pub(crate) inertias: [[R; N]; N],
    /// Viscous friction of the joint above each link \[N·m·s/rad\].
    pub(crate) friction: [R; N],
    /// Offset of the pantograph \[m\].
    pub(crate) l_delta: R,
    /// Stiffness \[N/m\] and unloaded length \[m\] of the diagonal and the parallel spring.
    pub(crate) diagonal: [R; 2],
    pub(crate) parallel: [R; 2],
    /// Stiffness \[N·m/rad\] and unloaded angle \[rad\] of the toe.
    pub(crate) toe: [R; 2],
    /// Limits of the stops: maximum and minimum diagonal, maximum parallel rod \[m\].
    pub(crate) diagonal_max: R,
    pub(crate) diagonal_min: R,
    pub(crate) parallel_max: R,
    /// Taut length of the cable with the pulley at zero, and radius of the pulley \[m\].
    pub(crate) cable_max: R,
    pub(crate) pulley_radius: R,
}

/// Point masses of a leg: mass \[kg\] and coefficient cⱼ for each link \[m\].
struct Masses<const N: usize>(Vec<(f64, [f64; N])>);

impl<const N: usize> Masses<N> {
    /// Adds a thin uniform rod along link `link`, between the distances `from` and `to` from the
    /// joint at `before`, as three points by Simpson's rule, which is exact for moments up to the
    /// second.
    fn rod(&mut self, mass: f64, before: [f64; N], link: usize, from: f64, to: f64) {
        for (share, distance) in [(1.0, from), (4.0, 0.5 * (from + to)), (1.0, to)] {
            let mut at = before;
            at[link] += distance;
            self.0.push((mass * share / 6.0, at));
        }
    }
}

impl<const N: usize> Constants<f64, N> {
    /// Computes the constants of a mounted leg.
    pub(crate) fn new(mount: &LegMount, pantograph: &Pantograph) -> Self {
        let leg = &mount.leg;
        let masses = masses::<N>(leg);
        let mut links = [0.0; N];
        links[..3].copy_from_slice(&[leg.l1, leg.l2, leg.l3 - leg.l_delta]);
        let mut friction = [0.0; N];
        let joints = leg.joint_friction;
        friction[..3].copy_from_slice(&[joints.hip, joints.knee, joints.ankle]);
        let mut toe = [0.0; 2];
        if let (true, Some(segment)) = (N > 3, leg.toe) {
            links[N - 1] = segment.length;
            friction[N - 1] = joints.toe;
            toe = [segment.stiffness, segment.rest];
        }
        let (mut mass, mut moments, mut inertias) = (0.0, [0.0; N], [[0.0; N]; N]);
        for (m, at) in &masses.0 {
            mass += m;
            for i in 0..N {
                moments[i] += m * at[i];
                for j in 0..N {
                    inertias[i][j] += m * at[i] * at[j];
                }
            }
        }
        Self {
            hip: mount.hip,
            links,
            mass,
            moments,
            inertias,
            friction,
            l_delta: leg.l_delta,
            diagonal: [
                leg.diagonal.stiffness,
                pantograph.diagonal_max() + leg.diagonal.preload,
            ],
            parallel: [leg.parallel.stiffness, leg.l2 - leg.parallel.preload],
            toe,
            diagonal_max: pantograph.diagonal_max(),
            diagonal_min: leg.diagonal_min,
            parallel_max: leg.l2 + leg.parallel_travel,
            cable_max: pantograph.cable_length(0.0),
            pulley_radius: leg.pulley_radius,
        }
    }

    /// Returns the minimum ratio of a pivot of the inertia matrix to its diagonal element, with all
    /// links in line, where the matrix is nearest to singular.
    pub(crate) fn regularity(&self) -> f64 {
        let mut a = self.inertias;
        let mut least = f64::INFINITY;
        for k in 0..N {
            let diagonal = self.inertias[k][k];
            least = least.min(a[k][k] / diagonal);
            for i in k + 1..N {
                let factor = a[i][k] / a[k][k];
                for j in k..N {
                    a[i][j] -= factor * a[k][j];
                }
            }
        }
        if least.is_nan() { 0.0 } else { least }
    }
}

/// Returns the mass distribution of a leg.
fn masses<const N: usize>(leg: &Leg) -> Masses<N> {
    let mut masses = Masses(Vec::new());
    let mut joint = [0.0; N];
    masses.rod(leg.mass.l1, joint, 0, 0.0, leg.l1);
    joint[0] = leg.l1;
    masses.rod(leg.mass.l2, joint, 1, 0.0, leg.l2);
    joint[1] = leg.l2;
    // The third segment extends upwards to the end of the parallel rod.
    masses.rod(leg.mass.l3, joint, 2, -leg.l_delta, leg.l3 - leg.l_delta);
    joint[2] = leg.l3 - leg.l_delta;
    match leg.toe {
        Some(toe) if N > 3 => masses.rod(leg.mass.foot, joint, N - 1, 0.0, toe.length),
        _ => masses.0.push((leg.mass.foot, joint)),
    }
    masses
}

impl<const N: usize> Constants<f64, N> {
    /// Placeholder for an absent leg: its contributions are below round-off (16 digits), and no
    /// divisor is zero.
    pub(crate) fn absent() -> Self {
        const NEGLIGIBLE: f64 = 1e-30;
        let diagonal = |i, j| if i == j { NEGLIGIBLE } else { 0.0 };
        Self {
            hip: [0.0; 3],
            links: [1.0; N],
            mass: 0.0,
            moments: [0.0; N],
            inertias: std::array::from_fn(|i| std::array::from_fn(|j| diagonal(i, j))),
            friction: [0.0; N],
            l_delta: 0.5,
            diagonal: [0.0, 1.0],
            parallel: [0.0, 1.0],
            toe: [0.0; 2],
            diagonal_max: 10.0,
            diagonal_min: 0.0,
            parallel_max: 10.0,
            cable_max: 10.0,
            pulley_radius: 0.0,
        }
    }
}

impl<const N: usize> Constants<Lanes, N> {
    /// Packs up to four legs into SIMD lanes.
    pub(crate) fn side_by_side(legs: &[Constants<f64, N>]) -> Self {
        let absent = Constants::absent();
        let gather = |of: &dyn Fn(&Constants<f64, N>) -> f64| {
            Lanes::new(std::array::from_fn::<_, LANES, _>(|lane| {
                of(legs.get(lane).unwrap_or(&absent))
            }))
        };
        Self {
            hip: std::array::from_fn(|i| gather(&|leg| leg.hip[i])),
            links: std::array::from_fn(|i| gather(&|leg| leg.links[i])),
            mass: gather(&|leg| leg.mass),
            moments: std::array::from_fn(|i| gather(&|leg| leg.moments[i])),
            inertias: std::array::from_fn(|i| {
                std::array::from_fn(|j| gather(&|leg| leg.inertias[i][j]))
            }),
            friction: std::array::from_fn(|i| gather(&|leg| leg.friction[i])),
            l_delta: gather(&|leg| leg.l_delta),
            diagonal: std::array::from_fn(|i| gather(&|leg| leg.diagonal[i])),
            parallel: std::array::from_fn(|i| gather(&|leg| leg.parallel[i])),
            toe: std::array::from_fn(|i| gather(&|leg| leg.toe[i])),
            diagonal_max: gather(&|leg| leg.diagonal_max),
            diagonal_min: gather(&|leg| leg.diagonal_min),
            parallel_max: gather(&|leg| leg.parallel_max),
            cable_max: gather(&|leg| leg.cable_max),
            pulley_radius: gather(&|leg| leg.pulley_radius),
        }
    }
}

//! One leg in one state: inertia, lengths, and torques of springs, friction and velocities.

use crate::model::constants::Constants;
use crate::model::real::Real;

/// Length between two points of the leg, with its first derivatives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Length<R> {
    /// \[m\]
    pub(crate) value: R,
    /// Gradient with respect to the angles of the three segments \[m/rad\]; the components add up
    /// to zero, as a rotation of the whole leg changes no length.
    pub(crate) gradient: [R; 3],
    /// \[m/s\]
    pub(crate) rate: R,
    /// Second time derivative at constant rates of all angles \[m/s²\].
    pub(crate) curvature: R,
}

/// A leg in one state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Chain<R, const N: usize> {
    pub(crate) rates: [R; N],
    pub(crate) sines: [R; N],
    pub(crate) cosines: [R; N],
    /// Hᵢⱼ = Aᵢⱼ cos(θᵢ − θⱼ).
    pub(crate) inertia: [[R; N]; N],
    /// Aᵢⱼ sin(θᵢ − θⱼ), antisymmetric.
    pub(crate) swing: [[R; N]; N],
    pub(crate) diagonal: Length<R>,
    pub(crate) parallel: Length<R>,
    /// Distance from hip to ankle.
    pub(crate) cable: Length<R>,
    /// Torques of the springs, without gravity, and of joint friction \[N·m\].
    pub(crate) springs: [R; N],
    pub(crate) friction: [R; N],
}

impl<R: Real, const N: usize> Chain<R, N> {
    /// Zero-initialised storage.
    #[inline(always)]
    pub(crate) fn blank() -> Self {
        let zero = R::zero();
        let length = Length {
            value: zero,
            gradient: [zero; 3],
            rate: zero,
            curvature: zero,
        };
        Self {
            rates: [zero; N],
            sines: [zero; N],
            cosines: [zero; N],
            inertia: [[zero; N]; N],
            swing: [[zero; N]; N],
            diagonal: length,
            parallel: length,
            cable: length,
            springs: [zero; N],
            friction: [zero; N],
        }
    }

    /// Computes the leg at these absolute angles and rates of its links.
    #[inline(always)]
    pub(crate) fn new(leg: &Constants<R, N>, angles: &[R; N], rates: &[R; N]) -> Self {
        let (mut sines, mut cosines) = ([R::zero(); N], [R::zero(); N]);
        for i in 0..N {
            (sines[i], cosines[i]) = angles[i].sin_cos();
        }
        let (mut inertia, mut swing) = (leg.inertias, [[R::zero(); N]; N]);
        let (mut sine, mut cosine) = ([[R::zero(); N]; N], [[R::zero(); N]; N]);
        for i in 0..N {
            for j in i + 1..N {
                sine[i][j] = sines[i] * cosines[j] - cosines[i] * sines[j];
                cosine[i][j] = cosines[i] * cosines[j] + sines[i] * sines[j];
                inertia[i][j] = leg.inertias[i][j] * cosine[i][j];
                inertia[j][i] = inertia[i][j];
                swing[i][j] = leg.inertias[i][j] * sine[i][j];
                swing[j][i] = -swing[i][j];
            }
        }
        let [l1, l2] = [leg.links[0], leg.links[1]];
        let segments = SegmentAngles {
            sine: [sine[0][1], sine[0][2], sine[1][2]],
            cosine: [cosine[0][1], cosine[0][2], cosine[1][2]],
            rate: [
                rates[0] - rates[1],
                rates[0] - rates[2],
                rates[1] - rates[2],
            ],
        };
        let ld = leg.l_delta;
        let zero = R::zero();
        let diagonal = segments.side(ld * ld + l2 * l2, ld * l2);
        let parallel = segments.length(
            R::splat(2.0) * ld * ld + l2 * l2,
            [ld * l2, -(ld * ld), -(ld * l2)],
        );
        let cable = segments.side(l1 * l1 + l2 * l2, l1 * l2);
        let pull = |length: &Length<R>, spring: [R; 2]| spring[0] * (spring[1] - length.value);
        let (push_d, push_p) = (pull(&diagonal, leg.diagonal), pull(&parallel, leg.parallel));
        let (mut springs, friction) = ([zero; N], friction_torques(leg, rates));
        for i in 0..3 {
            springs[i] = push_d * diagonal.gradient[i] + push_p * parallel.gradient[i];
        }
        if N > 3 {
            let torque = leg.toe[0] * (angles[N - 1] - angles[2] - leg.toe[1]);
            springs[N - 1] -= torque;
            springs[2] += torque;
        }
        Self {
            rates: *rates,
            sines,
            cosines,
            inertia,
            swing,
            diagonal,
            parallel,
            cable,
            springs,
            friction,
        }
    }

    /// Returns the torques on the links in a field that gives every mass the acceleration (x, z)
    /// \[m/s²\], including centrifugal terms: the right-hand side of H θ̈ = τ.
    #[inline(always)]
    pub(crate) fn torques(&self, leg: &Constants<R, N>, field: [R; 2]) -> [R; N] {
        let mut torques = [R::zero(); N];
        for j in 0..N {
            let mut torque = self.springs[j]
                + self.friction[j]
                + leg.moments[j] * (self.cosines[j] * field[0] + self.sines[j] * field[1]);
            for i in 0..N {
                if i != j {
                    torque += self.swing[i][j] * (self.rates[i] * self.rates[i]);
                }
            }
            torques[j] = torque;
        }
        torques
    }

    /// Returns the energy of the springs \[J\].
    pub(crate) fn spring_energy(&self, leg: &Constants<R, N>, angles: &[R; N]) -> R {
        let half = R::splat(0.5);
        let of = |stretch: R, stiffness: R| half * stiffness * stretch * stretch;
        let mut energy = of(self.diagonal.value - leg.diagonal[1], leg.diagonal[0])
            + of(self.parallel.value - leg.parallel[1], leg.parallel[0]);
        if N > 3 {
            energy += of(angles[N - 1] - angles[2] - leg.toe[1], leg.toe[0]);
        }
        energy
    }

    /// Returns the power dissipated by joint friction \[W\].
    #[inline(always)]
    pub(crate) fn friction_power(&self) -> R {
        let mut power = R::zero();
        for i in 0..N {
            power -= self.friction[i] * self.rates[i];
        }
        power
    }

    /// Returns the kinetic energy of the leg relative to the trunk \[J\].
    pub(crate) fn kinetic_energy(&self) -> R {
        let mut twice = R::zero();
        for i in 0..N {
            for j in 0..N {
                twice += self.inertia[i][j] * self.rates[i] * self.rates[j];
            }
        }
        R::splat(0.5) * twice
    }
}

/// Returns the torques of joint friction at these rates of the links.
#[inline(always)]
pub(crate) fn friction_torques<R: Real, const N: usize>(
    leg: &Constants<R, N>,
    rates: &[R; N],
) -> [R; N] {
    let mut torques = [R::zero(); N];
    torques[0] = -(leg.friction[0] * rates[0]);
    for i in 1..N {
        let torque = leg.friction[i] * (rates[i] - rates[i - 1]);
        torques[i] -= torque;
        torques[i - 1] += torque;
    }
    torques
}

/// Differences of the angles of the three segments: (1, 2), (1, 3), (2, 3).
struct SegmentAngles<R> {
    sine: [R; 3],
    cosine: [R; 3],
    rate: [R; 3],
}

impl<R: Real> SegmentAngles<R> {
    /// Returns the side of a triangle, which depends on the first difference only: ℓ² = square + 2
    /// · product · cos(angle).
    #[inline(always)]
    fn side(&self, square: R, product: R) -> Length<R> {
        let value = (square + R::splat(2.0) * product * self.cosine[0]).sqrt();
        let inverse = R::splat(1.0) / value;
        let slope = product * self.sine[0];
        let along = slope * inverse;
        let rate = -(slope * self.rate[0]) * inverse;
        let bend = product * self.cosine[0] * (self.rate[0] * self.rate[0]);
        Length {
            value,
            gradient: [-along, along, R::zero()],
            rate,
            curvature: -(bend + rate * rate) * inverse,
        }
    }

    /// Returns the length ℓ with ½ℓ² = ½ square + Σ product · cos(angle).
    #[inline(always)]
    fn length(&self, square: R, product: [R; 3]) -> Length<R> {
        let two = R::splat(2.0);
        let (mut squared, mut bend) = (square, R::zero());
        let mut slope = [R::zero(); 3];
        for k in 0..3 {
            squared += two * product[k] * self.cosine[k];
            slope[k] = product[k] * self.sine[k];
            bend += product[k] * self.cosine[k] * (self.rate[k] * self.rate[k]);
        }
        let value = squared.sqrt();
        let inverse = R::splat(1.0) / value;
        let gradient = [
            -(slope[0] + slope[1]) * inverse,
            (slope[0] - slope[2]) * inverse,
            (slope[1] + slope[2]) * inverse,
        ];
        let rate = -(slope[0] * self.rate[0] + slope[1] * self.rate[1] + slope[2] * self.rate[2])
            * inverse;
        Length {
            value,
            gradient,
            rate,
            curvature: -(bend + rate * rate) * inverse,
        }
    }
}

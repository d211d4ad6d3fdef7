//! Legs in one state: lengths, internal forces, and inertia.

use twinrig_compliant::lanes::Lanes;

use super::model::Legs;
use super::state::State;

/// Angles of the links, and what follows from them alone.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turns<L, const N: usize> {
    pub(crate) sines: [L; N],
    pub(crate) cosines: [L; N],
    /// Sines and cosines of θᵢ − θⱼ, for i < j.
    sine: [[L; N]; N],
    cosine: [[L; N]; N],
}

impl<L: Lanes, const N: usize> Turns<L, N> {
    #[inline(always)]
    pub(crate) fn new(angles: &[L; N]) -> Self {
        let (mut s, mut c) = (*angles, *angles);
        for i in 0..N {
            (s[i], c[i]) = angles[i].sin_cos();
        }
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

    /// Returns Hᵢⱼ = Aᵢⱼ cos(θᵢ − θⱼ) on and below the diagonal, and Aᵢⱼ sin(θᵢ − θⱼ) above it.
    #[inline(always)]
    pub(crate) fn inertia_and_swing(&self, legs: &Legs<L, N>) -> [[L; N]; N] {
        let mut entries = legs.inertias;
        for i in 0..N {
            for j in i + 1..N {
                entries[j][i] = legs.inertias[i][j] * self.cosine[i][j];
                entries[i][j] = legs.inertias[i][j] * self.sine[i][j];
            }
        }
        entries
    }

    /// Returns diagonal, parallel rod and cable.
    #[inline(always)]
    fn lengths(&self, legs: &Legs<L, N>, rates: &[L; N]) -> Lengths<L> {
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
            rates: [
                along[0] * turn,
                gradient[0] * rates[0] + gradient[1] * rates[1] + gradient[2] * rates[2],
                along[1] * turn,
            ],
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
    /// Rates of diagonal, parallel rod and cable \[m/s\].
    rates: [L; 3],
}

/// Torques and forces inside the legs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Internal<L, const N: usize> {
    /// Torques of springs, stops, cable and joint friction on the links \[N·m\].
    pub(crate) torques: [L; N],
    /// Tension of the cable \[N\].
    pub(crate) tension: L,
    /// Power dissipated by joints, stops and cable \[W\].
    pub(crate) dissipated: L,
}

impl<L: Lanes, const N: usize> Internal<L, N> {
    /// Computes the forces; without drives there is no cable.
    #[inline(always)]
    pub(crate) fn new<const P: usize>(
        legs: &Legs<L, N>,
        turns: &Turns<L, N>,
        state: &State<L, N, P>,
        has_cable: bool,
    ) -> Self {
        let rates = &state.rates;
        let lengths = turns.lengths(legs, rates);
        // The stops of the diagonal, extended and bottomed out, are mirror images.
        let offset = lengths.diagonal - legs.diagonal_middle;
        let upper = offset.gt(offset.zero());
        let ward = |x: L| x.or(upper, -x);
        let end = legs
            .stops
            .press(ward(offset) - legs.diagonal_half, ward(lengths.rates[0]));
        let open = legs
            .stops
            .press(lengths.parallel - legs.parallel_max, lengths.rates[1]);
        let closed = legs.stops.press(
            legs.l_delta * (state.angles[0] - state.angles[2]),
            legs.l_delta * (rates[0] - rates[2]),
        );
        let mut dissipated = end.dissipated + open.dissipated + closed.dissipated;
        let along_diagonal =
            legs.diagonal[0] * (legs.diagonal[1] - lengths.diagonal) - ward(end.force);
        let along_parallel = legs.parallel[0] * (legs.parallel[1] - lengths.parallel) - open.force;
        let mut knee = along_diagonal * lengths.along[0];
        let mut tension = knee.zero();
        if has_cable {
            let wound = legs.pulley_radius * state.pulley;
            let winding = legs.pulley_radius * state.pulley_rate;
            let press = legs.cable.press(
                lengths.cable - legs.cable_max + wound,
                lengths.rates[2] + winding,
            );
            tension = press.force;
            dissipated += press.dissipated;
            knee -= tension * lengths.along[1];
        }
        let pushed = legs.l_delta * closed.force;
        let mut torques = *rates;
        torques[0] = along_parallel * lengths.gradient[0] - knee - pushed;
        torques[1] = along_parallel * lengths.gradient[1] + knee;
        torques[2] = along_parallel * lengths.gradient[2] + pushed;
        if N > 3 {
            let bent = state.angles[N - 1] - state.angles[2] - legs.toe[1];
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
        }
    }
}

/// Lengths and depths of the elements inside a leg, for their energy and their events.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Depths<L> {
    /// Lengths of diagonal and parallel rod \[m\].
    pub(crate) diagonal: L,
    pub(crate) parallel: L,
    pub(crate) extended: L,
    pub(crate) bottomed: L,
    pub(crate) open: L,
    pub(crate) closed: L,
    pub(crate) cable: L,
}

impl<L: Lanes> Depths<L> {
    #[inline(always)]
    pub(crate) fn new<const N: usize, const P: usize>(
        legs: &Legs<L, N>,
        turns: &Turns<L, N>,
        state: &State<L, N, P>,
    ) -> Self {
        let lengths = turns.lengths(legs, &state.rates);
        let offset = lengths.diagonal - legs.diagonal_middle;
        Self {
            diagonal: lengths.diagonal,
            parallel: lengths.parallel,
            extended: offset - legs.diagonal_half,
            bottomed: -offset - legs.diagonal_half,
            open: lengths.parallel - legs.parallel_max,
            closed: legs.l_delta * (state.angles[0] - state.angles[2]),
            cable: lengths.cable - legs.cable_max + legs.pulley_radius * state.pulley,
        }
    }
}

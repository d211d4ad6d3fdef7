//! The Tegotae rule: a phase that the load of its leg holds back in stance.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Compensation of the fixed point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FixedPoint {
    /// The fixed point is at mid-stance, −π/2, for any load (eq. 3.10 of the thesis).
    #[default]
    Compensated,
    /// The fixed point is at −arccos(ω/(σF)), which is take-off for σF = ω (eq. 3.4).
    Plain,
}

impl FixedPoint {
    /// All rules.
    pub const ALL: [Self; 2] = [Self::Compensated, Self::Plain];

    /// Name in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Compensated => "compensated",
            Self::Plain => "plain",
        }
    }

    /// The term `x_c` \[rad\] of eq. 3.9, for the excitation ω and the feedback σF \[rad/s\].
    ///
    /// ```text
    /// x_c = arcsin(ω/(σF))      if |ω| < |σF|
    /// x_c = sgn(ω·σF)·π/2       otherwise, with sgn(0) = 0
    /// ```
    pub fn compensation(self, excitation: f64, feedback: f64) -> f64 {
        if self == Self::Plain || excitation == 0.0 || feedback == 0.0 {
            0.0
        } else if excitation.abs() < feedback.abs() {
            libm::asin(excitation / feedback)
        } else {
            FRAC_PI_2.copysign(excitation.signum() * feedback.signum())
        }
    }
}

/// Rate θ̇ \[rad/s\] of the phase θ \[rad\] (eq. 3.7):
///
/// ```text
/// θ̇ = ω − σF·cos(θ + x_c)
/// ```
#[cfg(test)]
pub(crate) fn rate(rule: FixedPoint, phase: f64, excitation: f64, feedback: f64) -> f64 {
    let shift = rule.compensation(excitation, feedback);
    excitation - feedback * libm::cos(phase + shift)
}

/// Phase θ in `[0, 2π)` after `seconds` under constant ω = `excitation` and σF = `feedback`
/// \[rad/s\].
///
/// The equation is Adler's in ψ = θ + `x_c`, and its flow is a Möbius transformation of the point
/// e^iψ of the unit circle. With λ = ½·√|(σF)² − ω²| it is
///
/// ```text
/// ψ(t) = ψ + 2·arg[C − S·σF/2·sin ψ + i·S/2·(ω − σF·cos ψ)]
/// C, S = 1, tanh(λt)/λ           if |σF| > |ω|
/// C, S = cos(λt), sin(λt)/λ      if |σF| < |ω|
/// ```
///
/// and with C = 1, S = t where λ vanishes. It is exact for any elapsed time, and has no branches at
/// the poles of tan(ψ/2). Whole turns are lost, which a phase does not need.
#[inline]
pub(crate) fn advance(
    rule: FixedPoint,
    phase: f64,
    excitation: f64,
    feedback: f64,
    seconds: f64,
) -> f64 {
    if feedback == 0.0 {
        return wrap(phase + excitation * seconds);
    }
    let shift = rule.compensation(excitation, feedback);
    let (sin, cos) = libm::sincos(phase + shift);
    let square = 0.25 * (feedback - excitation) * (feedback + excitation);
    let lambda = square.abs().sqrt();
    let turned = lambda * seconds;
    let (c, s) = if turned < 1e-9 {
        (1.0, seconds)
    } else if square > 0.0 {
        (1.0, libm::tanh(turned) / lambda)
    } else {
        let (sin, cos) = libm::sincos(turned);
        (cos, sin / lambda)
    };
    let ahead = 0.5 * s * (excitation - feedback * cos);
    let along = c - 0.5 * s * feedback * sin;
    wrap(phase + 2.0 * libm::atan2(ahead, along))
}

/// Wraps a phase \[rad\] into `[0, 2π)`.
pub(crate) fn wrap(phase: f64) -> f64 {
    // The common case first, with no rounding: at most one turn beyond.
    let near = if phase < 0.0 {
        phase + TAU
    } else if phase >= TAU {
        phase - TAU
    } else {
        phase
    };
    if (0.0..TAU).contains(&near) {
        return near;
    }
    let far = near.rem_euclid(TAU);
    // A tiny negative number rounds up to 2π.
    if far < TAU { far } else { 0.0 }
}

/// Output of a low-pass filter of first order with the time constant `time` \[s\], after an input
/// that is constant for `seconds` \[s\]; exact. Without a time constant it is the input.
pub fn low_pass(before: f64, input: f64, time: f64, seconds: f64) -> f64 {
    if time > 0.0 {
        before - (input - before) * libm::expm1(-seconds / time)
    } else {
        input
    }
}

/// Phase of mid-stance, −π/2, in `[0, 2π)`.
pub(crate) const MID_STANCE: f64 = 1.5 * PI;

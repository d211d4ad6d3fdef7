//! What the thesis found of the stability of its models, and why other figures come out here.

use serde::Serialize;

/// A figure of the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ThesisFigure {
    /// Its model and its method.
    pub model: &'static str,
    /// Where it stands.
    pub place: &'static str,
    /// The largest stable step at the stiffness of the robot \[s\].
    pub step_s: f64,
    /// The largest stable step at a quarter of it \[s\]; none if that is not told.
    pub quarter_s: Option<f64>,
    /// What it compares with here.
    pub like: Like,
    /// Why ours differs.
    pub why: &'static str,
}

/// Plants that a figure of the thesis compares with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Like {
    /// Those whose segments have mass, solved by this program's own means.
    Massive,
    /// Those that solve the model of another by other means: on the engines of others.
    Engines,
    /// Those whose segments have none.
    Massless,
}

/// The figures, in the order of the thesis.
pub const FIGURES: [ThesisFigure; 3] = [
    ThesisFigure {
        model: "full leg, generalised coordinates, explicit Euler",
        place: "2.5.2, figure 2.5b; 2.7.3",
        step_s: 15e-6,
        quarter_s: Some(166.1e-6),
        like: Like::Massive,
        why: "The model is not stiff at milliseconds. Explicit Euler is limited by 2ζ/ω, the damping of the fastest mode that swings \
              freely, and not by 1/ω: off its stops (passive-legs-free) that bound is one over the stiffness, a tenth at a tenth of \
              the joints' friction, and with the friction of the robot file, which is assumed, a millisecond; the thesis' 15 µs \
              want less damping and more stiffness. In passive-legs the legs rest on their stops after milliseconds, and what would \
              grow off them is held. That the thesis' limit grows elevenfold at a quarter of the stiffness, and not \
              fourfold, has its impact rule in it, which sets one joint's rate to zero and so makes energy at a stop, and meets \
              fewer stops where springs are soft: here that rule is far off at every step. With impulses on all joints, and a method \
              whose region of stability holds some of the imaginary axis, milliseconds are stable.",
    },
    ThesisFigure {
        model: "full leg, maximal coordinates, Webots",
        place: "2.5.2, figure 2.5a",
        step_s: 9e-3,
        quarter_s: Some(9e-3),
        like: Like::Engines,
        why: "The same at every stiffness, so not a limit of the springs. Engines of this kind soften joints and loops; where \
              they are stiffer than the springs it is they that cap the step, and where they are softer the error stays \
              however short the step. Whether that holds of the engines here is told below, \
              under \"Is it the springs?\".",
    },
    ThesisFigure {
        model: "leg without segment masses, table of forces",
        place: "2.7.3, figure 2.10",
        step_s: 1.69e-3,
        quarter_s: None,
        like: Like::Massless,
        why: "The thesis integrates forces from a bilinear table explicitly: neither conserves energy. Here a step is implicit \
              and its springs' work is exactly what their energy loses, so it is stable at any length at which it has a \
              solution; where it has none it halves itself, which the rows count as fallbacks. What limits its step is its \
              error.",
    },
];

//! Stability limits of the models in the thesis, and the reasons for the differences from this
//! program.

use serde::Serialize;

/// A result of the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ThesisFigure {
    /// Model and method.
    pub model: &'static str,
    /// Sections and figures of the thesis.
    pub place: &'static str,
    /// Largest stable step at the stiffness of the robot \[s\].
    pub step_s: f64,
    /// Largest stable step at a quarter of it, if the thesis gives one \[s\].
    pub quarter_s: Option<f64>,
    /// Plants of this program to compare with.
    pub like: ModelClass,
    /// Reason for the difference.
    pub why: &'static str,
}

/// Class of plants comparable with a result of the thesis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelClass {
    /// Plants with segment masses and solvers of this program.
    Massive,
    /// Plants that solve the model of another plant with a third-party engine.
    Engines,
    /// Plants without segment masses.
    Massless,
}

/// The results, in the order of the thesis.
pub const FIGURES: [ThesisFigure; 3] = [
    ThesisFigure {
        model: "full leg, generalised coordinates, explicit Euler",
        place: "2.5.2, figure 2.5b; 2.7.3",
        step_s: 15e-6,
        quarter_s: Some(166.1e-6),
        like: ModelClass::Massive,
        why: "The model is not stiff at milliseconds. Explicit Euler is limited by 2ζ/ω, the \
              damping of the fastest free mode, not by 1/ω: away from the stops \
              (passive-legs-free) that bound is inverse to the stiffness, a tenth at a tenth of \
              the joints' friction, and a millisecond with the friction of the robot file, which \
              is assumed; the 15 µs of the thesis require less damping and more stiffness. In \
              passive-legs the legs rest on their stops after milliseconds, which constrain the \
              unstable mode. That the limit of the thesis grows elevenfold at a quarter of the \
              stiffness, not fourfold, is due to its impact rule, which sets the rate of one \
              joint to zero and so creates energy at a stop, and which acts on fewer stops where \
              springs are soft: here that rule is far off at every step. With impulses on all \
              joints, and a method whose stability region contains part of the imaginary axis, \
              milliseconds are stable.",
    },
    ThesisFigure {
        model: "full leg, maximal coordinates, Webots",
        place: "2.5.2, figure 2.5a",
        step_s: 9e-3,
        quarter_s: Some(9e-3),
        like: ModelClass::Engines,
        why: "The limit is the same at every stiffness, so it is not due to the springs. Engines \
              of this kind soften joints and loops; where these are stiffer than the springs \
              they limit the step, and where they are softer the error remains however short the \
              step. Whether this applies to the engines here is shown in the section \
              \"Dependence on stiffness\".",
    },
    ThesisFigure {
        model: "leg without segment masses, table of forces",
        place: "2.7.3, figure 2.10",
        step_s: 1.69e-3,
        quarter_s: None,
        like: ModelClass::Massless,
        why: "The thesis integrates forces from a bilinear table explicitly: neither conserves \
              energy. So does explicit Euler here, whose limit is c/k, in proportion to the \
              joints' friction, which is assumed (away from the stops, passive-legs-free). Our \
              step is implicit and the work of the springs equals the decrease of \
              their energy, so it is stable at any length at which it has a solution; where it \
              has none the step is halved, which the rows count as fallbacks. The step is \
              limited by its error.",
    },
];

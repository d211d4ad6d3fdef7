//! Methods against each other: all solve one model, so they agree for as long as the motion is determined. A copy that starts
//! from a perturbed pose shows how long that is.

use twinrig::Registry;
use twinrig::kernel::SimDuration;

use crate::case::{Case, Method};
use crate::law::Finding;
use crate::run::{Run, Sample, run};

/// Perturbation of the copy \[rad\], and its distance from the original beyond which nothing is compared \[m\].
const PERTURBATION: f64 = 1e-9;
const DEPARTED: f64 = 1e-5;

/// Error that a step of rk4 and rodas4 may make \[m\].
const TOLERANCE: f64 = 1e-9;

/// The greatest distance of trunk and feet \[m\].
fn apart(one: &Sample, other: &Sample) -> f64 {
    let distance = |a: &[f64; 3], b: &[f64; 3]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        libm::sqrt(squares.sum::<f64>())
    };
    let feet = one.feet.iter().zip(&other.feet);
    let feet = feet.map(|(a, b)| distance(&a.position, &b.position));
    feet.fold(distance(&one.trunk, &other.trunk), f64::max)
}

/// How many samples of two runs are no more than so far apart.
fn together(one: &Run, other: &Run) -> usize {
    let pairs = one.samples.iter().zip(&other.samples);
    pairs.take_while(|(a, b)| apart(a, b) <= DEPARTED).count()
}

/// The run of a method, and its greatest distance from that of rk4.
#[derive(Clone, Debug)]
pub struct Comparison {
    pub run: Run,
    pub finding: Finding,
}

/// Compares rodas4 and moreau with rk4, all in steps of `step`.
///
/// # Errors
/// A case that cannot be run.
pub fn compare(
    registry: &Registry,
    case: &Case,
    step: SimDuration,
) -> Result<Vec<Comparison>, String> {
    let by = |method: Method| Case {
        step: Some(step),
        tolerance: Some(TOLERANCE),
        ..case.by(method)
    };
    let base = run(registry, &by(Method::Rk4))?;
    let copy = Case {
        perturbation: PERTURBATION,
        ..by(Method::Rk4)
    };
    let copy = run(registry, &copy)?;
    let compared = together(&base, &copy);
    let mut comparisons = Vec::new();
    for method in [Method::Rodas4, Method::Moreau] {
        let other = run(registry, &by(method))?;
        let mut worst = Finding {
            at_s: 0.0,
            measured: 0.0,
            bound: DEPARTED,
            about: format!("distance of {} from rk4 [m]", method.name()),
            fallbacks: 0,
        };
        let mut copied = 0.0_f64;
        let mut others = other.samples.iter();
        let samples = base.samples.iter().zip(&copy.samples);
        for (a, copy) in samples.take(compared) {
            // Each method is observed at its own period.
            let Some(b) = others.find(|b| b.time_s > a.time_s - 1e-9) else {
                break;
            };
            assert!(
                (b.time_s - a.time_s).abs() < 1e-9,
                "{} and {} s",
                a.time_s,
                b.time_s
            );
            copied = copied.max(apart(a, copy));
            let (distance, bound) = (apart(a, b), bound(method, step, copied));
            if distance - bound > worst.measured - worst.bound || distance.is_nan() {
                (worst.measured, worst.bound, worst.at_s) = (distance, bound, a.time_s);
                worst.fallbacks = a.fallbacks.max(b.fallbacks);
            }
        }
        comparisons.push(Comparison {
            run: other,
            finding: worst,
        });
    }
    Ok(comparisons)
}

/// Greatest distance \[m\], where the copy has come to the distance `copied`: for methods that locate events that at which
/// nothing is compared; for Moreau's rule, which has an impact anywhere in a step, of first order in the step, and amplified as
/// the perturbation of the copy has been.
fn bound(method: Method, step: SimDuration, copied: f64) -> f64 {
    /// Speed by which a step's length is an error \[m/s\], and a leg's length \[m\].
    const SPEED: f64 = 10.0;
    const LENGTH: f64 = 0.1;
    if method.locates_events() {
        DEPARTED
    } else {
        SPEED * step.as_secs_f64() * (copied / (PERTURBATION * LENGTH)).max(1.0)
    }
}

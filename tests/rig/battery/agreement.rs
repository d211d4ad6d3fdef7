//! Comparison of the integration methods: all solve the same model and therefore agree as long as
//! the motion is predictable. That interval is measured with a copy that starts from a perturbed
//! pose.

use twinrig::Registry;
use twinrig::kernel::SimDuration;

use crate::battery::case::{Case, Method};
use crate::battery::law::Finding;
use crate::battery::run::{Run, Sample, run};

/// Perturbation of the copy \[rad\], and the distance of copy and original that ends the comparison
/// \[m\].
const PERTURBATION: f64 = 1e-9;
const COMPARED_MAX: f64 = 1e-5;

/// Error tolerance per step of rk4 and rodas4 \[m\].
const TOLERANCE: f64 = 1e-9;

/// Maximum distance of trunk and feet between two samples \[m\].
fn max_distance(a: &Sample, b: &Sample) -> f64 {
    let distance = |a: &[f64; 3], b: &[f64; 3]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        libm::sqrt(squares.sum::<f64>())
    };
    let feet = a.feet.iter().zip(&b.feet);
    let feet = feet.map(|(a, b)| distance(&a.position, &b.position));
    feet.fold(distance(&a.trunk, &b.trunk), f64::max)
}

/// Number of initial samples of two runs within [`COMPARED_MAX`] of each other.
fn compared_samples(one: &Run, other: &Run) -> usize {
    let pairs = one.samples.iter().zip(&other.samples);
    pairs
        .take_while(|(a, b)| max_distance(a, b) <= COMPARED_MAX)
        .count()
}

/// Run of a method with its maximum distance from that of rk4.
#[derive(Clone, Debug)]
pub struct Comparison {
    pub run: Run,
    pub finding: Finding,
}

/// Compares rodas4 and moreau with rk4, all with the given step.
///
/// # Errors
/// The case cannot be run.
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
    let compared = compared_samples(&base, &copy);
    let mut comparisons = Vec::new();
    for method in [Method::Rodas4, Method::Moreau] {
        let other = run(registry, &by(method))?;
        let mut worst = Finding {
            at_s: 0.0,
            measured: 0.0,
            bound: COMPARED_MAX,
            about: format!("distance of {} from rk4 [m]", method.name()),
            fallbacks: 0,
        };
        let mut copied = 0.0_f64;
        let mut others = other.samples.iter();
        let samples = base.samples.iter().zip(&copy.samples);
        for (a, copy) in samples.take(compared) {
            // Each method has its own observation period.
            let Some(b) = others.find(|b| b.time_s > a.time_s - 1e-9) else {
                break;
            };
            assert!(
                (b.time_s - a.time_s).abs() < 1e-9,
                "{} and {} s",
                a.time_s,
                b.time_s
            );
            copied = copied.max(max_distance(a, copy));
            let (distance, bound) = (max_distance(a, b), bound(method, step, copied));
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

/// Maximum distance \[m\] from rk4 when the copy has reached the distance `copied`: for methods
/// with event location the distance that ends the comparison; for Moreau's rule, in which the time
/// of an impact is known to within a step, first order in the step, with the amplification of the
/// copy's perturbation.
fn bound(method: Method, step: SimDuration, copied: f64) -> f64 {
    /// Speed whose product with the step is the error \[m/s\], and length of a leg \[m\].
    const SPEED: f64 = 10.0;
    const LENGTH: f64 = 0.1;
    if method.locates_events() {
        COMPARED_MAX
    } else {
        SPEED * step.as_secs_f64() * (copied / (PERTURBATION * LENGTH)).max(1.0)
    }
}

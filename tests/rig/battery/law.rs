//! Laws without a reference solution. Each returns the sample of a run that violates it most.

use std::fmt;

use twinrig_robot::GRAVITY;

use crate::battery::case::{Base, Method};
use crate::battery::run::{Run, Sample};

/// A law of the battery.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Law {
    /// The plant does not end with an error.
    Refusal,
    /// Feet stay above the ground.
    Penetration,
    /// Friction dissipates energy and supplies none.
    Dissipation,
    /// Energy of a passive robot never exceeds its initial value.
    Energy,
    /// Momentum in flight changes by gravity only.
    Momentum,
    /// Ground forces are within the friction cone.
    Friction,
    /// Knees bend to their side.
    AssemblyMode,
    /// All methods of one model compute the same motion.
    Agreement,
    /// Impacts dissipate energy and supply none.
    Impact,
    /// Energy never exceeds an earlier value.
    Rise,
    /// Feet are at most 0.1 mm deep in the ground.
    Depth,
}

impl Law {
    pub const ALL: [Self; 11] = [
        Self::Refusal,
        Self::Penetration,
        Self::Dissipation,
        Self::Energy,
        Self::Momentum,
        Self::Friction,
        Self::AssemblyMode,
        Self::Agreement,
        Self::Impact,
        Self::Rise,
        Self::Depth,
    ];
    /// Laws of random drops, stands and walks.
    pub const GENERAL: [Self; 7] = [
        Self::Refusal,
        Self::Penetration,
        Self::Dissipation,
        Self::Energy,
        Self::Momentum,
        Self::Friction,
        Self::AssemblyMode,
    ];
    /// Laws of harsh drops.
    pub const HARSH: [Self; 4] = [Self::Refusal, Self::Impact, Self::Rise, Self::Depth];

    /// Evaluates the law and returns the sample nearest to a violation, or the worst violation;
    /// `None` if the law does not apply to the run.
    pub fn judge(self, run: &Run) -> Option<Finding> {
        let mut finding = match self {
            Self::Refusal => Some(open_failure(run)),
            Self::Penetration => penetration(run),
            Self::Dissipation => dissipation(run),
            Self::Energy => energy(run),
            Self::Momentum => momentum(run),
            Self::Friction => friction(run),
            Self::AssemblyMode => assembly_mode(run),
            Self::Impact => impact(run),
            Self::Rise => rise(run),
            Self::Depth => depth(run),
            // Compares two runs.
            Self::Agreement => None,
        }?;
        let mut earlier = run.samples.iter().rev();
        let last = earlier.find(|sample| sample.time_s <= finding.at_s)?;
        finding.fallbacks = last.fallbacks;
        Some(finding)
    }
}

/// Result of a law: distance to a violation, or its magnitude.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    pub at_s: f64,
    pub measured: f64,
    /// Limit above which the law is violated.
    pub bound: f64,
    pub about: String,
    /// Number of fallbacks to another method and of shortened steps so far.
    pub fallbacks: u64,
}

impl Finding {
    fn new(at_s: f64, measured: f64, bound: f64, about: impl Into<String>) -> Self {
        Self {
            at_s,
            measured,
            bound,
            about: about.into(),
            fallbacks: 0,
        }
    }

    /// Whether the law is violated; NaN is a violation.
    pub fn is_violation(&self) -> bool {
        self.measured.is_nan() || self.measured > self.bound
    }

    /// Returns the worse of two findings.
    fn worst(self, other: Option<Self>) -> Self {
        match other {
            Some(other) if other.excess() > self.excess() => other,
            _ => self,
        }
    }

    fn excess(&self) -> f64 {
        if self.measured.is_nan() {
            f64::INFINITY
        } else {
            self.measured - self.bound
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            at_s,
            measured,
            bound,
            about,
            fallbacks,
        } = self;
        write!(
            f,
            "{about}: {measured:.3e}, at most {bound:.3e}, at {at_s:.4} s after {fallbacks} fallbacks"
        )
    }
}

fn worst(findings: impl Iterator<Item = Finding>) -> Option<Finding> {
    findings.fold(None, |worst, finding| Some(finding.worst(worst)))
}

fn open_failure(run: &Run) -> Finding {
    let at_s = run.samples.last().map_or(0.0, |sample| sample.time_s);
    let why = run.refused.clone().unwrap_or_default();
    let refused = f64::from(u8::from(run.refused.is_some()));
    Finding::new(at_s, refused, 0.0, why)
}

/// Penetration depth \[m\]: about 0 with event location, otherwise of first order in the step.
/// After a fallback to Moreau's rule the bound of that rule applies.
fn penetration(run: &Run) -> Option<Finding> {
    if run.case.method.is_compliant() {
        return None;
    }
    let step_ms = 1e3 * run.case.step().as_secs_f64();
    worst(run.samples.iter().flat_map(|sample| {
        let located = run.case.method.locates_events() && sample.fallbacks == 0;
        let bound = if located { 1e-6 } else { 5e-4 * step_ms };
        let feet = sample.feet.iter().zip(&run.case.legs);
        feet.map(move |(foot, leg)| {
            let about = format!("depth of foot {leg} [m]");
            Finding::new(sample.time_s, -foot.clearance, bound, about)
        })
    }))
}

/// Energy returned by friction, relative to the maximum dissipated before \[J\]. Bristles of
/// compliant soles return at most the energy of their deflection under the greatest load.
fn dissipation(run: &Run) -> Option<Finding> {
    const ROUND_OFF: f64 = 1e-9;
    /// Error of the integration, relative to the energy exchanged.
    const SHARE: f64 = 1e-5;
    let is_compliant = run.case.method.is_compliant();
    let (mut dissipated_max, mut load_max) = (0.0_f64, 0.0_f64);
    worst(run.samples.iter().map(|sample| {
        let dissipated = sample.energy.dissipated;
        dissipated_max = dissipated_max.max(dissipated);
        let load: f64 = sample.feet.iter().map(|foot| foot.force[2].abs()).sum();
        load_max = load_max.max(load);
        let deflected = 0.5 * run.case.friction * load_max * run.slip_deflection;
        let bound = if is_compliant {
            ROUND_OFF + deflected + SHARE * sample.energy.exchanged
        } else {
            ROUND_OFF
        };
        Finding::new(
            sample.time_s,
            dissipated_max - dissipated,
            bound,
            "energy returned by friction [J]",
        )
    }))
}

/// Energy above its initial value, relative to the energy exchanged \[1\].
fn energy(run: &Run) -> Option<Finding> {
    /// Lower bound of the energy exchanged, below which it is round-off \[J\].
    const EXCHANGED_MIN: f64 = 1e-6;
    if !run.case.is_passive() {
        return None;
    }
    let share = if run.case.method.locates_events() {
        1e-5
    } else {
        1e-3
    };
    let start = run.samples.first()?.energy.stored();
    worst(run.samples.iter().map(|sample| {
        let exchanged = sample.energy.exchanged.max(EXCHANGED_MIN);
        let above = (sample.energy.stored() - start) / exchanged;
        let about = "energy above the start, relative to the energy exchanged";
        Finding::new(sample.time_s, above, share, about)
    }))
}

/// Sine of the angle by which a knee is bent to the other side \[1\].
fn assembly_mode(run: &Run) -> Option<Finding> {
    worst(run.samples.iter().flat_map(|sample| {
        let legs = sample.angles.iter().zip(&run.case.legs);
        legs.map(move |([first, second, _], leg)| {
            let about = format!("sine of the knee of {leg}, bent the other way");
            Finding::new(sample.time_s, libm::sin(second - first), 0.0, about)
        })
    }))
}

/// Lower bound of the energy exchanged, below which a share of it is round-off \[J\].
const EXCHANGED_MIN: f64 = 1e-3;

/// Share of the energy exchanged that is round-off \[1\].
const ROUND_OFF_SHARE: f64 = 1e-9;

fn exchanged(sample: &Sample) -> f64 {
    sample.energy.exchanged.max(EXCHANGED_MIN)
}

/// Energy given by impacts between two samples, relative to the energy exchanged \[1\].
fn impact(run: &Run) -> Option<Finding> {
    let about = "energy given by impacts, relative to the energy exchanged";
    worst(run.samples.windows(2).filter_map(|pair| {
        let [before, after] = pair else { return None };
        let share = (before.energy.impact - after.energy.impact) / exchanged(after);
        Some(Finding::new(after.time_s, share, ROUND_OFF_SHARE, about))
    }))
}

/// Energy above an earlier value, without the work of drives, relative to the energy exchanged
/// \[1\]: at most twice the error of the balance, whose sign may change.
fn rise(run: &Run) -> Option<Finding> {
    let errors = run
        .samples
        .iter()
        .map(|sample| sample.energy.residual.abs() / exchanged(sample));
    let bound = ROUND_OFF_SHARE + 2.0 * errors.fold(0.0, f64::max);
    let mut least = f64::INFINITY;
    worst(run.samples.iter().map(|sample| {
        let energy = sample.energy.stored() - sample.energy.actuator;
        least = least.min(energy);
        let about = "rise of the energy, relative to the energy exchanged";
        Finding::new(
            sample.time_s,
            (energy - least) / exchanged(sample),
            bound,
            about,
        )
    }))
}

/// Depth of the feet \[m\].
fn depth(run: &Run) -> Option<Finding> {
    if run.case.method.is_compliant() {
        return None;
    }
    worst(run.samples.iter().flat_map(|sample| {
        let deepest = sample.feet.iter().map(|foot| -foot.clearance);
        deepest.map(|depth| Finding::new(sample.time_s, depth, 1e-4, "depth of a foot [m]"))
    }))
}

/// Change of momentum in flight not explained by gravity, relative to the momenta of the bodies
/// \[1\].
fn momentum(run: &Run) -> Option<Finding> {
    let conserves = run.case.method.locates_events() || run.case.method == Method::Compliant;
    if !conserves || run.case.base == Base::Fixed {
        return None;
    }
    let mut flight: Option<&Sample> = None;
    let mut findings = Vec::new();
    for pair in run.samples.windows(2) {
        let [before, after] = pair else { continue };
        if after.fallbacks > 0 && !run.case.method.is_compliant() {
            // Moreau's rule does not conserve angular momentum.
            break;
        }
        let airborne = after.feet.iter().all(|foot| foot.force == [0.0; 3]);
        if !airborne {
            flight = None;
            continue;
        }
        let take_off = *flight.get_or_insert(before);
        findings.extend(change_of_momentum(run, take_off, after));
    }
    worst(findings.into_iter())
}

/// Change of momentum by the errors of substeps at the default tolerance of compliant plants \[1\].
const SHARE_COMPLIANT: f64 = 1e-4;

fn change_of_momentum(run: &Run, take_off: &Sample, now: &Sample) -> Option<Finding> {
    let (from, to) = (take_off.momentum?, now.momentum?);
    let fall = run.mass * GRAVITY * (now.time_s - take_off.time_s);
    let mut linear = to.linear - from.linear;
    linear.z += fall;
    let mut angular = to.angular - from.angular;
    if run.case.base == Base::Planar {
        // Constraint forces of the planar base are unknown.
        linear.y = 0.0;
        (angular.x, angular.z) = (0.0, 0.0);
    }
    let scales = [
        from.linear_scale.max(to.linear_scale).max(fall),
        from.angular_scale.max(to.angular_scale),
    ];
    // Lower bound of the scales: a share of the robot's mass times √(g l), with the leg length l. A
    // thousandth for round-off; with compliant constraints the whole, since the tolerance does not
    // depend on the momentum.
    let (share, least) = match run.case.method {
        Method::Compliant => (SHARE_COMPLIANT, 1.0),
        _ => (1e-6, 1e-3),
    };
    let least = least * run.mass * libm::sqrt(GRAVITY * run.length);
    let shares = [
        linear.norm() / scales[0].max(least),
        angular.norm() / scales[1].max(least * run.length),
    ];
    let names = ["linear", "angular"].map(|which| format!("change of {which} momentum in flight"));
    let findings = shares.into_iter().zip(names);
    worst(findings.map(|(change, name)| Finding::new(now.time_s, change, share, name)))
}

/// Tangential force beyond the friction limit, relative to that limit \[1\]; only on level ground,
/// where the mean of forces in the cone is in the cone.
fn friction(run: &Run) -> Option<Finding> {
    const SHARE: f64 = 1e-6;
    /// Force below which values are round-off \[N\].
    const FLOOR: f64 = 1e-9;
    if run.case.heights.is_some() {
        return None;
    }
    worst(run.samples.iter().flat_map(|sample| {
        let feet = sample.feet.iter().zip(&run.case.legs);
        feet.map(move |(foot, leg)| {
            let [x, y, z] = foot.force;
            let limit = run.case.friction * z;
            let excess = (libm::hypot(x, y) - limit - FLOOR).max(-z - FLOOR);
            let share = excess / limit.abs().max(FLOOR);
            let about = format!("force of foot {leg} beyond its friction");
            Finding::new(sample.time_s, share, SHARE, about)
        })
    }))
}

/// Whether a law applies to a method, for the table.
pub fn applies(law: Law, method: Method) -> bool {
    match law {
        Law::Momentum => method.locates_events() || method == Method::Compliant,
        Law::Penetration | Law::Depth => !method.is_compliant(),
        Law::Agreement => matches!(method, Method::Rodas4 | Method::Moreau),
        _ => true,
    }
}

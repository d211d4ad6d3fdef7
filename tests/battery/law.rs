//! Laws that need no reference: each looks at a run and says by how much it is broken where it is broken most.

use std::fmt;

use twinrig_robot::GRAVITY;

use crate::case::{Base, Method};
use crate::run::{Run, Sample};

/// A law of the battery.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Law {
    /// The plant goes on to the end.
    Refusal,
    /// Feet stay above the ground.
    Penetration,
    /// Friction takes energy and gives none.
    Dissipation,
    /// What no drive moves never has more energy than at its start.
    Energy,
    /// In flight the momentum changes by gravity alone.
    Momentum,
    /// The ground holds a foot by its friction at most.
    Friction,
    /// Methods of one model have one motion.
    Agreement,
}

impl Law {
    pub const ALL: [Self; 7] = [
        Self::Refusal,
        Self::Penetration,
        Self::Dissipation,
        Self::Energy,
        Self::Momentum,
        Self::Friction,
        Self::Agreement,
    ];

    /// What a run has of the law, where it is nearest to breaking it or breaks it most; none where the law says nothing of it.
    pub fn judge(self, run: &Run) -> Option<Finding> {
        let mut finding = match self {
            Self::Refusal => Some(refusal(run)),
            Self::Penetration => penetration(run),
            Self::Dissipation => dissipation(run),
            Self::Energy => energy(run),
            Self::Momentum => momentum(run),
            Self::Friction => friction(run),
            // Of two runs.
            Self::Agreement => None,
        }?;
        let mut until = run.samples.iter().rev();
        let last = until.find(|sample| sample.time_s <= finding.at_s)?;
        finding.fallbacks = last.fallbacks;
        Some(finding)
    }
}

/// How near a run comes to breaking a law, or by how much it does.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    pub at_s: f64,
    pub measured: f64,
    /// Above which the law is broken.
    pub bound: f64,
    pub about: String,
    /// How often the plant had left a step to another method, or shortened it.
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

    /// What is not a number breaks every law.
    pub fn is_violation(&self) -> bool {
        self.measured.is_nan() || self.measured > self.bound
    }

    /// The worse of two.
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

fn refusal(run: &Run) -> Finding {
    let at_s = run.samples.last().map_or(0.0, |sample| sample.time_s);
    let why = run.refused.clone().unwrap_or_default();
    let refused = f64::from(u8::from(run.refused.is_some()));
    Finding::new(at_s, refused, 0.0, why)
}

/// Depth below the ground \[m\]: where events are located next to none, otherwise of first order in the step. A method that has
/// left steps to Moreau's rule is held to that rule's.
fn penetration(run: &Run) -> Option<Finding> {
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

/// Energy that friction has given since it had taken most \[J\].
fn dissipation(run: &Run) -> Option<Finding> {
    let mut most = 0.0_f64;
    worst(run.samples.iter().map(|sample| {
        let taken = sample.energy.dissipated;
        most = most.max(taken);
        Finding::new(
            sample.time_s,
            most - taken,
            1e-9,
            "energy given by friction [J]",
        )
    }))
}

/// Energy above that of the start, as a share of what was exchanged [1].
fn energy(run: &Run) -> Option<Finding> {
    /// What is exchanged while nothing moves is round-off \[J\].
    const LEAST_EXCHANGED: f64 = 1e-6;
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
        let exchanged = sample.energy.exchanged.max(LEAST_EXCHANGED);
        let above = (sample.energy.stored() - start) / exchanged;
        let about = "energy above the start, of what was exchanged";
        Finding::new(sample.time_s, above, share, about)
    }))
}

/// Change of momentum in flight that gravity does not explain, relative to the momenta of the bodies [1].
fn momentum(run: &Run) -> Option<Finding> {
    if !run.case.method.locates_events() || run.case.base == Base::Fixed {
        return None;
    }
    let mut flight: Option<&Sample> = None;
    let mut findings = Vec::new();
    for pair in run.samples.windows(2) {
        let [before, after] = pair else { continue };
        if after.fallbacks > 0 {
            // Moreau's rule keeps no angular momentum.
            break;
        }
        let airborne = after.feet.iter().all(|foot| foot.force == [0.0; 3]);
        if !airborne {
            flight = None;
            continue;
        }
        let begun = *flight.get_or_insert(before);
        findings.extend(change_of_momentum(run, begun, after));
    }
    worst(findings.into_iter())
}

fn change_of_momentum(run: &Run, begun: &Sample, now: &Sample) -> Option<Finding> {
    const SHARE: f64 = 1e-6;
    let (from, to) = (begun.momentum?, now.momentum?);
    let fall = run.mass * GRAVITY * (now.time_s - begun.time_s);
    let mut linear = to.linear - from.linear;
    linear.z += fall;
    let mut angular = to.angular - from.angular;
    if run.case.base == Base::Planar {
        // What holds the trunk in its plane pushes as it must.
        linear.y = 0.0;
        (angular.x, angular.z) = (0.0, 0.0);
    }
    let scales = [
        from.linear_scale.max(to.linear_scale).max(fall),
        from.angular_scale.max(to.angular_scale),
    ];
    // What next to nothing has is round-off: a thousandth of the robot's mass, its legs' length, √(g l).
    let least = 1e-3 * run.mass * libm::sqrt(GRAVITY * run.length);
    let shares = [
        linear.norm() / scales[0].max(least),
        angular.norm() / scales[1].max(least * run.length),
    ];
    let names = ["linear", "angular"].map(|which| format!("change of {which} momentum in flight"));
    let findings = shares.into_iter().zip(names);
    worst(findings.map(|(share, name)| Finding::new(now.time_s, share, SHARE, name)))
}

/// Tangential force beyond what friction allows, relative to that [1]; on level ground, where the mean of forces in the cone
/// is in the cone.
fn friction(run: &Run) -> Option<Finding> {
    const SHARE: f64 = 1e-6;
    /// Force below which all is round-off \[N\].
    const FLOOR: f64 = 1e-9;
    if run.case.heights.is_some() {
        return None;
    }
    worst(run.samples.iter().flat_map(|sample| {
        let feet = sample.feet.iter().zip(&run.case.legs);
        feet.map(move |(foot, leg)| {
            let [x, y, z] = foot.force;
            let greatest = run.case.friction * z;
            let excess = (libm::hypot(x, y) - greatest - FLOOR).max(-z - FLOOR);
            let share = excess / greatest.abs().max(FLOOR);
            let about = format!("force of foot {leg} beyond its friction");
            Finding::new(sample.time_s, share, SHARE, about)
        })
    }))
}

/// The laws of one method, for a table.
pub fn applies(law: Law, method: Method) -> bool {
    match law {
        Law::Momentum => method.locates_events(),
        Law::Agreement => matches!(method, Method::Rodas4 | Method::Moreau),
        _ => true,
    }
}

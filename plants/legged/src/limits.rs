//! Limits of the model of a legged robot: stops, which compliant legs pass by their deflection, and
//! the ground, with which the trunk has no contact.

use serde::{Deserialize, Serialize};
use twinrig_contact::Ground;
use twinrig_kernel::{SimTime, signal};
use twinrig_robot::LegMount;
use twinrig_robot::leg::{Pantograph, Stop};
use twinrig_runtime::{Limit, LimitViolation};

use crate::LEGS;
use crate::error::LeggedError;
use crate::readings::Readings;

/// Distance beyond a stop that counts: ten times the deflection of stops in gaits \[m\].
const BEYOND: f64 = 1e-3;

const STOPS: [Stop; 4] = [Stop::Closed, Stop::Open, Stop::Extended, Stop::Bottomed];

/// Watch on legs and trunk at the instants of observation.
#[derive(Debug, Clone, Default)]
pub(crate) struct Limits {
    legs: Vec<LegRange>,
    ground: Option<Ground>,
    found: Excesses,
}

/// Limits exceeded since the start; part of the saved state.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Excesses {
    trunk: Option<Excess>,
    legs: [Option<Excess>; LEGS],
}

/// First instant beyond a limit, and greatest distance beyond it \[m\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Excess {
    first: SimTime,
    worst_m: f64,
}

impl Excess {
    fn include(this: &mut Option<Self>, now: SimTime, by_m: f64) {
        let worst_m = this.map_or(by_m, |excess| excess.worst_m.max(by_m));
        let first = this.map_or(now, |excess| excess.first);
        *this = Some(Self { first, worst_m });
    }
}

impl Limits {
    /// Creates the watch on these legs.
    ///
    /// # Errors
    /// If a leg is no pantograph.
    pub(crate) fn new(legs: &[&LegMount], ground: Option<&Ground>) -> Result<Self, LeggedError> {
        let legs = legs.iter().map(|mount| LegRange::new(mount));
        Ok(Self {
            legs: legs.collect::<Result<_, _>>()?,
            ground: ground.cloned(),
            found: Excesses::default(),
        })
    }

    /// Notes the limits that are exceeded now.
    pub(crate) fn check(&mut self, now: SimTime, of: &(impl Readings + ?Sized)) {
        for (leg, (range, found)) in self.legs.iter().zip(&mut self.found.legs).enumerate() {
            let beyond_m = range.beyond(of.angles(leg));
            if beyond_m > BEYOND {
                Excess::include(found, now, beyond_m);
            }
        }
        if let Some(ground) = &self.ground {
            let clearance = ground.below(&of.position()).gap;
            if clearance < 0.0 {
                Excess::include(&mut self.found.trunk, now, -clearance);
            }
        }
    }

    /// Returns the limits exceeded, of the trunk and of these legs.
    pub(crate) fn violations(&self, legs: &[String]) -> Vec<LimitViolation> {
        let violation = |part: String, limit, excess: Excess| LimitViolation {
            part,
            limit,
            first: excess.first,
            worst_m: excess.worst_m,
        };
        let trunk = self.found.trunk.into_iter();
        let trunk = trunk.map(|excess| violation("body".to_owned(), Limit::Ground, excess));
        let legs = legs.iter().zip(self.found.legs);
        let legs = legs.filter_map(|(leg, excess)| {
            Some(violation(signal::leg_path(leg), Limit::Stop, excess?))
        });
        trunk.chain(legs).collect()
    }

    /// Returns the state to be serialised.
    pub(crate) fn save(&self) -> Excesses {
        self.found
    }

    /// Restores a saved state.
    pub(crate) fn restore(&mut self, saved: Excesses) {
        self.found = saved;
    }
}

/// Range of a leg within its stops.
#[derive(Debug, Clone)]
struct LegRange {
    leg: Pantograph,
    /// Bends of the knee, θ₁ − θ₂, within the stops of the diagonal \[rad\].
    bends: [f64; 2],
    /// Openings θ₃ − θ₁ at which the parallel rod is at most [`BEYOND`] past its stops: its length
    /// changes by at most lΔ for each radian \[rad\].
    openings: [f64; 2],
}

impl LegRange {
    fn new(mount: &LegMount) -> Result<Self, LeggedError> {
        let parameters = &mount.leg;
        let invalid = LeggedError::of_leg(&mount.name);
        let leg = Pantograph::new(parameters).map_err(&invalid)?;
        let bottomed = leg.knee_bottomed().map_err(&invalid)?;
        let [extended, bottomed] = [0.0, bottomed].map(|q2| parameters.q2_ref - q2);
        let arm = parameters.l_delta;
        Ok(Self {
            leg,
            bends: [extended, bottomed],
            openings: [-BEYOND / arm, (parameters.parallel_travel + BEYOND) / arm],
        })
    }

    /// Returns the greatest distance beyond a stop \[m\], or zero where it is at most [`BEYOND`];
    /// zero, too, where second and third segment are in line, which is the fault of another
    /// assembly mode.
    fn beyond(&self, angles: [f64; 3]) -> f64 {
        let is_within = |[least, greatest]: [f64; 2], value| least <= value && value <= greatest;
        let [first, second, third] = angles;
        if is_within(self.bends, first - second) && is_within(self.openings, third - first) {
            return 0.0;
        }
        let Ok(pose) = self.leg.pose_of_angles(angles) else {
            return 0.0;
        };
        let gaps = STOPS.map(|stop| self.leg.gap(&pose, stop, f64::INFINITY));
        gaps.into_iter().fold(0.0, |worst, gap| worst.max(-gap))
    }
}

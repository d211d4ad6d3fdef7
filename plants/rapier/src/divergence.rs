//! What cannot be: an engine goes on whatever becomes of its bodies, and would say nothing of it.
//!
//! Each limit is far beyond what scenarios that are solved well come to (measured at 1 and 2 ms over all of `scenarios/`),
//! and far below what a plant that runs away reaches within milliseconds.

use rapier3d_f64::math::Vector;
use twinrig_robot::GRAVITY;

use crate::model::Point;
use crate::robot::{Machine, View};

/// Joints come apart by no more than this share of the leg's shortest segment, and stops are passed by no more.
const TORN: f64 = 0.25;

/// No segment turns by more in a step, against the trunk \[rad\]: forces are those of its beginning.
const TURNED: f64 = 1.0;

/// Of all energy that was ever exchanged, no more than this share comes from nowhere.
const FROM_NOWHERE: f64 = 0.5;

/// Nothing is made of less energy from nowhere than lifts the robot by this \[m\].
const LIFT: f64 = 0.1;

/// What broke, and why that is seen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Broken {
    pub(crate) part: String,
    pub(crate) why: String,
}

impl Broken {
    pub(crate) fn numbers() -> Self {
        Self {
            part: "engine".to_owned(),
            why: "its velocities are no numbers any more: shorten the step".to_owned(),
        }
    }
}

/// What is no number is within nothing.
fn within(value: f64, most: f64) -> bool {
    value <= most
}

impl Machine {
    /// Whether a leg is still one after a step.
    pub(crate) fn guard_leg(&self, leg: usize, before: &View, seconds: f64) -> Result<(), Broken> {
        let parts = &self.model.legs[leg];
        let broken = |why: String| {
            Err(Broken {
                part: format!("leg/{}", parts.name),
                why: format!("{why}: shorten the step"),
            })
        };
        let view = self.view(leg);
        for (now, before) in view.rates().into_iter().zip(before.rates()) {
            // What only a step that is cut short could tell is seen in the next long one.
            if !within(seconds * now.abs().max(before.abs()), TURNED) {
                return broken(format!(
                    "a segment of it turns at {now:.0} rad/s, which is too much for steps of {:.3} ms",
                    1e3 * seconds
                ));
            }
        }
        let lengths = parts.segments.iter().map(|segment| segment.length);
        let most = TORN * lengths.fold(f64::INFINITY, f64::min);
        let joints = self.joints_apart(leg, &view);
        if !within(joints, most) {
            return broken(format!("its joints are {:.1} mm apart", 1e3 * joints));
        }
        let stops = self.stops_passed(leg);
        if !within(stops, most) {
            return broken(format!("its stops are passed by {:.1} mm", 1e3 * stops));
        }
        Ok(())
    }

    /// Whether there is more energy than was there or was put in. What the engine loses, to soft constraints say, is not
    /// held against it.
    pub(crate) fn guard_energy(&self) -> Result<(), Broken> {
        let balance = self.state.ledger.balance();
        let legs = self.model.legs.iter().flat_map(|leg| &leg.segments);
        let mass = self.model.mass + legs.map(|segment| segment.mass).sum::<f64>();
        let most = FROM_NOWHERE * balance.exchanged + LIFT * GRAVITY * mass;
        let broken = |why: String| Broken {
            part: "energy".to_owned(),
            why,
        };
        if !within(balance.residual, most) {
            return Err(broken(format!(
                "{:.3e} J came from nowhere, and {:.3e} J were exchanged in all: shorten the step",
                balance.residual, balance.exchanged
            )));
        }
        let checked = self.state.ledger.check_within(most);
        checked.map_err(|why| broken(format!("{why}: shorten the step")))
    }

    /// The worst of what must be closed and is not: joints apart, stops passed, cables too long, feet in the ground \[m\].
    pub(crate) fn constraint_violation(&self) -> f64 {
        let mut worst = 0.0_f64;
        for (i, leg) in self.model.legs.iter().enumerate() {
            let view = self.view(i);
            let known = &self.state.legs[i];
            worst = worst
                .max(self.joints_apart(i, &view))
                .max(self.stops_passed(i));
            if self.model.drives.is_some() {
                let most = leg.pantograph.cable_length(known.drives[1].angle);
                worst = worst.max(leg.cable(known.angles) - most);
            }
            if let Some(ground) = &self.model.ground {
                let foot = crate::border::outside(view.place(&leg.foot));
                worst = worst.max(-ground.below(&foot).gap);
            }
        }
        worst
    }

    /// How far the worst joint of a leg is open \[m\].
    fn joints_apart(&self, leg: usize, view: &View) -> f64 {
        let parts = &self.model.legs[leg];
        let mut worst = 0.0_f64;
        let mut joint = self.trunk().pose.transform_point(parts.hip);
        for (body, segment) in parts.segments.iter().enumerate() {
            let end = |along: f64| Point {
                body,
                at: Vector::new(0.0, 0.0, segment.centre - along),
            };
            let apart = (view.place(&end(0.0)) - joint).length();
            // No number wins, unlike with max.
            worst = if apart <= worst { worst } else { apart };
            joint = view.place(&end(segment.length));
        }
        worst
    }

    /// How far the worst stop of a leg is passed; those of the knee as the lengths that they are lengths of \[m\].
    fn stops_passed(&self, leg: usize) -> f64 {
        let parts = &self.model.legs[leg];
        let angles = self.state.legs[leg].angles;
        let knee = parts.pantograph.joints(angles);
        let diagonal = parts.pantograph.diagonal_of(knee).value;
        [
            parts.l_delta * (angles[0] - angles[2]),
            parts.pantograph.parallel_of(knee).value - parts.parallel_max,
            diagonal - parts.pantograph.diagonal_max(),
            parts.diagonal_min - diagonal,
        ]
        .into_iter()
        .fold(0.0, f64::max)
    }
}

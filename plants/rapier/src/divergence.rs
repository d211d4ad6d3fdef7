//! Divergence checks: NaN and runaway bodies, which the engine does not report.
//!
//! Each limit is far above the values in well-resolved scenarios (measured at 1 and 2 ms over all
//! of `scenarios/`), and far below those that a diverging plant reaches within milliseconds.

use rapier3d_f64::math::Vector;
use twinrig_kernel::signal;
use twinrig_robot::GRAVITY;

use crate::assembly::AXIS;
use crate::model::{Point, TRUNK};
use crate::robot::{Machine, View};

/// Limit of joint gaps and stop violations, as a share of the leg's shortest segment.
const MAX_VIOLATION_SHARE: f64 = 0.25;

/// Limit of a rotation in a step \[rad\], of a segment relative to the body above the leg, and of a
/// joint of abduction: forces are those of the step's beginning.
const MAX_STEP_ROTATION: f64 = 1.0;

/// Limit of the energy gain in the residual, as a share of the energy exchanged.
const MAX_GAIN_SHARE: f64 = 0.5;

/// Energy gain that is always permitted, as the height by which it lifts the robot \[m\].
const PERMITTED_LIFT: f64 = 0.1;

/// The diverged part, and the reason.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Divergence {
    pub(crate) part: String,
    pub(crate) why: String,
}

impl Divergence {
    pub(crate) fn not_finite() -> Self {
        Self {
            part: "engine".to_owned(),
            why: "its velocities are not finite: shorten the step".to_owned(),
        }
    }
}

/// Returns whether the value is at most `limit`; false for NaN.
fn within(value: f64, limit: f64) -> bool {
    value <= limit
}

impl Machine {
    /// Checks the rates, joint gaps and stops of a leg after a step.
    pub(crate) fn check_leg(
        &self,
        leg: usize,
        before: &View,
        seconds: f64,
    ) -> Result<(), Divergence> {
        let model = &self.model.legs[leg];
        let diverged = |why: String| {
            Err(Divergence {
                part: signal::leg_path(&model.name),
                why: format!("{why}: shorten the step"),
            })
        };
        let view = self.view(leg);
        for (now, before) in view.rates().into_iter().zip(before.rates()) {
            // A rate that is excessive but within the limit of a partial step is detected in the
            // next full step.
            if !within(seconds * now.abs().max(before.abs()), MAX_STEP_ROTATION) {
                return diverged(format!(
                    "a segment rotates at {now:.0} rad/s, too fast for steps of {:.3} ms",
                    1e3 * seconds
                ));
            }
        }
        if !within(
            seconds * self.state.legs[leg].abduction.rate.abs(),
            MAX_STEP_ROTATION,
        ) {
            return diverged("the joint of abduction turns too fast".to_owned());
        }
        let lengths = model.segments.iter().map(|segment| segment.length);
        let limit = MAX_VIOLATION_SHARE * lengths.fold(f64::INFINITY, f64::min);
        let joints = self.joint_gap(leg, &view);
        if !within(joints, limit) {
            return diverged(format!("joint gap of {:.1} mm", 1e3 * joints));
        }
        let stops = self.stop_violation(leg);
        if !within(stops, limit) {
            return diverged(format!("stops exceeded by {:.1} mm", 1e3 * stops));
        }
        Ok(())
    }

    /// Checks the residual of the energy balance for a gain, and friction for negative dissipation.
    /// Losses, as those to soft constraints, are permitted.
    pub(crate) fn check_energy(&self) -> Result<(), Divergence> {
        let balance = self.state.ledger.balance();
        let legs = self.model.legs.iter().flat_map(|leg| &leg.segments);
        let carriers = self.model.legs.iter().filter_map(|leg| leg.carrier);
        let mass = self.model.mass
            + legs.map(|segment| segment.mass).sum::<f64>()
            + carriers.map(|carrier| carrier.mass).sum::<f64>();
        let limit = MAX_GAIN_SHARE * balance.exchanged + PERMITTED_LIFT * GRAVITY * mass;
        let diverged = |why: String| Divergence {
            part: "energy".to_owned(),
            why,
        };
        if !within(balance.residual, limit) {
            return Err(diverged(format!(
                "energy gain of {:.3e} J in the balance, with {:.3e} J exchanged: shorten the step",
                balance.residual, balance.exchanged
            )));
        }
        let checked = self.state.ledger.check_within([limit; 2]);
        checked.map_err(|why| diverged(format!("{why}: shorten the step")))
    }

    /// Returns the maximum constraint violation \[m\]: joint gaps, stops, cable length, ground
    /// penetration.
    pub(crate) fn violation(&self) -> f64 {
        let mut worst = 0.0_f64;
        for (i, leg) in self.model.legs.iter().enumerate() {
            let view = self.view(i);
            let known = &self.state.legs[i];
            worst = worst
                .max(self.joint_gap(i, &view))
                .max(self.stop_violation(i));
            if self.model.drives.is_some() {
                let limit = leg.pantograph.cable_length(known.drives[1].angle);
                worst = worst.max(leg.cable(known.angles) - limit);
            }
            if let Some(ground) = &self.model.ground {
                let foot = crate::conversion::to_nalgebra(view.place(&leg.foot));
                worst = worst.max(-ground.below(&foot).gap);
            }
        }
        worst
    }

    /// Returns the largest joint gap of a leg \[m\].
    fn joint_gap(&self, leg: usize, view: &View) -> f64 {
        let model = &self.model.legs[leg];
        let mut worst = 0.0_f64;
        if let Some(carrier) = &model.carrier {
            let hinge = self.trunk().pose.transform_point(carrier.place);
            worst = (view.bodies[TRUNK].pose.translation - hinge).length();
        }
        let mut joint = view.bodies[TRUNK].pose.transform_point(model.hip);
        for (body, segment) in model.segments.iter().enumerate() {
            let end = |along: f64| Point {
                body,
                at: Vector::new(0.0, 0.0, segment.centre - along),
            };
            let gap = (view.place(&end(0.0)) - joint).length();
            // Unlike with `f64::max`, NaN prevails.
            worst = if gap <= worst { worst } else { gap };
            joint = view.place(&end(segment.length));
            if model.carrier.is_some() {
                // A segment that leaves the plane of its leg turns about another axis.
                let axes = [body, TRUNK].map(|k| view.bodies[k].pose.rotation * AXIS);
                worst = worst.max(axes[0].cross(axes[1]).length() * segment.length);
            }
        }
        worst
    }

    /// Returns the largest stop violation of a leg, at the knee in terms of the limited lengths
    /// \[m\].
    fn stop_violation(&self, leg: usize) -> f64 {
        let model = &self.model.legs[leg];
        let angles = self.state.legs[leg].angles;
        let knee = model.pantograph.joints(angles);
        let diagonal = model.pantograph.diagonal_of(knee).value;
        let swing = model.carrier.map_or(0.0, |carrier| {
            let ([least, greatest], angle) =
                (carrier.axis.range, self.state.legs[leg].abduction.angle);
            model.segments[0].length * (least - angle).max(angle - greatest)
        });
        [
            swing,
            model.l_delta * (angles[0] - angles[2]),
            model.pantograph.parallel_of(knee).value - model.parallel_max,
            diagonal - model.pantograph.diagonal_max(),
            model.diagonal_min - diagonal,
        ]
        .into_iter()
        .fold(0.0, f64::max)
    }
}

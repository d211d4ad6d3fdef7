//! Contact of trunk, knees and ankles: velocities, impulses and work.

use rapier3d_f64::math::Vector;
use twinrig_legged::LEGS;

use crate::model::BodyPoint;
use crate::robot::Machine;

impl Machine {
    /// Returns the velocities of the contact points \[m/s\].
    pub(crate) fn body_velocities(&self) -> Vec<Vector> {
        let body = self.model.body.iter();
        body.map(|BodyPoint { leg, point }| match leg {
            Some(leg) => self.view(*leg).speed(point),
            None => self.trunk().speed(point),
        })
        .collect()
    }

    /// Returns the contact points' greatest depth \[m\].
    pub(crate) fn body_depth(&self) -> f64 {
        let body = self.model.body.iter();
        let heights = body.map(|BodyPoint { leg, point }| match leg {
            Some(leg) => self.view(*leg).place(point).z,
            None => self.trunk().place(point).z,
        });
        heights.fold(0.0, |depth: f64, height| depth.max(-height))
    }

    /// Adds impulses and work of the ground on the contact points in the last step, which began at
    /// these velocities.
    pub(crate) fn finish_body(&mut self, before: &[Vector]) {
        let after = self.body_velocities();
        for i in 0..self.model.body.len() {
            let Some(body) = &self.handles.body else {
                return;
            };
            let Some((normal, along)) = self.impulse_on(body.balls[i], body.floor) else {
                continue;
            };
            let mean = 0.5 * (before[i] + after[i]);
            self.state.ledger.impact -= normal.dot(mean);
            self.state.ledger.dissipated -= along.dot(mean);
            let sums = match self.model.body[i].leg {
                Some(leg) => &mut self.state.body.segments[leg],
                None => &mut self.state.body.trunk,
            };
            for (sum, part) in sums.iter_mut().zip((normal + along).to_array()) {
                *sum += part;
            }
        }
    }

    /// Sets the coefficients of friction of the contact points.
    pub(crate) fn set_body_friction(&mut self, legs: &[f64; LEGS], trunk: f64) {
        let Some(body) = &self.handles.body else {
            return;
        };
        for (ball, point) in body.balls.iter().zip(&self.model.body) {
            if let Some(collider) = self.world.sets.colliders.get_mut(*ball) {
                collider.set_friction(point.leg.map_or(trunk, |leg| legs[leg]));
            }
        }
    }
}

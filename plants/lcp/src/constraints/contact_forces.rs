//! Ground forces on the contacts of a mode, which hold sticking feet and slow sliding ones.

use super::motion::Dynamics;
use super::workspace::Workspace;
use crate::model::articulated::{Accelerations, Articulated, Row};
use crate::model::real::{Real, Wide};
use crate::model::site::{Footing, Site};
use crate::model::state::State;

impl<R: Wide, const N: usize> Dynamics<'_, R, N> {
    /// Solves for the contact forces and adds their effect to accelerations and dissipated power.
    pub(super) fn add_contact_forces(
        &self,
        state: &State<R, N>,
        articulated: &Articulated<R, N>,
        accelerations: &mut Accelerations<R, N>,
        workspace: &mut Workspace<R::Sum, N>,
        dissipated: &mut R,
    ) {
        let Some(ground) = &self.model.ground else {
            return;
        };
        let upright = articulated.rotation();
        workspace.rows.clear();
        workspace.force_rows.clear();
        workspace.responses.clear();
        workspace.forces.clear();
        workspace.normal_shares.clear();
        for contact in &self.mode.contacts {
            let site = Site::new(
                self.legs,
                &articulated.chain,
                state,
                contact.leg,
                contact.links,
            );
            let footing = site.footing(ground, state.position, &upright);
            let count = if contact.slides.is_some() { 1 } else { 3 };
            for k in 0..count {
                let row = site.row(footing.directions[k]);
                let force_row = match contact.slides {
                    Some(last) => {
                        let friction = <R::Sum as Real>::splat(self.model.friction[contact.leg]);
                        let slide = sliding(&footing, last);
                        let [n, a, b] = footing.directions;
                        site.row(std::array::from_fn(|i| {
                            n[i] - friction * (slide[0] * a[i] + slide[1] * b[i])
                        }))
                    }
                    None => row,
                };
                let free = row_acceleration(&row, accelerations);
                let recovery = <R::Sum as Real>::splat(self.recovery);
                let mut missing = -(free + footing.bias[k]) - recovery * footing.velocity[k];
                if k == 0 {
                    missing -= recovery * (footing.velocity[0] + recovery * footing.gap);
                }
                workspace.responses.push(articulated.response(&force_row));
                workspace.rows.push(row);
                workspace.force_rows.push(force_row);
                workspace.forces.push(missing);
                workspace
                    .normal_shares
                    .push(if contact.slides.is_some() { 0.0 } else { 1.0 });
            }
        }
        workspace.fill(articulated);
        workspace.solve(self.model.contact_compliance());
        let mut trunk = accelerations.trunk;
        let mut torques = articulated.torques;
        for ((force_row, response), &force) in workspace
            .force_rows
            .iter()
            .zip(&workspace.responses)
            .zip(&workspace.forces)
        {
            for (a, r) in trunk.iter_mut().zip(&response.trunk) {
                *a += *r * force;
            }
            for (torque, arm) in torques.iter_mut().zip(&force_row.links) {
                let sum = torque.lane(force_row.leg) + *arm * force;
                *torque = torque.with_lane(force_row.leg, sum);
            }
        }
        *accelerations = articulated.with_trunk(trunk, &torques);
        let mut next = 0;
        for contact in &self.mode.contacts {
            if let Some(last) = contact.slides {
                let site = Site::new(
                    self.legs,
                    &articulated.chain,
                    state,
                    contact.leg,
                    contact.links,
                );
                let footing = site.footing(ground, state.position, &upright);
                let slide = sliding(&footing, last);
                let speed = slide[0] * footing.velocity[1] + slide[1] * footing.velocity[2];
                let friction = <R::Sum as Real>::splat(self.model.friction[contact.leg]);
                let friction_power = friction * workspace.forces[next] * speed;
                let sum = dissipated.lane(contact.leg) + friction_power;
                *dissipated = dissipated.with_lane(contact.leg, sum);
            }
            next += if contact.slides.is_some() { 1 } else { 3 };
        }
    }
}

/// Returns the acceleration along a row without velocity terms.
fn row_acceleration<R: Real, const N: usize>(
    row: &Row<R::Sum, N>,
    accelerations: &Accelerations<R, N>,
) -> R::Sum {
    let mut sum = <R::Sum as Real>::zero();
    for (j, a) in row.trunk.iter().zip(&accelerations.trunk) {
        sum += *j * *a;
    }
    for (j, a) in row.links.iter().zip(&accelerations.links) {
        sum += *j * a.lane(row.leg);
    }
    sum
}

/// Returns the direction in which a foot slides, in the tangents of the ground. It is `last` at
/// small speeds, and after a reversal, so that the guard observes the sign change.
pub(crate) fn sliding<T: Real>(footing: &Footing<T>, last: [f64; 2]) -> [T; 2] {
    /// Speed below which the direction is undefined \[m/s\].
    const STILL: f64 = 1e-7;
    let [_, a, b] = footing.velocity;
    let speed = (a * a + b * b).sqrt();
    let onward = a.plain() * last[0] + b.plain() * last[1];
    if speed.plain() < STILL || onward <= 0.0 {
        last.map(T::splat)
    } else {
        [a / speed, b / speed]
    }
}

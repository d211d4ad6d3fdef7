//! Equations of legs and trunk: inertia, velocity terms, and forces of ground and pushes.

use twinrig_compliant::lanes::{Lanes, Simd};
use twinrig_compliant::{Below, Footforce, Pushed, TrunkMotion, Turns, broadcast};
use twinrig_contact::Ground;
use twinrig_legged::StepLoad;

use super::abduction::{LegJoint, OffPlane};
use super::carrier::{Carried, Carrier};
use super::contact::{Carriers, End, end_of};
use super::elimination::{ENTRIES, LinkEquations, PLANE, PlaneShare};
use super::evaluation::Evaluation;

/// Equations of legs and trunk in one state.
pub(super) struct Equations<L: Lanes, const N: usize> {
    pub(super) links: LinkEquations<L, N>,
    pub(super) share: PlaneShare<L>,
    pub(super) off_plane: OffPlane<L>,
    /// Joints of abduction, if legs have them.
    pub(super) joint: Option<LegJoint<L>>,
    /// Force and torque of pushes and of the ground on the trunk.
    pub(super) on_trunk: Option<[f64; 6]>,
}

impl<L: Lanes, const N: usize> Equations<L, N> {
    /// Returns the carriers of the legs.
    #[inline(always)]
    pub(super) fn carriers<'a>(&'a self, trunk: &'a TrunkMotion) -> Carriers<'a, L> {
        Carriers::new(self.joint.as_ref().map(|joint| &joint.frame), trunk)
    }

    /// Adds a force and a torque on the trunk.
    #[inline(always)]
    pub(super) fn add_on_trunk(&mut self, wrench: [f64; 6]) {
        let sum = self.on_trunk.get_or_insert([0.0; 6]);
        for (sum, part) in sum.iter_mut().zip(wrench) {
            *sum += part;
        }
    }
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize, const A: usize, const B: usize>
    Evaluation<'_, S, N, P, A, B>
{
    #[inline(always)]
    pub(super) fn equations<const FREE: bool>(
        &self,
        turns: &Turns<L, N>,
        entries: &[[L; N]; N],
        trunk: &TrunkMotion,
        joint: Option<LegJoint<L>>,
    ) -> Equations<L, N> {
        let (legs, rates) = (self.legs, &self.state.rates);
        let zero = rates[0].zero();
        if FREE {
            let carrier = match &joint {
                Some(LegJoint { frame, .. }) => Carrier {
                    turning: frame.turning,
                    field: frame.field,
                },
                None => Carrier {
                    turning: broadcast(zero, trunk.turning),
                    field: broadcast(zero, trunk.field),
                },
            };
            let carried = Carried::new(legs, turns, rates, entries, &carrier);
            return Equations {
                links: LinkEquations {
                    inertia: *entries,
                    columns: carried.columns,
                    torques: carried.torques,
                },
                share: carried.share,
                off_plane: carried.off_plane,
                joint,
                on_trunk: None,
            };
        }
        let mut torques = *rates;
        for j in 0..N {
            let weight = turns.cosines[j] * trunk.field[0] + turns.sines[j] * trunk.field[2];
            let mut torque = legs.moments[j] * weight;
            for i in 0..N {
                if i < j {
                    torque += entries[i][j] * (rates[i] * rates[i]);
                } else if i > j {
                    torque -= entries[j][i] * (rates[i] * rates[i]);
                }
            }
            torques[j] = torque;
        }
        Equations {
            links: LinkEquations {
                inertia: *entries,
                columns: [[zero; PLANE]; N],
                torques,
            },
            share: PlaneShare {
                matrix: [zero; ENTRIES],
                force: [zero; PLANE],
            },
            off_plane: OffPlane {
                lateral: zero,
                roll: zero,
                yaw: zero,
                moment: [zero; 2],
                spread: [zero; 3],
            },
            joint: None,
            on_trunk: None,
        }
    }

    /// Adds the force of the ground on contact point `p`.
    #[inline(always)]
    pub(super) fn stand<const FREE: bool>(
        &self,
        ground: &Ground,
        turns: &Turns<L, N>,
        trunk: &TrunkMotion,
        p: usize,
        equations: &mut Equations<L, N>,
    ) -> Footforce<L> {
        let (legs, state) = (self.legs, self.state);
        let links = N - P + 1 + p;
        let carriers = equations.carriers(trunk);
        let end = end_of(legs, turns, state, links, carriers);
        let below = Below::new(self.simd, ground, trunk, &end.point);
        let foot = below.force(&legs.sole, end.point.velocity, state.bristles[p]);
        self.add_force::<FREE>(turns, links, &end, foot.force, equations);
        foot
    }

    /// Adds a force in trunk axes on the end of the first `links` links.
    #[inline(always)]
    pub(super) fn add_force<const FREE: bool>(
        &self,
        turns: &Turns<L, N>,
        links: usize,
        end: &End<L>,
        force: [L; 3],
        equations: &mut Equations<L, N>,
    ) {
        let [fx, fy, fz] = match &equations.joint {
            Some(joint) => joint.frame.into_leg(force),
            None => force,
        };
        for j in 0..links {
            let arm = turns.cosines[j] * fx + turns.sines[j] * fz;
            equations.links.torques[j] += self.legs.pantographs.links[j] * arm;
        }
        if FREE {
            let [x, _, z] = end.place;
            let force = &mut equations.share.force;
            force[0] += fx;
            force[1] += fz;
            force[2] += z * fx - x * fz;
            let off_plane = &mut equations.off_plane;
            off_plane.lateral += fy;
            off_plane.roll -= z * fy;
            off_plane.yaw += x * fy;
        }
    }

    /// Adds the forces of pushes on feet and trunk, and returns their power.
    #[inline(always)]
    pub(super) fn push<const FREE: bool>(
        &self,
        load: &StepLoad,
        turns: &Turns<L, N>,
        trunk: &TrunkMotion,
        equations: &mut Equations<L, N>,
    ) -> L {
        let pushed = Pushed::new(self.simd, (load, self.time), &trunk.rotation, [0.0; 3]);
        let carriers = equations.carriers(trunk);
        let foot = end_of(self.legs, turns, self.state, 3, carriers);
        self.add_force::<FREE>(turns, 3, &foot, pushed.feet, equations);
        if FREE {
            equations.add_on_trunk(pushed.trunk);
        }
        pushed.power(self.simd, foot.point.velocity, trunk)
    }
}

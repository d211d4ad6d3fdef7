//! Right-hand side of the equations of motion.

use twinrig_compliant::events::{ABDUCTION, GROUND, if_compressed};
use twinrig_compliant::frame::{cross, into_world, quaternion_rate};
use twinrig_compliant::lanes::{Lanes, Quad, Simd, Task};
use twinrig_compliant::{
    Below, Commands, DriveLaws, Flows, Footforce, Internal, JointMotion, JointState, Limited,
    Pushed, Resistance, TrunkMotion, Turns, broadcast,
};
use twinrig_contact::Ground;
use twinrig_legged::{Base, StepLoad};

use super::abduction::{LegJoint, OffPlane};
use super::carrier::{Carried, Carrier};
use super::contact::{Carriers, End, end_of};
use super::elimination::{ENTRIES, LinkEquations, PLANE, PlaneShare};
use super::model::{CompliantModel, Legs};
use super::state::{Slope, State};
use super::trunk::TrunkSystem;

/// Right-hand side in a state, to be called from several places.
pub(crate) struct Evaluation<'a, S: Simd, const N: usize, const P: usize, const A: usize> {
    pub(crate) simd: S,
    pub(crate) model: &'a CompliantModel<N, A>,
    pub(crate) legs: &'a Legs<S::Lanes, N, A>,
    pub(crate) commands: &'a Commands<S::Lanes>,
    pub(crate) time: f64,
    /// Load of pushes, if any.
    pub(crate) load: Option<&'a StepLoad>,
    pub(crate) state: &'a State<S::Lanes, N, P, A>,
    /// Joints at the limit of their torque, once they are known.
    pub(crate) limits: Option<Limits<S::Lanes>>,
}

/// Joints at the limit of their torque.
#[derive(Clone, Copy)]
pub(crate) struct Limits<L> {
    hip: Limited<L>,
    /// Joints of abduction, if there are any.
    abduction: Option<Limited<L>>,
    /// Number of times that they may be determined again.
    rounds: u8,
}

/// Everything that does not depend on the drives.
struct Setting<L: Lanes, const N: usize, const P: usize> {
    trunk: TrunkMotion,
    internal: Internal<L, N>,
    equations: Equations<L, N>,
    /// Power of pushes \[W\].
    external: L,
    dissipated: L,
    bristles: [[L; 2]; P],
    /// World frame \[N\].
    ground: [L; 3],
    /// Compressed elements.
    compressed: L,
}

/// Returns a vector in the first three lanes.
#[inline(always)]
fn four<S: Simd>(simd: S, [x, y, z]: [f64; 3]) -> S::Lanes {
    simd.load(Quad([x, y, z, 0.0]))
}

/// Equations of legs and trunk in one state.
struct Equations<L: Lanes, const N: usize> {
    links: LinkEquations<L, N>,
    share: PlaneShare<L>,
    off_plane: OffPlane<L>,
    /// Joints of abduction, if legs have them.
    joint: Option<LegJoint<L>>,
    /// Force and torque of pushes on the trunk.
    push: Option<[f64; 6]>,
}

impl<S: Simd, const N: usize, const P: usize, const A: usize> Task for Evaluation<'_, S, N, P, A> {
    type Output = Slope<S::Lanes, N, P, A>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        // Planes that abduct move with any base.
        if A == 0 && self.model.base == Base::Fixed {
            self.slope::<false>()
        } else {
            self.slope::<true>()
        }
    }
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize, const A: usize>
    Evaluation<'_, S, N, P, A>
{
    /// Returns the slope: each kind of drive in a branch of its own, with its values in registers.
    #[inline(always)]
    fn slope<const FREE: bool>(&self) -> Slope<L, N, P, A> {
        let [hip, knee] = self.commands.at(self.time);
        match (&self.model.drives, self.limits) {
            (DriveLaws::None, _) => {
                let setting = self.setting::<FREE>(false);
                let zero = setting.internal.tension;
                let solution =
                    self.solve_free::<FREE>(&setting.equations, zero, 0.0, &setting.trunk);
                if let Some(again) = self.limit_abduction(&solution) {
                    return again;
                }
                self.slope_of::<FREE>(&setting, &solution, zero)
            }
            (DriveLaws::Motors([at_hip, at_pulley]), _) => {
                let setting = self.setting::<FREE>(true);
                let [hip_damping, knee_damping] = self.commands.damping;
                let torque = hip - hip_damping * self.state.rates[0];
                let solution =
                    self.solve_free::<FREE>(&setting.equations, torque, *at_hip, &setting.trunk);
                if let Some(again) = self.limit_abduction(&solution) {
                    return again;
                }
                let torque = knee - knee_damping * self.state.pulley_rate;
                let load = self.legs.pantographs.pulley_radius * setting.internal.tension;
                let acceleration = (torque - load) * (1.0 / at_pulley);
                self.slope_of::<FREE>(&setting, &solution, acceleration)
            }
            (DriveLaws::Servos { hip: law, .. }, None) => {
                let setting = self.setting::<FREE>(true);
                let acceleration = law.acceleration(hip, self.state.angles[0], self.state.rates[0]);
                let solution =
                    self.solve_imposed::<FREE>(&setting.equations, acceleration, &setting.trunk);
                let torque = solution.hip_torque + acceleration * law.inertia();
                let limit = law.limited(torque, self.state.rates[0]);
                let hip = Limited::beyond(torque, limit);
                let abduction = self.beyond(&solution);
                if hip.any() || abduction.is_some_and(|limited| limited.any()) {
                    // Rare: from the begin, so that nothing is kept for it otherwise.
                    let limits = Some(Limits {
                        hip,
                        abduction,
                        rounds: Limited::<L>::ROUNDS,
                    });
                    return self.simd.call(Self { limits, ..*self });
                }
                let pulley = self.winding(knee, &setting);
                self.slope_of::<FREE>(&setting, &solution, pulley)
            }
            (DriveLaws::Servos { hip: law, .. }, Some(limits)) => {
                let setting = self.setting::<FREE>(true);
                let acceleration = law.acceleration(hip, self.state.angles[0], self.state.rates[0]);
                let solution = self.solve_limited::<FREE>(
                    &setting.equations,
                    acceleration,
                    &limits.hip,
                    law.inertia(),
                    &setting.trunk,
                );
                let torque = solution.hip_torque + solution.links[0] * law.inertia();
                let most = law.limited(torque, self.state.rates[0]);
                let beyond = Limited::beyond(torque, most);
                let lag = acceleration - solution.links[0];
                let (hip, differs) = limits.hip.next(&beyond, lag);
                let abduction = self.next_abduction(&limits, &solution);
                let differs = differs || abduction.is_some_and(|(_, differs)| differs);
                if let Some(rounds) = limits.rounds.checked_sub(1)
                    && differs
                {
                    let limits = Some(Limits {
                        hip,
                        abduction: abduction.map(|(limited, _)| limited),
                        rounds,
                    });
                    return self.simd.call(Self { limits, ..*self });
                }
                let pulley = self.winding(knee, &setting);
                self.slope_of::<FREE>(&setting, &solution, pulley)
            }
        }
    }

    /// Returns the acceleration of the pulley under its servo and its load.
    #[inline(always)]
    fn winding(&self, set_point: L, setting: &Setting<L, N, P>) -> L {
        let (state, load) = (
            self.state,
            self.legs.pantographs.pulley_radius * setting.internal.tension,
        );
        let DriveLaws::Servos { knee, .. } = &self.model.drives else {
            return load.zero();
        };
        let wanted = knee.acceleration(set_point, state.pulley, state.pulley_rate);
        knee.acceleration_under(load, wanted, state.pulley_rate)
    }

    /// Returns the joints of abduction, if legs have them, and the torques of stops and friction.
    #[inline(always)]
    fn joint(&self, trunk: &TrunkMotion) -> Option<(LegJoint<L>, Resistance<L>)> {
        let (joints, motion) = (self.legs.joints.first()?, self.state.abduction.first()?);
        let resistance = joints.resistance(motion.angle, motion.rate);
        let set_point = self.commands.abduction_at(self.time);
        let limited = self.limits.and_then(|limits| limits.abduction);
        let joint = LegJoint {
            frame: joints.frame(motion.angle, motion.rate, trunk),
            drive: joints.drive(set_point, motion, resistance.torque, limited.as_ref()),
        };
        Some((joint, resistance))
    }

    /// Returns the joints of abduction whose servos need a torque beyond its limit, if there are
    /// servos with a limit.
    #[inline(always)]
    fn beyond(&self, solution: &Solution<L, N>) -> Option<Limited<L>> {
        let (joints, state) = (self.legs.joints.first()?, self.state.abduction.first()?);
        joints.beyond(solution.joint.as_ref()?, state)
    }

    /// Returns the joints of abduction at their limit in the next round, and whether they differ.
    #[inline(always)]
    fn next_abduction(
        &self,
        limits: &Limits<L>,
        solution: &Solution<L, N>,
    ) -> Option<(Limited<L>, bool)> {
        let (joints, state) = (self.legs.joints.first()?, self.state.abduction.first()?);
        let set_point = self.commands.abduction_at(self.time);
        let limited = limits.abduction.as_ref()?;
        joints.next(limited, solution.joint.as_ref()?, set_point, state)
    }

    /// Returns the slope with the joints of abduction at the limit of their torque, if they differ
    /// from those assumed, of legs whose hips have no such limit.
    #[inline(always)]
    fn limit_abduction(&self, solution: &Solution<L, N>) -> Option<Slope<L, N, P, A>> {
        let limits = match self.limits {
            None => {
                let abduction = self.beyond(solution).filter(Limited::any)?;
                Limits {
                    hip: Limited::none(abduction.torque.zero()),
                    abduction: Some(abduction),
                    rounds: Limited::<L>::ROUNDS,
                }
            }
            Some(limits) => {
                let (abduction, differs) = self.next_abduction(&limits, solution)?;
                let rounds = limits.rounds.checked_sub(1).filter(|_| differs)?;
                Limits {
                    abduction: Some(abduction),
                    rounds,
                    ..limits
                }
            }
        };
        let limits = Some(limits);
        Some(self.simd.call(Self { limits, ..*self }))
    }

    /// Returns everything but the drives.
    #[inline(always)]
    fn setting<const FREE: bool>(&self, has_cable: bool) -> Setting<L, N, P> {
        let (legs, state) = (self.legs, self.state);
        let trunk = TrunkMotion::new(state.trunk());
        let turns = Turns::new(&state.angles);
        let internal = Internal::new(&legs.pantographs, &turns, &state.joints(), has_cable);
        let entries = turns.inertia_and_swing(&legs.inertias);
        let joint = self.joint(&trunk);
        let mut equations =
            self.equations::<FREE>(&turns, &entries, &trunk, joint.map(|(joint, _)| joint));
        for j in 0..N {
            equations.links.torques[j] += internal.torques[j];
        }
        let (mut dissipated, mut compressed) = (internal.dissipated, internal.compressed);
        if let Some((_, resistance)) = &joint {
            dissipated += resistance.dissipated;
            compressed += if_compressed(ABDUCTION, resistance.depth);
        }
        let zero = dissipated.zero();
        let (mut bristles, mut ground) = ([[zero; 2]; P], [zero; 3]);
        if let Some(terrain) = &self.model.rigid.ground {
            for p in 0..P {
                let foot = self.stand::<FREE>(terrain, &turns, &trunk, p, &mut equations);
                bristles[p] = foot.bristle_rate;
                dissipated += foot.dissipated;
                compressed += if_compressed(GROUND + p, foot.depth);
                for i in 0..3 {
                    ground[i] += foot.force_in_world[i];
                }
            }
        }
        let mut external = zero;
        if let Some(load) = self.load {
            external = self.push::<FREE>(load, &turns, &trunk, &mut equations);
        }
        Setting {
            trunk,
            internal,
            equations,
            external,
            dissipated,
            bristles,
            ground,
            compressed,
        }
    }

    #[inline(always)]
    fn slope_of<const FREE: bool>(
        &self,
        setting: &Setting<L, N, P>,
        solution: &Solution<L, N>,
        pulley_acceleration: L,
    ) -> Slope<L, N, P, A> {
        let (simd, state, trunk) = (self.simd, self.state, &setting.trunk);
        let tension = setting.internal.tension;
        let knee = self.legs.pantographs.pulley_radius * tension;
        let zero = knee.zero();
        let mut actuator = solution.hip_torque * state.rates[0] + knee * state.pulley_rate;
        let mut abduction = state.abduction;
        if let (Some(joint), Some(slope)) = (&solution.joint, abduction.first_mut()) {
            actuator += joint.torque * slope.rate;
            *slope = JointState {
                angle: slope.rate,
                rate: joint.acceleration,
                impulse: joint.torque,
            };
        }
        let [position, attitude, velocity, turning] = if FREE {
            let [vx, vy, vz, wx, wy, wz] = solution.trunk;
            let attitude = quaternion_rate(state.attitude.quad().0, trunk.turning);
            [
                four(simd, into_world(&trunk.rotation, trunk.velocity)),
                simd.load(Quad(attitude)),
                four(simd, [vx, vy, vz]),
                four(simd, [wx, wy, wz]),
            ]
        } else {
            [zero; 4]
        };
        Slope {
            state: State {
                position,
                attitude,
                velocity,
                turning,
                angles: state.rates,
                rates: solution.links,
                pulley: state.pulley_rate,
                pulley_rate: pulley_acceleration,
                bristles: setting.bristles,
                abduction,
            },
            flows: Flows {
                actuator,
                external: setting.external,
                dissipated: setting.dissipated,
                hip: solution.hip_torque,
                knee,
                cable: tension,
                ground: setting.ground,
            },
            compressed: setting.compressed,
        }
    }

    #[inline(always)]
    fn equations<const FREE: bool>(
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
                push: None,
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
            push: None,
        }
    }

    /// Adds the force of the ground on contact point `p`.
    #[inline(always)]
    fn stand<const FREE: bool>(
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
    fn add_force<const FREE: bool>(
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
    fn push<const FREE: bool>(
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
        equations.push = FREE.then_some(pushed.trunk);
        pushed.power(self.simd, foot.point.velocity, trunk)
    }
}

/// Accelerations of trunk and links, and torque of the hip drives on their links.
struct Solution<L, const N: usize> {
    trunk: [f64; 6],
    links: [L; N],
    hip_torque: L,
    /// Joints of abduction, if legs have them.
    joint: Option<JointMotion<L>>,
}

/// Accelerations of the trunk, of the planes of the legs, and of their joints.
struct BaseMotion<L> {
    trunk: [f64; 6],
    plane: [L; PLANE],
    joint: Option<JointMotion<L>>,
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize, const A: usize>
    Evaluation<'_, S, N, P, A>
{
    /// Solves with the acceleration of the hips imposed.
    #[inline(always)]
    fn solve_imposed<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        acceleration: L,
        trunk: &TrunkMotion,
    ) -> Solution<L, N> {
        let (mut links, mut share) = (equations.links, equations.share);
        links.impose::<FREE>(acceleration, &mut share);
        let eliminated = links.eliminate::<1, FREE>(&mut share);
        let mut imposed = equations.links.torques;
        imposed[0] = acceleration;
        let base = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<1, FREE>(&base.plane, imposed);
        Solution {
            trunk: base.trunk,
            joint: base.joint,
            links,
            hip_torque: equations.links.first_torque::<FREE>(&links, &base.plane),
        }
    }

    /// Solves with hips that rotate under a torque, which also accelerates an inertia.
    #[inline(always)]
    fn solve_free<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        torque: L,
        inertia: f64,
        trunk: &TrunkMotion,
    ) -> Solution<L, N> {
        let (mut links, mut share) = (equations.links, equations.share);
        links.inertia[0][0] = links.inertia[0][0] + inertia;
        links.torques[0] += torque;
        let eliminated = links.eliminate::<0, FREE>(&mut share);
        let base = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<0, FREE>(&base.plane, links.torques);
        Solution {
            trunk: base.trunk,
            joint: base.joint,
            links,
            hip_torque: torque - links[0] * inertia,
        }
    }

    /// Solves with some hips free under the limit of their torque, the others with imposed
    /// acceleration: their first row becomes θ̈ = α.
    #[inline(always)]
    fn solve_limited<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        acceleration: L,
        limited: &Limited<L>,
        inertia: f64,
        trunk: &TrunkMotion,
    ) -> Solution<L, N> {
        let (mut links, mut share) = (equations.links, equations.share);
        let (limit, zero) = (limited.torque, acceleration.zero());
        let limited = limited.side.abs().gt(zero);
        let imposed = zero.or(limited, acceleration);
        links.impose::<FREE>(imposed, &mut share);
        links.inertia[0][0] = (links.inertia[0][0] + inertia).or(limited, zero.like(1.0));
        for j in 1..N {
            links.inertia[j][0] = links.inertia[j][0].or(limited, zero);
        }
        for column in &mut links.columns[0] {
            *column = column.or(limited, zero);
        }
        links.torques[0] = (links.torques[0] + limit).or(limited, imposed);
        let eliminated = links.eliminate::<0, FREE>(&mut share);
        let base = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<0, FREE>(&base.plane, links.torques);
        Solution {
            trunk: base.trunk,
            joint: base.joint,
            links,
            hip_torque: equations.links.first_torque::<FREE>(&links, &base.plane),
        }
    }

    /// Returns the accelerations of the trunk, of the plane of each leg, and of its joint.
    #[inline(always)]
    fn trunk<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        share: &PlaneShare<L>,
        trunk: &TrunkMotion,
    ) -> BaseMotion<L> {
        let zero = equations.off_plane.lateral.zero();
        if !FREE {
            return BaseMotion {
                trunk: [0.0; 6],
                plane: [zero; PLANE],
                joint: None,
            };
        }
        if let Some(joint) = &equations.joint {
            return self.abducted(equations, share, joint, trunk);
        }
        let off_plane = &equations.off_plane;
        let hy = self.legs.hip[1];
        let [xx, zx, zz, px, pz, pp] = share.matrix;
        let [fx, fz, pitch] = share.force;
        let [sx, sz] = off_plane.moment;
        let [mxx, mzz, mxz] = off_plane.spread;
        // Forces forward and up act beside the centre of mass.
        let (hxx, hzx, hzz) = (hy * xx, hy * zx, hy * zz);
        let a = L::sums([xx, zx, zz, px]).quad().0;
        let b = L::sums([pz, pp, hxx, hzx]).quad().0;
        let c = L::sums([hzz, hy * px, hy * pz, hy * hxx + mxx]).quad().0;
        let d = L::sums([hy * hzz + mzz, hy * hzx + mxz, fx, fz]).quad().0;
        let roll = off_plane.roll + hy * fz;
        let yaw = off_plane.yaw - hy * fx;
        let e = L::sums([pitch, roll, yaw, off_plane.lateral]).quad().0;
        let f = L::sums([sx, sz, self.legs.mass_hip[1], zero]).quad().0;
        let model = self.model;
        let [inertia_x, inertia_y, inertia_z] = model.inertia;
        let (field, moment) = (trunk.field, [f[0], f[2], f[1]]);
        let weight = cross(moment, field);
        let [wx, wy, wz] = trunk.turning;
        let spin = [inertia_x * wx, inertia_y * wy, inertia_z * wz];
        let gyro = cross(trunk.turning, spin);
        let mut system = TrunkSystem {
            plane: [a[0] + model.trunk_mass, a[1], a[2] + model.trunk_mass],
            ahead: [b[3], a[3], -b[2]],
            up: [c[0], b[0], -b[3]],
            lateral: [-f[1], f[0]],
            rotation: [
                d[0] + inertia_x,
                c[2],
                b[1] + inertia_y,
                -d[1],
                -c[1],
                c[3] + inertia_z,
            ],
            mass: model.mass,
            force: [
                d[2] + model.mass * field[0],
                e[3] + model.mass * field[1],
                d[3] + model.mass * field[2],
                e[1] + weight[0] - gyro[0],
                e[0] + weight[1] - gyro[1],
                e[2] + weight[2] - gyro[2],
            ],
        };
        if let Some(payload) = &model.payload {
            system.carry(payload, field, trunk.turning);
        }
        if let Some(push) = equations.push {
            for (force, push) in system.force.iter_mut().zip(push) {
                *force += push;
            }
        }
        let accelerations = system.solve(model.base);
        let [x, _, z, roll, pitch, yaw] = accelerations;
        let plane = [
            zero.like(x) - hy * yaw,
            zero.like(z) + hy * roll,
            zero.like(pitch),
        ];
        BaseMotion {
            trunk: accelerations,
            plane,
            joint: None,
        }
    }

    /// Returns the same with legs that abduct.
    #[inline(always)]
    fn abducted(
        &self,
        equations: &Equations<L, N>,
        share: &PlaneShare<L>,
        joint: &LegJoint<L>,
        trunk: &TrunkMotion,
    ) -> BaseMotion<L> {
        let (model, beside, LegJoint { frame, drive }) = (self.model, self.legs.hip[1], joint);
        let mut body = equations
            .off_plane
            .body((self.legs.mass, beside), share, frame);
        let row = body.eliminate(drive);
        let mut system = body.into_trunk(frame);
        let [xx, yy, zz] = model.inertia;
        let (mut inertia, mut moment) = ([xx, 0.0, yy, 0.0, 0.0, zz], [0.0; 3]);
        if let Some(payload) = &model.payload {
            let [[xx, ..], [yx, yy, _], [zx, zy, zz]] = payload.inertia();
            let entries = inertia.iter_mut().zip([xx, yx, yy, zx, zy, zz]);
            entries.for_each(|(entry, part)| *entry += part);
            moment = payload.moment;
        }
        let body = (model.trunk_mass, moment, inertia);
        system.add_trunk(body, trunk.field, trunk.turning);
        if let Some(push) = equations.push {
            system.push(push);
        }
        let accelerations = system.solve(model.base);
        let [linear, angular] = frame.acceleration(accelerations);
        let motion = row.motion(drive, [linear, angular]);
        let [about_y, about_z] = frame.swing;
        let plane = [
            linear[0] - beside * (angular[2] + about_z),
            linear[2] + beside * (angular[0] + motion.acceleration),
            angular[1] + about_y,
        ];
        BaseMotion {
            trunk: accelerations,
            plane,
            joint: Some(motion),
        }
    }
}

impl<L: Lanes, const N: usize> Equations<L, N> {
    /// Returns the carriers of the legs.
    #[inline(always)]
    fn carriers<'a>(&'a self, trunk: &'a TrunkMotion) -> Carriers<'a, L> {
        Carriers::new(self.joint.as_ref().map(|joint| &joint.frame), trunk)
    }
}

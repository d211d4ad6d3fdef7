//! Right-hand side of the equations of motion.

use twinrig_compliant::events::{GROUND, if_compressed};
use twinrig_compliant::frame::{cross, into_world, quaternion_rate};
use twinrig_compliant::lanes::{Lanes, Quad, Simd, Task};
use twinrig_compliant::{
    Below, Commands, DriveLaws, Flows, Footforce, Internal, Point, Pushed, TrunkMotion, Turns,
    broadcast,
};
use twinrig_contact::Ground;
use twinrig_legged::{Base, StepLoad};

use super::carrier::{Carried, Carrier};
use super::contact::end_of;
use super::elimination::{ENTRIES, LinkEquations, PLANE, PlaneShare};
use super::model::{CompliantModel, Legs};
use super::state::{Slope, State};
use super::trunk::TrunkSystem;

/// Right-hand side in a state, to be called from several places.
pub(crate) struct Evaluation<'a, S: Simd, const N: usize, const P: usize> {
    pub(crate) simd: S,
    pub(crate) model: &'a CompliantModel<N>,
    pub(crate) legs: &'a Legs<S::Lanes, N>,
    pub(crate) commands: &'a Commands<S::Lanes>,
    pub(crate) time: f64,
    /// Load of pushes, if any.
    pub(crate) load: Option<&'a StepLoad>,
    pub(crate) state: &'a State<S::Lanes, N, P>,
    /// Hips at the limit of their torque, once they are known.
    pub(crate) limit: Option<Limited<S::Lanes>>,
}

/// Hips at the limit of their torque.
#[derive(Clone, Copy)]
pub(crate) struct Limited<L: Lanes> {
    /// Torque \[N·m\].
    torque: L,
    /// 1 at the greatest torque, −1 at the least, 0 for a hip that follows its command.
    side: L,
    /// Number of times that they may be determined again.
    rounds: u8,
}

impl<L: Lanes> Limited<L> {
    /// Returns the hips that need a torque beyond its limit.
    #[inline(always)]
    fn beyond(torque: L, limit: L, rounds: u8) -> Self {
        let (zero, one) = (torque.zero(), torque.like(1.0));
        let side = one.or(torque.gt(limit), (-one).or(limit.gt(torque), zero));
        Self {
            torque: limit,
            side,
            rounds,
        }
    }

    /// Returns whether there are such hips.
    #[inline(always)]
    fn any(&self) -> bool {
        self.side.any(self.side.abs().gt(self.side.zero()))
    }

    /// Returns the hips at their limit in the next round, if they differ: whether one is at its
    /// limit depends on the others. `beyond` has those that would need more torque, `lag` is the
    /// commanded less the present acceleration.
    #[inline(always)]
    fn next(&self, beyond: &Self, lag: L) -> Option<Self> {
        let zero = lag.zero();
        let follows = zero.gt(self.side.abs() - 0.5);
        let kept = zero.or(zero.gt(lag * self.side), self.side);
        let next = Self {
            torque: beyond.torque.or(follows, self.torque),
            side: beyond.side.or(follows, kept),
            rounds: self.rounds.checked_sub(1)?,
        };
        let differs = (next.side - self.side).abs().gt(zero);
        zero.any(differs).then_some(next)
    }
}

/// Greatest number of rounds; two suffice but where several hips are about to reach their limits.
const ROUNDS: u8 = 6;

/// Everything that does not depend on the drives.
struct Setting<L, const N: usize, const P: usize> {
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
struct Equations<L, const N: usize> {
    links: LinkEquations<L, N>,
    share: PlaneShare<L>,
    lateral: L,
    roll: L,
    yaw: L,
    moment: [L; 2],
    spread: [L; 3],
    /// Force and torque of pushes on the trunk.
    push: Option<[f64; 6]>,
}

impl<S: Simd, const N: usize, const P: usize> Task for Evaluation<'_, S, N, P> {
    type Output = Slope<S::Lanes, N, P>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        if self.model.base == Base::Fixed {
            self.slope::<false>()
        } else {
            self.slope::<true>()
        }
    }
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize> Evaluation<'_, S, N, P> {
    /// Returns the slope: each kind of drive in a branch of its own, with its values in registers.
    #[inline(always)]
    fn slope<const FREE: bool>(&self) -> Slope<L, N, P> {
        let [hip, knee] = self.commands.at(self.time);
        match (&self.model.drives, self.limit) {
            (DriveLaws::None, _) => {
                let setting = self.setting::<FREE>(false);
                let zero = setting.internal.tension;
                let solution =
                    self.solve_free::<FREE>(&setting.equations, zero, 0.0, &setting.trunk);
                self.slope_of::<FREE>(&setting, &solution, zero)
            }
            (DriveLaws::Motors([at_hip, at_pulley]), _) => {
                let setting = self.setting::<FREE>(true);
                let [hip_damping, knee_damping] = self.commands.damping;
                let torque = hip - hip_damping * self.state.rates[0];
                let solution =
                    self.solve_free::<FREE>(&setting.equations, torque, *at_hip, &setting.trunk);
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
                let limited = Limited::beyond(torque, limit, ROUNDS);
                if limited.any() {
                    // Rare: from the begin, so that nothing is kept for it otherwise.
                    let limit = Some(limited);
                    return self.simd.call(Self { limit, ..*self });
                }
                let pulley = self.winding(knee, &setting);
                self.slope_of::<FREE>(&setting, &solution, pulley)
            }
            (DriveLaws::Servos { hip: law, .. }, Some(limit)) => {
                let setting = self.setting::<FREE>(true);
                let acceleration = law.acceleration(hip, self.state.angles[0], self.state.rates[0]);
                let solution = self.solve_limited::<FREE>(
                    &setting.equations,
                    acceleration,
                    &limit,
                    law.inertia(),
                    &setting.trunk,
                );
                let torque = solution.hip_torque + solution.links[0] * law.inertia();
                let most = law.limited(torque, self.state.rates[0]);
                let beyond = Limited::beyond(torque, most, 0);
                let next = limit.next(&beyond, acceleration - solution.links[0]);
                if let Some(limit) = next {
                    let limit = Some(limit);
                    return self.simd.call(Self { limit, ..*self });
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

    /// Returns everything but the drives.
    #[inline(always)]
    fn setting<const FREE: bool>(&self, has_cable: bool) -> Setting<L, N, P> {
        let (legs, state) = (self.legs, self.state);
        let trunk = TrunkMotion::new(state.trunk());
        let turns = Turns::new(&state.angles);
        let internal = Internal::new(&legs.pantographs, &turns, &state.joints(), has_cable);
        let entries = turns.inertia_and_swing(&legs.inertias);
        let mut equations = self.equations::<FREE>(&turns, &entries, &trunk);
        for j in 0..N {
            equations.links.torques[j] += internal.torques[j];
        }
        let (mut dissipated, mut compressed) = (internal.dissipated, internal.compressed);
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
    ) -> Slope<L, N, P> {
        let (simd, state, trunk) = (self.simd, self.state, &setting.trunk);
        let tension = setting.internal.tension;
        let knee = self.legs.pantographs.pulley_radius * tension;
        let zero = knee.zero();
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
            },
            flows: Flows {
                actuator: solution.hip_torque * state.rates[0] + knee * state.pulley_rate,
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
    ) -> Equations<L, N> {
        let (legs, rates) = (self.legs, &self.state.rates);
        let zero = rates[0].zero();
        if FREE {
            let carrier = Carrier {
                turning: broadcast(zero, trunk.turning),
                field: broadcast(zero, trunk.field),
            };
            let carried = Carried::new(legs, turns, rates, entries, &carrier);
            return Equations {
                links: LinkEquations {
                    inertia: *entries,
                    columns: carried.columns,
                    torques: carried.torques,
                },
                share: carried.share,
                lateral: carried.lateral,
                roll: carried.roll,
                yaw: carried.yaw,
                moment: carried.moment,
                spread: carried.spread,
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
            lateral: zero,
            roll: zero,
            yaw: zero,
            moment: [zero; 2],
            spread: [zero; 3],
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
        let point = end_of(legs, turns, state, links, trunk);
        let below = Below::new(self.simd, ground, trunk, &point);
        let foot = below.force(&legs.sole, point.velocity, state.bristles[p]);
        self.add_force::<FREE>(turns, links, &point, foot.force, equations);
        foot
    }

    /// Adds a force on the end of the first `links` links.
    #[inline(always)]
    fn add_force<const FREE: bool>(
        &self,
        turns: &Turns<L, N>,
        links: usize,
        point: &Point<L>,
        [fx, fy, fz]: [L; 3],
        equations: &mut Equations<L, N>,
    ) {
        for j in 0..links {
            let arm = turns.cosines[j] * fx + turns.sines[j] * fz;
            equations.links.torques[j] += self.legs.pantographs.links[j] * arm;
        }
        if FREE {
            let [x, _, z] = point.place;
            let force = &mut equations.share.force;
            force[0] += fx;
            force[1] += fz;
            force[2] += z * fx - x * fz;
            equations.lateral += fy;
            equations.roll -= z * fy;
            equations.yaw += x * fy;
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
        let foot = end_of(self.legs, turns, self.state, 3, trunk);
        self.add_force::<FREE>(turns, 3, &foot, pushed.feet, equations);
        equations.push = FREE.then_some(pushed.trunk);
        pushed.power(self.simd, foot.velocity, trunk)
    }
}

/// Accelerations of trunk and links, and torque of the hip drives on their links.
struct Solution<L, const N: usize> {
    trunk: [f64; 6],
    links: [L; N],
    hip_torque: L,
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize> Evaluation<'_, S, N, P> {
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
        let (trunk, coupled) = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<1, FREE>(&coupled, imposed);
        Solution {
            trunk,
            links,
            hip_torque: equations.links.first_torque::<FREE>(&links, &coupled),
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
        let (trunk, coupled) = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<0, FREE>(&coupled, links.torques);
        Solution {
            trunk,
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
        let (trunk, coupled) = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<0, FREE>(&coupled, links.torques);
        Solution {
            trunk,
            links,
            hip_torque: equations.links.first_torque::<FREE>(&links, &coupled),
        }
    }

    /// Returns the acceleration of the trunk, and that of the plane of each leg.
    #[inline(always)]
    fn trunk<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        share: &PlaneShare<L>,
        trunk: &TrunkMotion,
    ) -> ([f64; 6], [L; PLANE]) {
        let zero = equations.lateral.zero();
        if !FREE {
            return ([0.0; 6], [zero; PLANE]);
        }
        let hy = self.legs.hip[1];
        let [xx, zx, zz, px, pz, pp] = share.matrix;
        let [fx, fz, pitch] = share.force;
        let [sx, sz] = equations.moment;
        let [mxx, mzz, mxz] = equations.spread;
        // Forces forward and up act beside the centre of mass.
        let (hxx, hzx, hzz) = (hy * xx, hy * zx, hy * zz);
        let a = L::sums([xx, zx, zz, px]).quad().0;
        let b = L::sums([pz, pp, hxx, hzx]).quad().0;
        let c = L::sums([hzz, hy * px, hy * pz, hy * hxx + mxx]).quad().0;
        let d = L::sums([hy * hzz + mzz, hy * hzx + mxz, fx, fz]).quad().0;
        let roll = equations.roll + hy * fz;
        let yaw = equations.yaw - hy * fx;
        let e = L::sums([pitch, roll, yaw, equations.lateral]).quad().0;
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
        (accelerations, plane)
    }
}

//! Right-hand side of the equations of motion.

use twinrig_compliant::events::{ABDUCTION, GROUND, if_compressed};
use twinrig_compliant::frame::{into_world, quaternion_rate};
use twinrig_compliant::lanes::{Lanes, Quad, Simd, Task};
use twinrig_compliant::{
    BodyContact, DriveLaws, Flows, Internal, JointState, Limited, Resistance, TrunkMotion, Turns,
};
use twinrig_legged::Base;

use super::abduction::LegJoint;
use super::evaluation::{Evaluation, Limits};
use super::forces::Equations;
use super::solution::Solution;
use super::state::{Slope, State};

/// Everything that does not depend on the drives.
struct Setting<L: Lanes, const N: usize, const P: usize, const B: usize> {
    trunk: TrunkMotion,
    internal: Internal<L, N>,
    equations: Equations<L, N>,
    /// Power of pushes \[W\].
    external: L,
    dissipated: L,
    bristles: [[L; 2]; P],
    body: [BodyContact<L>; B],
    /// World frame \[N\].
    ground: [L; 3],
    /// Compressed elements.
    compressed: L,
}

/// Everything but the drives as a function of its own, where kinds of drives share it.
struct Preparation<
    'a,
    S: Simd,
    const N: usize,
    const P: usize,
    const A: usize,
    const B: usize,
    const FREE: bool,
> {
    evaluation: &'a Evaluation<'a, S, N, P, A, B>,
    has_cable: bool,
}

impl<S: Simd, const N: usize, const P: usize, const A: usize, const B: usize, const FREE: bool> Task
    for Preparation<'_, S, N, P, A, B, FREE>
{
    type Output = Setting<S::Lanes, N, P, B>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.evaluation.prepare::<FREE>(self.has_cable)
    }
}

/// Returns a vector in the first three lanes.
#[inline(always)]
fn four<S: Simd>(simd: S, [x, y, z]: [f64; 3]) -> S::Lanes {
    simd.load(Quad([x, y, z, 0.0]))
}

impl<S: Simd, const N: usize, const P: usize, const A: usize, const B: usize> Task
    for Evaluation<'_, S, N, P, A, B>
{
    type Output = Slope<S::Lanes, N, P, A, B>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        // Planes that abduct move with any base; contact of the body is rare on a fixed one.
        if A == 0 && B == 0 && self.model.base == Base::Fixed {
            self.slope::<false>()
        } else {
            self.slope::<true>()
        }
    }
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize, const A: usize, const B: usize>
    Evaluation<'_, S, N, P, A, B>
{
    /// Returns the slope: each kind of drive in a branch of its own, with its values in registers.
    #[inline(always)]
    fn slope<const FREE: bool>(&self) -> Slope<L, N, P, A, B> {
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
                let [hip_damping, knee_damping, _] = self.commands.damping;
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
    fn winding(&self, set_point: L, setting: &Setting<L, N, P, B>) -> L {
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
        let command = self.commands.abduction_at(self.time);
        let limited = self.limits.and_then(|limits| limits.abduction);
        let joint = LegJoint {
            frame: joints.frame(motion.angle, motion.rate, trunk),
            drive: joints.drive(&command, motion, resistance.torque, limited.as_ref()),
        };
        Some((joint, resistance))
    }

    /// Returns everything but the drives.
    #[inline(always)]
    fn setting<const FREE: bool>(&self, has_cable: bool) -> Setting<L, N, P, B> {
        if S::ARE_WIDE && B == 0 {
            return self.prepare::<FREE>(has_cable);
        }
        self.simd.call(Preparation::<_, N, P, A, B, FREE> {
            evaluation: self,
            has_cable,
        })
    }

    #[inline(always)]
    fn prepare<const FREE: bool>(&self, has_cable: bool) -> Setting<L, N, P, B> {
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
        let mut body = [BodyContact::all(zero); B];
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
            if B > 0 {
                let contact =
                    self.add_body_contact::<FREE>(terrain, &turns, &trunk, &mut equations);
                body = contact.rates;
                dissipated += contact.dissipated;
                compressed += contact.compressed;
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
            body,
            ground,
            compressed,
        }
    }

    #[inline(always)]
    fn slope_of<const FREE: bool>(
        &self,
        setting: &Setting<L, N, P, B>,
        solution: &Solution<L, N>,
        pulley_acceleration: L,
    ) -> Slope<L, N, P, A, B> {
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
                body: setting.body,
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
}

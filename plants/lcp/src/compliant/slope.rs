//! Right-hand side of the equations of motion.

use twinrig_compliant::ServoLaw;
use twinrig_compliant::lanes::{Lanes, Quad, Simd, Task};
use twinrig_legged::Base;

use super::carrier::{Carried, Carrier};
use super::chain::{Internal, Turns};
use super::contact::{Footforce, Point, TrunkMotion};
use super::elimination::{COUPLED, LinkEquations, TrunkShare};
use super::model::{Commands, CompliantModel, DriveLaws, Legs};
use super::state::{Flows, Slope, State};
use super::trunk::TrunkSums;
use crate::articulated::into_world;
use crate::motion::quaternion_rate;
use crate::trunk::cross;

/// Right-hand side in a state, to be called from several places.
pub(crate) struct Evaluation<'a, S: Simd, const N: usize, const P: usize> {
    pub(crate) simd: S,
    pub(crate) model: &'a CompliantModel<N>,
    pub(crate) legs: &'a Legs<S::Lanes, N>,
    pub(crate) commands: &'a Commands<S::Lanes>,
    pub(crate) time: f64,
    pub(crate) state: &'a State<S::Lanes, N, P>,
}

/// Action of the drives of the legs in one state.
struct DriveAction<L> {
    /// Acceleration of the hip, imposed by a servo; none with a torque \[rad/s²\].
    hip_acceleration: Option<L>,
    /// Torque \[N·m\] and inertia \[kg·m²\] of a hip without.
    hip_torque: L,
    hip_inertia: f64,
    /// Acceleration of the pulley under its load \[rad/s²\].
    pulley_acceleration: L,
}

/// Equations of legs and trunk in one state.
struct Equations<L, const N: usize> {
    links: LinkEquations<L, N>,
    share: TrunkShare<L>,
    lateral: L,
    moment: [L; 2],
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
    /// Returns the slope.
    #[inline(always)]
    fn slope<const FREE: bool>(&self) -> Slope<S::Lanes, N, P> {
        let simd = self.simd;
        let (legs, state) = (self.legs, self.state);
        let trunk = TrunkMotion::new(state);
        let turns = Turns::new(&state.angles);
        let has_cable = self.model.drives != DriveLaws::None;
        let internal = Internal::new(legs, &turns, state, has_cable);
        let entries = turns.inertia_and_swing(legs);
        let mut equations = self.equations::<FREE>(&turns, &entries, &trunk);
        for (torque, inner) in equations.links.torques.iter_mut().zip(internal.torques) {
            *torque += inner;
        }
        let mut dissipated = internal.dissipated;
        let mut bristles = state.bristles;
        let mut ground = [dissipated.zero(); 3];
        if self.model.ground.is_some() {
            for (p, bristle) in bristles.iter_mut().enumerate() {
                let foot = self.stand::<FREE>(&turns, &trunk, p, &mut equations);
                *bristle = foot.bristle_rate;
                dissipated += foot.dissipated;
                for (sum, part) in ground.iter_mut().zip(foot.force) {
                    *sum += part;
                }
            }
        }
        let drive = self.drive(internal.tension);
        let Solution {
            trunk: accelerations,
            links,
            hip_torque,
        } = self.solve::<FREE>(&equations, &drive, &trunk);
        let knee = legs.pulley_radius * internal.tension;
        let four = |x: [f64; 3]| simd.load(Quad([x[0], x[1], x[2], 0.0]));
        let zero = dissipated.zero();
        let [position, attitude, velocity, turning] = if FREE {
            let [vx, vy, vz, wx, wy, wz] = accelerations;
            let attitude = quaternion_rate(state.attitude.quad().0, trunk.turning);
            [
                four(into_world(&trunk.rotation, trunk.velocity)),
                simd.load(Quad(attitude)),
                four([vx, vy, vz]),
                four([wx, wy, wz]),
            ]
        } else {
            [zero; 4]
        };
        let world = |row: [f64; 3]| ground[0] * row[0] + ground[1] * row[1] + ground[2] * row[2];
        Slope {
            state: State {
                position,
                attitude,
                velocity,
                turning,
                angles: state.rates,
                rates: links,
                pulley: if has_cable { state.pulley_rate } else { zero },
                pulley_rate: drive.pulley_acceleration,
                bristles,
            },
            flows: Flows {
                actuator: hip_torque * state.rates[0] + knee * state.pulley_rate,
                dissipated,
                hip: hip_torque,
                knee,
                cable: internal.tension,
                ground: trunk.rotation.map(world),
            },
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
                turning: trunk.turning.map(|x| zero.like(x)),
                field: trunk.field.map(|x| zero.like(x)),
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
                moment: carried.moment,
            };
        }
        let mut torques = *rates;
        for j in 0..N {
            let weight =
                turns.cosines[j] * trunk.field[0] + turns.sines[j] * trunk.field[2];
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
                columns: [[zero; COUPLED]; N],
                torques,
            },
            share: TrunkShare {
                matrix: [zero; 15],
                force: [zero; COUPLED],
            },
            lateral: zero,
            moment: [zero; 2],
        }
    }

    /// Adds the force of the ground on contact point `p`.
    #[inline(always)]
    fn stand<const FREE: bool>(
        &self,
        turns: &Turns<L, N>,
        trunk: &TrunkMotion,
        p: usize,
        equations: &mut Equations<L, N>,
    ) -> Footforce<L> {
        let (legs, state) = (self.legs, self.state);
        let links = N - P + 1 + p;
        let point = Point::new(legs, turns, state, links, trunk);
        let below = self.model.below(self.simd, trunk, &point);
        let foot = below.force(&legs.sole, point.velocity, state.bristles[p]);
        let [fx, fy, fz] = foot.force;
        for j in 0..links {
            let arm = turns.cosines[j] * fx + turns.sines[j] * fz;
            equations.links.torques[j] += legs.links[j] * arm;
        }
        if FREE {
            let force = &mut equations.share.force;
            force[0] += fx;
            force[1] += fz;
            let [x, y, z] = point.place;
            force[2] += y * fz - z * fy;
            force[3] += z * fx - x * fz;
            force[4] += x * fy - y * fx;
            equations.lateral += fy;
        }
        foot
    }

    #[inline(always)]
    fn drive(&self, tension: L) -> DriveAction<L> {
        let (state, load) = (self.state, self.legs.pulley_radius * tension);
        let zero = load.zero();
        let [hip, knee] = self.commands.at(self.time);
        match &self.model.drives {
            DriveLaws::None => DriveAction {
                hip_acceleration: None,
                hip_torque: zero,
                hip_inertia: 0.0,
                pulley_acceleration: zero,
            },
            DriveLaws::Servos {
                hip: hip_law,
                knee: knee_law,
            } => {
                let winding = knee_law.acceleration(knee, state.pulley, state.pulley_rate);
                let torque = winding * knee_law.inertia() + load;
                let torque = knee_law.limited(torque, state.pulley_rate);
                let [angle, rate] = [state.angles[0], state.rates[0]];
                DriveAction {
                    hip_acceleration: Some(hip_law.acceleration(hip, angle, rate)),
                    hip_torque: zero,
                    hip_inertia: hip_law.inertia(),
                    pulley_acceleration: (torque - load) * (1.0 / knee_law.inertia()),
                }
            }
            DriveLaws::Motors(inertias) => {
                let [hip_damping, knee_damping] = self.commands.damping;
                let torque = knee - knee_damping * state.pulley_rate;
                DriveAction {
                    hip_acceleration: None,
                    hip_torque: hip - hip_damping * state.rates[0],
                    hip_inertia: inertias[0],
                    pulley_acceleration: (torque - load) * (1.0 / inertias[1]),
                }
            }
        }
    }
}

/// Accelerations of trunk and links, and torque of the hip drives on their links.
struct Solution<L, const N: usize> {
    trunk: [f64; 6],
    links: [L; N],
    hip_torque: L,
}

impl<S: Simd<Lanes = L>, L: Lanes, const N: usize, const P: usize> Evaluation<'_, S, N, P> {
    #[inline(always)]
    fn solve<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        drive: &DriveAction<L>,
        trunk: &TrunkMotion,
    ) -> Solution<L, N> {
        match (drive.hip_acceleration, &self.model.drives) {
            (Some(acceleration), DriveLaws::Servos { hip, .. }) => {
                let imposed = self.solve_imposed::<FREE>(equations, acceleration, trunk);
                if hip.is_limited() {
                    let rate = self.state.rates[0];
                    let torque = imposed.hip_torque + acceleration * hip.inertia();
                    let limited = hip.limited(torque, rate);
                    let saturated = (torque - limited).abs().gt(torque.zero());
                    if L::any(saturated) {
                        return self.solve_saturated::<FREE>(
                            equations,
                            hip,
                            acceleration,
                            limited,
                            saturated,
                            trunk,
                        );
                    }
                }
                imposed
            }
            _ => self.solve_free::<FREE>(equations, drive.hip_torque, drive.hip_inertia, trunk),
        }
    }

    /// Solves with the acceleration of the hips imposed.
    #[inline(always)]
    fn solve_imposed<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        acceleration: L,
        trunk: &TrunkMotion,
    ) -> Solution<L, N> {
        let mut links = equations.links;
        let mut share = equations.share;
        links.impose::<FREE>(acceleration, &mut share);
        let eliminated = links.eliminate::<1, FREE>(&mut share);
        let mut imposed = equations.links.torques;
        imposed[0] = acceleration;
        let (trunk, coupled) = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<1, FREE>(&coupled, imposed);
        let row = &equations.links;
        let mut hip_torque = row.inertia[0][0] * acceleration - row.torques[0];
        for j in 1..N {
            hip_torque += row.inertia[j][0] * links[j];
        }
        if FREE {
            for a in 0..COUPLED {
                hip_torque += row.columns[0][a] * coupled[a];
            }
        }
        Solution {
            trunk,
            links,
            hip_torque,
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

    /// Solves with the hips of `saturated` lanes under the limit of their torque, the others with
    /// imposed acceleration: their first row becomes θ̈ = α.
    #[inline(always)]
    fn solve_saturated<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        servo: &ServoLaw,
        acceleration: L,
        limit: L,
        saturated: L::Mask,
        trunk: &TrunkMotion,
    ) -> Solution<L, N> {
        let (mut links, mut share) = (equations.links, equations.share);
        let zero = limit.zero();
        let follows = acceleration.or(saturated, zero);
        let imposed = acceleration - follows;
        links.impose::<FREE>(imposed, &mut share);
        let one = zero.like(1.0);
        links.inertia[0][0] = (links.inertia[0][0] + servo.inertia()).or(saturated, one);
        for j in 1..N {
            links.inertia[j][0] = links.inertia[j][0].or(saturated, zero);
        }
        for column in &mut links.columns[0] {
            *column = column.or(saturated, zero);
        }
        links.torques[0] = (links.torques[0] + limit).or(saturated, imposed);
        let eliminated = links.eliminate::<0, FREE>(&mut share);
        let (trunk, coupled) = self.trunk::<FREE>(equations, &share, trunk);
        let links = eliminated.accelerations::<0, FREE>(&coupled, links.torques);
        let row = &equations.links;
        let mut hip_torque = row.inertia[0][0] * links[0] - row.torques[0];
        for j in 1..N {
            hip_torque += row.inertia[j][0] * links[j];
        }
        if FREE {
            for a in 0..COUPLED {
                hip_torque += row.columns[0][a] * coupled[a];
            }
        }
        Solution {
            trunk,
            links,
            hip_torque,
        }
    }

    /// Returns the acceleration of the trunk, and that of the coupled rows in all lanes.
    #[inline(always)]
    fn trunk<const FREE: bool>(
        &self,
        equations: &Equations<L, N>,
        share: &TrunkShare<L>,
        trunk: &TrunkMotion,
    ) -> ([f64; 6], [L; COUPLED]) {
        let zero = equations.lateral.zero();
        if !FREE {
            return ([0.0; 6], [zero; COUPLED]);
        }
        let m = share.matrix;
        let [fx, fz, roll, pitch, yaw] = share.force;
        let [sx, sz] = equations.moment;
        let sums = [
            L::sums([m[0], m[1], m[2], m[3]]).quad().0,
            L::sums([m[4], m[5], m[6], m[7]]).quad().0,
            L::sums([m[8], m[9], m[10], m[11]]).quad().0,
            L::sums([m[12], m[13], m[14], fx]).quad().0,
            L::sums([fz, roll, pitch, yaw]).quad().0,
            L::sums([equations.lateral, sx, sz, self.legs.mass_hip[1]]).quad().0,
        ];
        let [a, b, c, d, e, f] = sums;
        let [inertia_x, inertia_y, inertia_z] = self.model.inertia;
        let (moment, mass) = ([f[1], f[3], f[2]], self.model.mass);
        let weight = cross(moment, trunk.field);
        let [wx, wy, wz] = trunk.turning;
        let gyro = cross(
            trunk.turning,
            [inertia_x * wx, inertia_y * wy, inertia_z * wz],
        );
        let force = [d[3], f[0], e[0], e[1], e[2], e[3]];
        let system = TrunkSums {
            matrix: [
                a[0],
                a[1],
                a[2],
                a[3],
                b[0],
                b[1] + inertia_x,
                b[2],
                b[3],
                c[0],
                c[1] + inertia_y,
                c[2],
                c[3],
                d[0],
                d[1],
                d[2] + inertia_z,
            ],
            moment: [f[1], f[2]],
            force: std::array::from_fn(|i| {
                if i < 3 {
                    force[i] + mass * trunk.field[i]
                } else {
                    force[i] + weight[i - 3] - gyro[i - 3]
                }
            }),
        };
        let accelerations = system.solve(self.model.base, mass);
        let [x, _, z, roll, pitch, yaw] = accelerations;
        let coupled = [x, z, roll, pitch, yaw].map(|a| zero.like(a));
        (accelerations, coupled)
    }
}

//! Right-hand side of the equations of motion.
//!
//! With the directions nⱼ = (cos θⱼ, sin θⱼ) in which the links move their ends, the velocity of
//! the foot relative to the trunk determines the rates of the second and the third link, and the
//! torques τⱼ of springs, stops, cable and joint friction on them determine the force f of the leg
//! on its foot:
//!
//! ```text
//! Σ lⱼ nⱼ θ̇ⱼ = u − v − ω × r      lⱼ nⱼ·f = τⱼ   (j = 2, 3)
//! ```
//!
//! The drive of the hip bears l₁ n₁·f − τ₁; the trunk bears −f, at the foot. Sideways the foot
//! moves with the trunk. Where legs abduct, the frames that carry them take the place of the trunk.

use twinrig_compliant::events::{ABDUCTION, GROUND, OWN, if_compressed};
use twinrig_compliant::frame::{cross, into_world, quaternion_rate};
use twinrig_compliant::lanes::{Lanes, Quad, Simd, Task};
use twinrig_compliant::stop::{LEAST, barrier};
use twinrig_compliant::{
    Below, Commands, DriveLaws, Flows, Footforce, Internal, JointMotion, JointState, Joints,
    LegBody, LegFrame, Limited, Point, Pushed, TrunkForce, TrunkMotion, Turns, broadcast,
};
use twinrig_legged::{Base, StepLoad};
use twinrig_robot::GRAVITY;

use super::body::{Corners, slope_under};
use super::model::{CompliantModel, Legs};
use super::state::{Slope, State};
use super::trunk::{TrunkConstants, TrunkSums};

/// Motion of legs and feet in one state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LegMotion<L> {
    /// The foot, trunk axes.
    pub(crate) point: Point<L>,
    /// Place and velocity of the foot in leg axes.
    place: [L; 3],
    velocity: [L; 3],
    /// Velocity relative to the carrier, forward and up \[m/s\].
    pub(crate) relative: [L; 2],
    /// Rates of the links \[rad/s\].
    pub(crate) rates: [L; 3],
    /// 1/sin(θ₃ − θ₂).
    per_sine: L,
}

impl<L: Lanes> LegMotion<L> {
    #[inline(always)]
    pub(crate) fn new<const A: usize, const B: usize>(
        legs: &Legs<L, A>,
        turns: &Turns<L, 3>,
        state: &State<L, A, B>,
        trunk: &TrunkMotion,
        frame: Option<&LegFrame<L>>,
    ) -> Self {
        let ([s1, s2, s3], [c1, c2, c3]) = (turns.sines, turns.cosines);
        let ([l1, l2, l3], [hx, hy, hz]) = (legs.pantographs.links, legs.hip);
        let (ahead, up) = (l1 * c1, l1 * s1);
        let x = hx + up + l2 * s2 + l3 * s3;
        let z = hz - ahead - l2 * c2 - l3 * c3;
        let ([ux, uz], place) = (state.foot, [x, hy, z]);
        let (relative, velocity) = match frame {
            None => {
                let ([wx, wy, wz], v) = (trunk.turning, trunk.velocity);
                let relative = [
                    ux - (z * wy - hy * wz + v[0]),
                    uz - (hy * wx - x * wy + v[2]),
                ];
                (relative, [ux, x * wz - z * wx + v[1], uz])
            }
            Some(frame) => {
                let [vx, vy, vz] = frame.carried(place);
                ([ux - vx, uz - vz], [ux, vy, uz])
            }
        };
        let point = match frame {
            None => Point { place, velocity },
            Some(frame) => frame.point_at(place, velocity),
        };
        let ahead = relative[0] - ahead * state.hip_rate;
        let up = relative[1] - up * state.hip_rate;
        let per_sine = turns.sine_of_ankle().reciprocal();
        Self {
            point,
            place,
            velocity,
            relative,
            rates: [
                state.hip_rate,
                (ahead * s3 - up * c3) * per_sine * legs.per_links[0],
                (up * c2 - ahead * s2) * per_sine * legs.per_links[1],
            ],
            per_sine,
        }
    }
}

impl<L: Lanes> LegMotion<L> {
    /// Returns the acceleration of the foot in leg axes without forces on it, and without that of
    /// the carrier: forward; sideways with the other sign, which the carrier imposes; and up.
    #[inline(always)]
    fn drift(&self, trunk: &TrunkMotion, frame: Option<&LegFrame<L>>) -> [L; 3] {
        let ([ux, uy, uz], [ahead, rise]) = (self.velocity, self.relative);
        let up = trunk.rotation[2];
        let gravity = [-GRAVITY * up[0], -GRAVITY * up[1], -GRAVITY * up[2]];
        match frame {
            None => {
                let ([wx, wy, wz], [gx, gy, gz]) = (trunk.turning, gravity);
                [
                    uy * wz - uz * wy + gx,
                    (ahead + ux) * wz - (rise + uz) * wx - gy,
                    ux * wy - uy * wx + gz,
                ]
            }
            Some(frame) => {
                let [wx, wy, wz] = frame.turning;
                let [gx, _, gz] = frame.into_leg(broadcast(ux.zero(), gravity));
                let [vx, _, vz] = frame.velocity;
                // The field has the acceleration of the axis, of which V̇ is a part.
                let along = frame.field[1] + (wz * vx - wx * vz);
                [
                    uy * wz - uz * wy + gx,
                    (ahead + ux) * wz - (rise + uz) * wx - along,
                    ux * wy - uy * wx + gz,
                ]
            }
        }
    }
}

/// Index of the element between second and third link.
pub(crate) const ANKLE: usize = OWN;

/// Returns the depth of the stop that keeps second and third link from one line, where the foot
/// does not determine their rates \[m\].
#[inline(always)]
pub(crate) fn in_line<L: Lanes, const A: usize>(legs: &Legs<L, A>, turns: &Turns<L, 3>) -> L {
    let [depth, _] = barrier(turns.sine_of_ankle());
    legs.pantographs.links[2] * depth
}

impl<L: Lanes> LegMotion<L> {
    /// Returns the lever of the stop between second and third link \[m\].
    #[inline(always)]
    fn lever<const A: usize>(legs: &Legs<L, A>, turns: &Turns<L, 3>) -> L {
        let [_, slope] = barrier(turns.sine_of_ankle());
        -(legs.pantographs.links[2] * turns.cosine_of_ankle() * slope)
    }

    /// Returns the rate of the depth of that stop \[m/s\].
    #[inline(always)]
    pub(crate) fn folding<const A: usize>(&self, legs: &Legs<L, A>, turns: &Turns<L, 3>) -> L {
        Self::lever(legs, turns) * (self.rates[1] - self.rates[2])
    }
}

/// Returns the force and the torque of pushes and of the ground on the trunk, if there are any.
#[inline(always)]
fn sum_on_trunk<L>(
    pushed: Option<&Pushed<L>>,
    on_corners: Option<&TrunkForce<L>>,
) -> Option<[f64; 6]> {
    let mut sum = pushed.map(|pushed| pushed.trunk);
    if let Some(force) = on_corners {
        let sum = sum.get_or_insert([0.0; 6]);
        for (sum, part) in sum.iter_mut().zip(force.wrench) {
            *sum += part;
        }
    }
    sum
}

/// Right-hand side in a state, to be called from several places.
pub(crate) struct Evaluation<'a, S: Simd, const A: usize, const B: usize> {
    pub(crate) simd: S,
    pub(crate) model: &'a CompliantModel<A>,
    pub(crate) legs: &'a Legs<S::Lanes, A>,
    pub(crate) commands: &'a Commands<S::Lanes>,
    pub(crate) time: f64,
    /// Load of pushes, if any.
    pub(crate) load: Option<&'a StepLoad>,
    pub(crate) state: &'a State<S::Lanes, A, B>,
    /// Joints of abduction at the limit of their torque, once they are known, and the number of
    /// times that they may be determined again.
    pub(crate) limited: Option<(Limited<S::Lanes>, u8)>,
}

/// Forces of the legs.
struct LegForces<L> {
    /// Force on the foot, forward and up \[N\].
    foot: [L; 2],
    /// Torque of the first link on the drive of the hip, and tension of the cable.
    hip: L,
    tension: L,
    dissipated: L,
    compressed: L,
}

impl<S: Simd, const A: usize, const B: usize> Task for Evaluation<'_, S, A, B> {
    type Output = Slope<S::Lanes, A, B>;

    #[inline(always)]
    fn run(self) -> Self::Output {
        // Planes that abduct move with any base; contact of the body is rare on a fixed one.
        if A == 0 && B == 0 && self.model.rigid.base == Base::Fixed {
            self.slope::<false>()
        } else {
            self.slope::<true>()
        }
    }
}

impl<S: Simd<Lanes = L>, L: Lanes, const A: usize, const B: usize> Evaluation<'_, S, A, B> {
    #[inline(always)]
    fn slope<const FREE: bool>(&self) -> Slope<L, A, B> {
        let (simd, legs, state) = (self.simd, self.legs, self.state);
        let trunk = TrunkMotion::new(state.trunk());
        let turns = Turns::new(&state.angles);
        let frame = legs.frame(state, &trunk);
        let motion = LegMotion::new(legs, &turns, state, &trunk, frame.as_ref());
        let forces = self.leg_forces(&turns, &motion);
        let ground = self.ground(&trunk, &motion.point);
        let pushed = self.pushed(&trunk);
        let corners = Corners::new(simd, self.model, state);
        let on_corners = corners.map(|corners| corners.force(simd, &trunk));
        let on_trunk = sum_on_trunk(pushed.as_ref(), on_corners.as_ref());
        let [drift_x, drift_y, drift_z] = motion.drift(&trunk, frame.as_ref());
        let [fx, fz] = forces.foot;
        let [mut outer_x, mut outer_y, mut outer_z] = ground.force;
        let mut external = fx.zero();
        if let Some(pushed) = &pushed {
            let [x, y, z] = pushed.feet;
            (outer_x, outer_y, outer_z) = (outer_x + x, outer_y + y, outer_z + z);
            external = pushed.power(simd, motion.point.velocity, &trunk);
        }
        if let Some(frame) = &frame {
            [outer_x, outer_y, outer_z] = frame.into_leg([outer_x, outer_y, outer_z]);
        }
        let foot = [
            (fx + outer_x + legs.mass * drift_x) * legs.per_mass,
            (fz + outer_z + legs.mass * drift_z) * legs.per_mass,
        ];
        let zero = fx.zero();
        let mut rates = [zero; 4];
        let mut joint = None;
        if FREE {
            // Sideways force on the foot with an unaccelerated carrier.
            let sideways = legs.mass * drift_y - outer_y;
            let force = [fx, sideways, fz];
            let accelerations = match &frame {
                None => self.trunk(&trunk, &motion.place, force, on_trunk),
                Some(frame) => {
                    let (accelerations, of_joint) =
                        self.abducted(&trunk, &motion.place, force, on_trunk, frame);
                    joint = of_joint;
                    accelerations
                }
            };
            if let Some(limited) = self.limited_next(joint.as_ref()) {
                let limited = Some(limited);
                return self.simd.call(Self { limited, ..*self });
            }
            rates = self.trunk_rates(&trunk, accelerations);
        }
        let [position, attitude, velocity, turning] = rates;
        let knee = legs.pantographs.pulley_radius * forces.tension;
        let [hip_rate, pulley_rate] = self.drives(forces.hip, knee);
        let mut actuator = forces.hip * state.hip_rate + knee * state.pulley_rate;
        let mut dissipated = forces.dissipated + ground.dissipated;
        let mut compressed = forces.compressed + if_compressed(GROUND, ground.depth);
        let mut abduction = state.abduction;
        if let Some(force) = &on_corners {
            dissipated += force.dissipated;
            compressed += force.compressed;
        }
        if let (Some(joint), Some(slope)) = (&joint, abduction.first_mut()) {
            if let Some(joints) = legs.joints.first() {
                let resistance = joints.resistance(slope.angle, slope.rate);
                dissipated += resistance.dissipated;
                compressed += if_compressed(ABDUCTION, resistance.depth);
            }
            actuator += joint.torque * slope.rate;
            *slope = JointState {
                angle: slope.rate,
                rate: joint.acceleration,
                impulse: joint.torque,
            };
        }
        Slope {
            state: State {
                position,
                attitude,
                velocity,
                turning,
                angles: motion.rates,
                hip_rate,
                pulley: state.pulley_rate,
                pulley_rate,
                foot,
                bristle: ground.bristle_rate,
                abduction,
                body: slope_under(simd, on_corners.as_ref()),
            },
            flows: Flows {
                actuator,
                external,
                dissipated,
                hip: forces.hip,
                knee,
                cable: forces.tension,
                ground: ground.force_in_world,
            },
            compressed,
        }
    }

    /// Returns the forces of springs, stops, cable and joint friction.
    #[inline(always)]
    fn leg_forces(&self, turns: &Turns<L, 3>, motion: &LegMotion<L>) -> LegForces<L> {
        let (legs, state) = (self.legs, self.state);
        let joints = Joints {
            angles: &state.angles,
            rates: &motion.rates,
            pulley: state.pulley,
            pulley_rate: state.pulley_rate,
        };
        let internal = Internal::new(&legs.pantographs, turns, &joints, true);
        // The stop between second and third link.
        let [_, mut second, mut third] = internal.torques;
        let (sine, mut dissipated) = (turns.sine_of_ankle(), internal.dissipated);
        let mut compressed = internal.compressed;
        // Rare: only where it is pressed.
        if sine.any(sine.like(LEAST).gt(sine)) {
            let depth = in_line(legs, turns);
            let lever = LegMotion::lever(legs, turns);
            let stop = legs
                .pantographs
                .stops
                .press(depth, motion.folding(legs, turns));
            compressed += if_compressed(ANKLE, depth);
            second -= stop.force * lever;
            third += stop.force * lever;
            dissipated += stop.dissipated;
        }
        let (second, third) = (second * legs.per_links[0], third * legs.per_links[1]);
        let ([s1, s2, s3], [c1, c2, c3]) = (turns.sines, turns.cosines);
        let x = (second * s3 - third * s2) * motion.per_sine;
        let z = (third * c2 - second * c3) * motion.per_sine;
        LegForces {
            foot: [x, z],
            hip: legs.pantographs.links[0] * (c1 * x + s1 * z) - internal.torques[0],
            tension: internal.tension,
            dissipated,
            compressed,
        }
    }

    /// Returns the force of the ground.
    #[inline(always)]
    fn ground(&self, trunk: &TrunkMotion, point: &Point<L>) -> Footforce<L> {
        let Some(ground) = &self.model.rigid.ground else {
            let zero = point.place[0].zero();
            return Footforce {
                force: [zero; 3],
                force_in_world: [zero; 3],
                bristle_rate: [zero; 2],
                dissipated: zero,
                depth: zero,
            };
        };
        let below = Below::new(self.simd, ground, trunk, point);
        below.force(&self.legs.sole, point.velocity, self.state.bristle)
    }

    /// Returns the accelerations of hip and pulley under their loads, which no other inertia bears.
    #[inline(always)]
    fn drives(&self, hip_load: L, pulley_load: L) -> [L; 2] {
        let ([hip, pulley], state) = (self.commands.at(self.time), self.state);
        match &self.model.drives {
            // Not built: a leg without mass and drive has no inertia about its hip.
            DriveLaws::None => [hip_load.zero(); 2],
            DriveLaws::Servos { hip: at_hip, knee } => {
                let first = at_hip.acceleration(hip, state.angles[0], state.hip_rate);
                let second = knee.acceleration(pulley, state.pulley, state.pulley_rate);
                [
                    at_hip.acceleration_under(hip_load, first, state.hip_rate),
                    knee.acceleration_under(pulley_load, second, state.pulley_rate),
                ]
            }
            DriveLaws::Motors([at_hip, at_pulley]) => {
                let [hip_damping, pulley_damping, _] = self.commands.damping;
                [
                    (hip - hip_damping * state.hip_rate - hip_load) * (1.0 / at_hip),
                    (pulley - pulley_damping * state.pulley_rate - pulley_load) * (1.0 / at_pulley),
                ]
            }
        }
    }

    /// Returns the same, and the motion of the joints, with legs that abduct.
    #[inline(always)]
    fn abducted(
        &self,
        trunk: &TrunkMotion,
        &[x, y, z]: &[L; 3],
        [fx, fy, fz]: [L; 3],
        on_trunk: Option<[f64; 6]>,
        frame: &LegFrame<L>,
    ) -> ([f64; 6], Option<JointMotion<L>>) {
        let (model, mass, zero) = (self.model, self.legs.mass, fx.zero());
        let (Some(joints), Some(state)) = (self.legs.joints.first(), self.state.abduction.first())
        else {
            return ([0.0; 6], None);
        };
        let (mx, mz) = (mass * x, mass * z);
        // Sideways the mass of the foot moves with its frame.
        let body = LegBody {
            linear: [zero, zero, mass, zero, zero, zero],
            coupling: [[zero; 3], [-mz, zero, mx], [zero; 3]],
            angular: [mz * z, zero, zero, -(mx * z), zero, mx * x],
            force: [-fx, -fy, -fz],
            torque: [z * fy - y * fz, x * fz - z * fx, y * fx - x * fy],
        };
        let mut body = body.swung(frame.swing);
        let drive = joints.drive(
            &self.commands.abduction_at(self.time),
            state,
            joints.resistance(state.angle, state.rate).torque,
            self.limited.as_ref().map(|(limited, _)| limited),
        );
        let row = body.eliminate(&drive);
        let mut system = body.into_trunk(frame);
        let of_trunk = (model.trunk.mass, [0.0; 3], model.trunk.tensor());
        system.add_trunk(of_trunk, trunk.field, trunk.turning);
        if let Some(wrench) = on_trunk {
            system.push(wrench);
        }
        let accelerations = system.solve(model.rigid.base);
        let motion = row.motion(&drive, frame.acceleration(accelerations));
        (accelerations, Some(motion))
    }

    /// Returns the joints at the limit of their torque in the next round, if they differ from those
    /// assumed.
    #[inline(always)]
    fn limited_next(&self, motion: Option<&JointMotion<L>>) -> Option<(Limited<L>, u8)> {
        let (joints, state) = (self.legs.joints.first()?, self.state.abduction.first()?);
        let Some((limited, rounds)) = &self.limited else {
            let limited = joints.beyond(motion?, state).filter(Limited::any)?;
            return Some((limited, Limited::<L>::ROUNDS));
        };
        let command = self.commands.abduction_at(self.time);
        let (next, differs) = joints.next(limited, motion?, &command, state)?;
        Some((next, rounds.checked_sub(1).filter(|_| differs)?))
    }

    /// Returns the rates of position, attitude, velocity and angular velocity of the trunk.
    #[inline(always)]
    fn trunk_rates(&self, trunk: &TrunkMotion, accelerations: [f64; 6]) -> [L; 4] {
        let (simd, attitude) = (self.simd, self.state.attitude.quad().0);
        let [vx, vy, vz, roll, pitch, yaw] = accelerations;
        [
            simd.load(Quad::of_three(into_world(&trunk.rotation, trunk.velocity))),
            simd.load(Quad(quaternion_rate(attitude, trunk.turning))),
            simd.load(Quad([vx, vy, vz, 0.0])),
            simd.load(Quad([roll, pitch, yaw, 0.0])),
        ]
    }

    /// Returns the forces of pushes.
    #[inline(always)]
    fn pushed(&self, trunk: &TrunkMotion) -> Option<Pushed<L>> {
        let centre = self.model.rigid.centre.into();
        let load = (self.load?, self.time);
        Some(Pushed::new(self.simd, load, &trunk.rotation, centre))
    }

    /// Returns the acceleration of the trunk under the reaction of forces on the feet, and under
    /// pushes.
    #[inline(always)]
    fn trunk(
        &self,
        trunk: &TrunkMotion,
        &[x, y, z]: &[L; 3],
        [fx, fy, fz]: [L; 3],
        on_trunk: Option<[f64; 6]>,
    ) -> [f64; 6] {
        let model = self.model;
        let (mx, mz) = (self.legs.mass * x, self.legs.mass * z);
        let [ahead, up, pitch, roll] = L::sums([fx, fz, z * fx - x * fz, y * fz - z * fy]).quad().0;
        let [yaw, left, mx_sum, mz_sum] = L::sums([x * fy - y * fx, fy, mx, mz]).quad().0;
        let [xx, xz, zz, _] = L::sums([mx * x, mx * z, mz * z, fx.zero()]).quad().0;
        let (TrunkConstants { mass, .. }, field) = (model.trunk, trunk.field);
        let gyro = cross(trunk.turning, model.trunk.spin(trunk.turning));
        let mut sums = TrunkSums {
            moment: [mx_sum, mz_sum],
            spread: [xx, xz, zz],
            force: [
                mass * field[0] - ahead,
                mass * field[1] - left,
                mass * field[2] - up,
                -gyro[0] - roll,
                -gyro[1] - pitch,
                -gyro[2] - yaw,
            ],
        };
        if let Some(wrench) = on_trunk {
            for (force, part) in sums.force.iter_mut().zip(wrench) {
                *force += part;
            }
        }
        sums.solve(model.rigid.base, &model.trunk)
    }
}

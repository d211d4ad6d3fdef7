//! Dynamics of a servo and its load under a constant duty cycle.

use libm::{exp, sin};
use serde::{Deserialize, Serialize};

use crate::error::ServoBenchError;
use crate::friction::{Friction, GearLoss};
use crate::parameters::ServoBenchParameters;

/// Standard gravity \[m/s²\].
const GRAVITY: f64 = 9.80665;
/// Temperature coefficient of the resistance of copper at 20 °C \[1/K\].
const COPPER: f64 = 3.93e-3;
/// Length of a substep over the shortest time constant: the midpoint rule then is far from its
/// limit of stability, 2.
const RESOLUTION: f64 = 0.2;
/// Substeps of a period of the controller beyond which a servo is too stiff.
const SUBSTEPS_MAX: f64 = 1000.0;

/// State of the shaft.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    /// Angle of the shaft \[rad\].
    pub angle: f64,
    /// Its rate; exactly zero at rest \[rad/s\].
    pub rate: f64,
    /// Rise of the temperature of the winding \[K\].
    pub rise: f64,
}

/// Command of the bridge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Bridge {
    /// Open: the motor has no current.
    Open,
    /// Duty cycle, −1 to 1.
    Duty(f64),
}

/// Works of a step \[J\].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Works {
    pub motor: f64,
    pub friction: f64,
}

/// Counts of a step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    pub steps: u64,
    pub events: u64,
}

/// Electrical state at an instant.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Electric {
    /// Voltage of the supply behind its resistance \[V\].
    pub voltage: f64,
    /// Current of the motor \[A\].
    pub current: f64,
    /// Torque of the motor \[N·m\].
    pub torque: f64,
}

/// Forces on the shaft at an instant.
struct Forces {
    acceleration: f64,
    current: f64,
    motor: f64,
    friction: f64,
}

#[derive(Clone, Debug)]
pub(crate) struct Model {
    voltage: f64,
    supply_resistance: f64,
    resistance: f64,
    constant: f64,
    current_limit: f64,
    /// Infinite without diodes.
    diode_voltage: f64,
    /// 1/C; zero without heating.
    heat_per_joule: f64,
    /// 1/T; zero without cooling.
    cooling: f64,
    motor_inertia: f64,
    load_inertia: f64,
    /// Torque of gravity on a horizontal arm \[N·m\].
    weight: f64,
    offset: f64,
    friction: Friction,
    gear: GearLoss,
    is_lossy: bool,
    /// Substeps of a period.
    substeps: u32,
}

impl Model {
    pub(crate) fn new(parameters: &ServoBenchParameters) -> Result<Self, ServoBenchError> {
        let (load, motor) = (&parameters.load, &parameters.motor);
        let load_inertia = (load.mass + load.arm_mass / 3.0) * load.length * load.length;
        let moment = (load.mass + 0.5 * load.arm_mass) * load.length;
        let constant = motor.torque_constant;
        let damping = constant * constant / motor.resistance + parameters.friction.viscous;
        let time_constant_s = (motor.inertia + load_inertia) / damping;
        let period_s = parameters.controller.period;
        let substeps = (period_s / (RESOLUTION * time_constant_s)).ceil().max(1.0);
        if substeps > SUBSTEPS_MAX {
            return Err(ServoBenchError::Stiff {
                time_constant_s,
                period_s,
            });
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 1 and SUBSTEPS_MAX"
        )]
        let substeps = substeps as u32;
        Ok(Self {
            voltage: parameters.supply.voltage,
            supply_resistance: parameters.supply.resistance,
            resistance: motor.resistance,
            constant,
            current_limit: motor.current_limit.unwrap_or(f64::INFINITY),
            diode_voltage: motor.diode_voltage.unwrap_or(f64::INFINITY),
            heat_per_joule: motor.heating.map_or(0.0, |heating| 1.0 / heating.capacity),
            cooling: motor
                .heating
                .and_then(|heating| heating.cooling)
                .map_or(0.0, |time| 1.0 / time),
            motor_inertia: motor.inertia,
            load_inertia,
            weight: moment * GRAVITY,
            offset: load.offset,
            friction: parameters.friction,
            gear: parameters.gear,
            is_lossy: parameters.gear.is_lossy(),
            substeps,
        })
    }

    /// Returns kinetic and potential energy; the latter is zero where the arm hangs down \[J\].
    pub(crate) fn stored(&self, state: &State) -> [f64; 2] {
        let inertia = self.motor_inertia + self.load_inertia;
        let half = sin(0.5 * (state.angle + self.offset));
        [
            0.5 * inertia * state.rate * state.rate,
            2.0 * self.weight * half * half,
        ]
    }

    /// Returns voltage, current and torque.
    pub(crate) fn electric(&self, bridge: Bridge, state: &State) -> Electric {
        let winding = self.resistance * (1.0 + COPPER * state.rise);
        let Bridge::Duty(duty) = bridge else {
            let induced = self.constant * state.rate;
            let excess = induced.abs() - self.voltage - self.diode_voltage;
            if excess <= 0.0 {
                return Electric {
                    voltage: self.voltage,
                    ..Electric::default()
                };
            }
            let braking = excess / (winding + self.supply_resistance);
            let current = -braking.copysign(induced);
            return Electric {
                voltage: self.voltage + self.supply_resistance * braking,
                current,
                torque: self.constant * current,
            };
        };
        let unlimited = (duty * self.voltage - self.constant * state.rate)
            / (winding + self.supply_resistance * duty * duty);
        let current = unlimited.clamp(-self.current_limit, self.current_limit);
        Electric {
            voltage: self.voltage - self.supply_resistance * duty * current,
            current,
            torque: self.constant * current,
        }
    }

    /// Returns the torque of gravity on the shaft \[N·m\].
    fn gravity(&self, angle: f64) -> f64 {
        -self.weight * sin(angle + self.offset)
    }

    /// Returns the forces on a shaft that moves in `direction`, 1 or −1.
    fn forces(&self, bridge: Bridge, state: &State, direction: f64) -> Forces {
        let Electric {
            current,
            torque: motor,
            ..
        } = self.electric(bridge, state);
        let external = self.gravity(state.angle);
        let simple = self.friction.torque(state.rate, motor, external);
        let loss = if self.is_lossy {
            self.gear_loss(state.rate, motor * direction - simple, external * direction)
        } else {
            0.0
        };
        let friction = simple + loss;
        let inertia = self.motor_inertia + self.load_inertia;
        Forces {
            acceleration: (motor + external - direction * friction) / inertia,
            current,
            motor,
            friction,
        }
    }

    /// Returns the torque that the gear loses, where `motor` enters it and `external` acts on the
    /// arm, both in the direction of motion. The transmitted torque x follows from the equations of
    /// the arm, `J_l ω' = x + τ_g`, and of the motor, `J_m ω' = τ_m − x − loss(x)`; its sign is
    /// that of `excess`.
    fn gear_loss(&self, rate: f64, motor: f64, external: f64) -> f64 {
        let (own, load) = (self.motor_inertia, self.load_inertia);
        let excess = load * motor - own * external;
        if excess < 0.0 {
            let share = self.gear.driven_share(rate);
            return -share * excess / (own + load * (1.0 - share));
        }
        let share = self.gear.driving_share(rate);
        let slope = own + load * (1.0 + share);
        let square = self.gear.driving_square;
        let transmitted = if square == 0.0 {
            excess / slope
        } else {
            2.0 * excess / (slope + (slope * slope + 4.0 * load * square * excess).sqrt())
        };
        (share + square * transmitted) * transmitted
    }

    /// Returns the direction in which a shaft at rest starts; none where friction holds it.
    fn start(&self, bridge: Bridge, state: &State) -> Option<f64> {
        [1.0, -1.0]
            .into_iter()
            .find(|direction| self.forces(bridge, state, *direction).acceleration * direction > 0.0)
    }

    /// Advances by a period of the controller, or a part of it \[s\].
    pub(crate) fn advance(
        &self,
        bridge: Bridge,
        state: &mut State,
        seconds: f64,
    ) -> (Works, Counts) {
        let (mut works, mut counts) = (Works::default(), Counts::default());
        let step = seconds / f64::from(self.substeps);
        for _ in 0..self.substeps {
            self.substep(bridge, state, step, &mut works, &mut counts);
        }
        (works, counts)
    }

    /// Advances by a step of the midpoint rule, or by several if the shaft comes to rest within it.
    fn substep(
        &self,
        bridge: Bridge,
        state: &mut State,
        seconds: f64,
        works: &mut Works,
        counts: &mut Counts,
    ) {
        let mut left = seconds;
        // A shaft that turns round does so once; the bound is for one that oscillates at rounding.
        for _ in 0..4 {
            let direction = if state.rate == 0.0 {
                match self.start(bridge, state) {
                    Some(direction) => direction,
                    None => break,
                }
            } else {
                state.rate.signum()
            };
            counts.steps += 1;
            let (next, forces, taken) = self.midpoint(bridge, state, direction, left);
            let turned = next.angle - state.angle;
            works.motor += forces.motor * turned;
            works.friction += forces.friction * turned.abs();
            self.warm(forces.current, state, taken);
            (state.angle, state.rate) = (next.angle, next.rate);
            if taken == left {
                return;
            }
            counts.events += 1;
            left -= taken;
        }
        let current = self.electric(bridge, state).current;
        self.warm(current, state, left);
    }

    /// Returns the state after `seconds`, or where the shaft comes to rest before, with the forces
    /// in the middle of that time, and the time taken.
    fn midpoint(
        &self,
        bridge: Bridge,
        state: &State,
        direction: f64,
        seconds: f64,
    ) -> (State, Forces, f64) {
        let first = self.forces(bridge, state, direction);
        let half = 0.5 * seconds;
        let middle = State {
            angle: state.angle + half * state.rate,
            rate: state.rate + half * first.acceleration,
            rise: state.rise,
        };
        if middle.rate * direction > 0.0 {
            let forces = self.forces(bridge, &middle, direction);
            let next = State {
                angle: state.angle + seconds * middle.rate,
                rate: state.rate + seconds * forces.acceleration,
                rise: state.rise,
            };
            if next.rate * direction > 0.0 {
                return (next, forces, seconds);
            }
            return self.to_rest(
                bridge,
                state,
                direction,
                [first.acceleration, forces.acceleration],
                seconds,
            );
        }
        self.to_rest(bridge, state, direction, [first.acceleration; 2], seconds)
    }

    /// Advances to the instant at which the rate vanishes, by the parabola of the rate with the
    /// accelerations at the start and in the middle of the step.
    fn to_rest(
        &self,
        bridge: Bridge,
        state: &State,
        direction: f64,
        [first, middle]: [f64; 2],
        seconds: f64,
    ) -> (State, Forces, f64) {
        // rate(t) = rate + first t + curve t²
        let curve = (middle - first) / seconds;
        let discriminant = (first * first - 4.0 * curve * state.rate).max(0.0);
        let q = -0.5 * (first + discriminant.sqrt().copysign(first));
        let roots = [q / curve, state.rate / q];
        let root = roots
            .into_iter()
            .filter(|root| root.is_finite() && *root >= 0.0 && *root <= seconds)
            .fold(seconds, f64::min);
        let angle = state.angle + root * (state.rate + root * (0.5 * first + root * curve / 3.0));
        let mean = State {
            angle: 0.5 * (state.angle + angle),
            rate: 0.5 * state.rate,
            rise: state.rise,
        };
        let forces = self.forces(bridge, &mean, direction);
        let rest = State {
            angle,
            rate: 0.0,
            rise: state.rise,
        };
        (rest, forces, root)
    }

    /// Advances the temperature of the winding under a constant current, exactly.
    fn warm(&self, current: f64, state: &mut State, seconds: f64) {
        if self.heat_per_joule == 0.0 {
            return;
        }
        let winding = self.resistance * (1.0 + COPPER * state.rise);
        let heating = current * current * winding * self.heat_per_joule;
        if self.cooling == 0.0 {
            state.rise += seconds * heating;
        } else {
            let final_rise = heating / self.cooling;
            state.rise = final_rise + (state.rise - final_rise) * exp(-seconds * self.cooling);
        }
    }
}

//! Motion of cam and carriage.
//!
//! With the angle φ of the cam, the lift y(φ) of the roller on it and the position q of the
//! carriage, both with the roller on the cam and with it free:
//!
//! ```text
//! on the cam   q = y(φ)     (J + m y'²) φ̈ = τ − b φ̇ − y' (m y'' φ̇² + k δ + c q̇)
//!              N = m q̈ + k δ + c q̇ ≥ 0
//! free         m q̈ = −k δ − c q̇        J φ̈ = τ − b φ̇        q − y(φ) ≥ 0
//! δ = max(0, q + preload)
//! ```
//!
//! J and b are of motor, gear and cam, c is the friction of the carriage; τ is the motor's torque.
//! The load of the sensor is k δ: the second carriage, which carries the sensor, has no mass
//! (ASSUMED), so it touches without an impact. The bench lies on its side (ASSUMED): there is no
//! gravity.
//!
//! The method is the classical Runge–Kutta method with fixed steps, which end at the events: the
//! roller leaves the cam or lands on it, the sensor is touched or released. The works of motor and
//! friction are integrated with the motion, so that the energy balance shows the error.

use serde::{Deserialize, Serialize};
use twinrig_actuator::{DcMotor, MotorError, MotorLine};

use crate::cam::Cam;
use crate::parameters::BenchParameters;

/// Constant data.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) cam: Cam,
    pub(crate) motor: DcMotor,
    /// Inertia of motor, gear and cam at the cam shaft \[kg·m²\].
    inertia: f64,
    shaft_friction: f64,
    mass: f64,
    carriage_friction: f64,
    stiffness: f64,
    preload: f64,
}

/// Contact between roller and cam.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Roller {
    OnCam,
    Free,
}

/// State of motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct State {
    pub(crate) roller: Roller,
    /// Angle, rate, carriage position, carriage velocity, work of the motor, work of friction. On
    /// the cam, position and velocity of the carriage follow from angle and rate.
    pub(crate) values: Values,
}

/// [rad, rad/s, m, m/s, J, J].
pub(crate) type Values = [f64; 6];

/// State with the acceleration that begins the next step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    pub(crate) state: State,
    /// Of the cam \[rad/s²\].
    acceleration: f64,
    /// Force of the cam on the roller \[N\]; 0 if it is free.
    pub(crate) roller_force: f64,
}

/// Event at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// The roller leaves the cam.
    Leaves,
    /// The roller lands on the cam.
    Lands,
    /// The sensor is touched.
    Touches,
    /// The sensor is released.
    Releases,
}

/// Force below which a roller is not pulled \[N\]: rounding of forces of 10 N.
const ROUND_OFF: f64 = 1e-9;

/// Tolerance of located events, relative to the step: 0.25 ns for a step of 0.25 ms.
const LOCATED: f64 = 1e-6;

impl Model {
    pub(crate) fn new(parameters: &BenchParameters, seed: u64) -> Result<Self, MotorError> {
        let motor = DcMotor::new(&parameters.motor)?;
        let (cam, carriage) = (&parameters.cam, &parameters.carriage);
        Ok(Self {
            cam: Cam::new(&cam.profile, &cam.scratches, seed),
            inertia: motor.inertia() + cam.inertia,
            motor,
            shaft_friction: cam.friction,
            mass: carriage.mass,
            carriage_friction: carriage.friction,
            stiffness: carriage.stiffness,
            preload: carriage.preload,
        })
    }

    /// Returns the state at rest at the angle 0, the roller on the cam.
    pub(crate) fn at_rest(&self) -> State {
        let [lift, ..] = self.cam.at(0.0);
        State {
            roller: Roller::OnCam,
            values: [0.0, 0.0, lift, 0.0, 0.0, 0.0],
        }
    }

    /// Compression of the springs at a position of the carriage \[m\].
    fn compression(&self, position: f64) -> f64 {
        (position + self.preload).max(0.0)
    }

    /// Whether the springs press on the sensor.
    pub(crate) fn touches(&self, state: &State) -> bool {
        state.values[2] + self.preload > 0.0
    }

    /// Load of the sensor \[N\] and its rate \[N/s\].
    pub(crate) fn load(&self, state: &State) -> [f64; 2] {
        let [.., position, velocity, _, _] = state.values;
        let rate = if self.touches(state) {
            self.stiffness * velocity
        } else {
            0.0
        };
        [self.stiffness * self.compression(position), rate]
    }

    /// Kinetic and elastic energy \[J\].
    pub(crate) fn stored(&self, state: &State) -> [f64; 2] {
        let [_, rate, position, velocity, ..] = state.values;
        let compression = self.compression(position);
        [
            0.5 * (self.inertia * rate * rate + self.mass * velocity * velocity),
            0.5 * self.stiffness * compression * compression,
        ]
    }

    /// Returns the state with its acceleration; the carriage of a roller on the cam is set from the
    /// angle.
    pub(crate) fn point(&self, line: &MotorLine, mut state: State) -> Point {
        let [angle, rate, position, velocity, ..] = state.values;
        match state.roller {
            Roller::OnCam => {
                let on_cam = self.on_cam(line, angle, rate);
                (state.values[2], state.values[3]) = (on_cam.lift, on_cam.velocity);
                Point {
                    state,
                    acceleration: on_cam.acceleration,
                    roller_force: on_cam.force,
                }
            }
            Roller::Free => Point {
                state,
                acceleration: self.free(line, [angle, rate, position, velocity])[1],
                roller_force: 0.0,
            },
        }
    }

    #[inline]
    fn on_cam(&self, line: &MotorLine, angle: f64, rate: f64) -> OnCam {
        let [lift, slope, bend] = self.cam.at(angle);
        let velocity = slope * rate;
        let springs = self.springs(lift, velocity);
        let bending = self.mass * bend * rate * rate;
        let torque = line.torque_at(rate) - self.shaft_friction * rate;
        let inertia = self.inertia + self.mass * slope * slope;
        let acceleration = (torque - slope * (bending + springs)) / inertia;
        OnCam {
            lift,
            velocity,
            acceleration,
            force: self.mass * slope * acceleration + bending + springs,
        }
    }

    /// Time derivative of angle, rate, position and velocity with the roller free.
    fn free(&self, line: &MotorLine, [_, rate, position, velocity]: [f64; 4]) -> [f64; 4] {
        let torque = line.torque_at(rate) - self.shaft_friction * rate;
        let springs = self.springs(position, velocity);
        [rate, torque / self.inertia, velocity, -springs / self.mass]
    }

    /// Force of springs and bushes against the carriage \[N\].
    fn springs(&self, position: f64, velocity: f64) -> f64 {
        self.stiffness * self.compression(position) + self.carriage_friction * velocity
    }

    /// Power of the motor and power lost to friction \[W\].
    fn powers(&self, line: &MotorLine, rate: f64, velocity: f64) -> [f64; 2] {
        let friction =
            self.shaft_friction * rate * rate + self.carriage_friction * velocity * velocity;
        [line.torque_at(rate) * rate, friction]
    }

    /// Advances by a step \[s\] without events.
    #[inline]
    fn runge_kutta(&self, line: &MotorLine, begin: &Point, seconds: f64) -> Point {
        let State { roller, values } = begin.state;
        let [angle, rate, position, velocity, motor, friction] = values;
        let power = |rate, velocity| self.powers(line, rate, velocity);
        let [motor_power, friction_power] = power(rate, velocity);
        let values = match roller {
            Roller::OnCam => {
                let first = [rate, begin.acceleration, motor_power, friction_power];
                let start = [angle, rate, motor, friction];
                let end = classical(start, first, seconds, |&[angle, rate, ..]| {
                    let on_cam = self.on_cam(line, angle, rate);
                    let [motor, friction] = power(rate, on_cam.velocity);
                    [rate, on_cam.acceleration, motor, friction]
                });
                let [angle, rate, motor, friction] = end;
                [angle, rate, 0.0, 0.0, motor, friction]
            }
            Roller::Free => {
                let slope = |&[angle, rate, position, velocity, ..]: &Values| {
                    let moved = self.free(line, [angle, rate, position, velocity]);
                    let [motor, friction] = power(rate, velocity);
                    [moved[0], moved[1], moved[2], moved[3], motor, friction]
                };
                let start = [angle, rate, position, velocity, motor, friction];
                classical(start, slope(&start), seconds, slope)
            }
        };
        self.point(line, State { roller, values })
    }

    /// Returns the first event that has happened in `after`, a step after `before`.
    fn event(&self, before: &Point, after: &Point) -> Option<Event> {
        let contact = match after.state.roller {
            Roller::OnCam => (after.roller_force < -ROUND_OFF).then_some(Event::Leaves),
            Roller::Free => (self.clearance(&after.state) < 0.0).then_some(Event::Lands),
        };
        let touches = |point: &Point| self.touches(&point.state);
        contact.or_else(|| match (touches(before), touches(after)) {
            (false, true) => Some(Event::Touches),
            (true, false) => Some(Event::Releases),
            _ => None,
        })
    }

    /// Distance of the roller from the cam \[m\].
    pub(crate) fn clearance(&self, state: &State) -> f64 {
        let [angle, _, position, ..] = state.values;
        position - self.cam.at(angle)[0]
    }

    /// Advances by at most `seconds`, to the first event. Returns the time advanced, the event and
    /// the number of steps computed.
    #[inline]
    pub(crate) fn advance(
        &self,
        line: &MotorLine,
        point: &mut Point,
        seconds: f64,
    ) -> (f64, Option<Event>, u64) {
        let end = self.runge_kutta(line, point, seconds);
        match self.event(point, &end) {
            None => {
                *point = end;
                (seconds, None, 1)
            }
            Some(event) => self.locate(line, point, seconds, (event, end)),
        }
    }

    /// Locates the first of the events of a step by bisection: they are rare, and it cannot fail.
    #[cold]
    fn locate(
        &self,
        line: &MotorLine,
        point: &mut Point,
        seconds: f64,
        (mut event, mut end): (Event, Point),
    ) -> (f64, Option<Event>, u64) {
        let begin = *point;
        let (mut before, mut after) = (0.0, seconds);
        let mut steps = 1;
        while after - before > LOCATED * seconds {
            let middle = 0.5 * (before + after);
            let trial = self.runge_kutta(line, &begin, middle);
            steps += 1;
            match self.event(&begin, &trial) {
                Some(earlier) => (after, event, end) = (middle, earlier, trial),
                None => before = middle,
            }
        }
        *point = end;
        (after, Some(event), steps)
    }

    /// Changes the contact of the roller by an event; returns the energy lost in an impact \[J\].
    pub(crate) fn switch(&self, line: &MotorLine, point: &mut Point, event: Event) -> f64 {
        let mut state = point.state;
        let lost = match event {
            Event::Leaves => {
                state.roller = Roller::Free;
                0.0
            }
            Event::Lands => self.land(&mut state),
            Event::Touches | Event::Releases => return 0.0,
        };
        *point = self.point(line, state);
        lost
    }

    /// Plastic impact of the roller on the cam, and the energy lost \[J\].
    fn land(&self, state: &mut State) -> f64 {
        let [angle, rate, _, velocity, ..] = state.values;
        let [_, slope, _] = self.cam.at(angle);
        let approach = slope * rate - velocity;
        let mobility = 1.0 / self.mass + slope * slope / self.inertia;
        let impulse = approach / mobility;
        state.values[1] -= slope * impulse / self.inertia;
        state.roller = Roller::OnCam;
        0.5 * impulse * approach
    }
}

/// Quantities of the roller on the cam.
struct OnCam {
    lift: f64,
    /// Of the carriage \[m/s\].
    velocity: f64,
    /// Of the cam \[rad/s²\].
    acceleration: f64,
    /// Of the cam on the roller \[N\].
    force: f64,
}

/// One step \[s\] of the classical Runge–Kutta method, with the slope at its begin.
#[inline]
fn classical<const N: usize>(
    start: [f64; N],
    first: [f64; N],
    seconds: f64,
    slope: impl Fn(&[f64; N]) -> [f64; N],
) -> [f64; N] {
    let along = |by: f64, k: &[f64; N]| slope(&std::array::from_fn(|n| start[n] + by * k[n]));
    let second = along(0.5 * seconds, &first);
    let third = along(0.5 * seconds, &second);
    let fourth = along(seconds, &third);
    let sixth = seconds / 6.0;
    std::array::from_fn(|n| {
        start[n] + sixth * (first[n] + 2.0 * (second[n] + third[n]) + fourth[n])
    })
}

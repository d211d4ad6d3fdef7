//! Motion within the backlash of the gear, where motor and arm are apart.

use twinrig_actuator::serial::Bridge;

use crate::model::{Model, State};
use crate::shaft::Shaft;
use crate::step::{Stepped, Works};

/// Steps of bisection to the instant at which teeth meet: to the last bit.
const BISECTIONS: usize = 52;

impl Model {
    /// Parts the teeth where motor and arm, each alone, move away from one another: where the teeth
    /// would have to pull. The friction is that of the motor alone, so that teeth that part do not
    /// meet at once.
    pub(crate) fn part(&self, bridge: Bridge, state: &mut State) {
        if state.loose.is_some() {
            return;
        }
        let motor = Shaft::motor(self, bridge, state.rise).acceleration(state.rate);
        let arm = self.gravity(state.angle) / self.load_inertia;
        if (motor - arm) * state.lead < 0.0 {
            state.loose = Some(state.rate);
        }
    }

    /// Whether the teeth touch on the side on which they carry the arm.
    pub(crate) fn is_carried(&self, state: &State) -> bool {
        let mut meshed = *state;
        self.mesh(&mut meshed, None);
        meshed == *state
    }

    /// Sets the lead of the motor and its rate; without them the teeth touch on the side on which
    /// they carry the arm.
    pub(crate) fn mesh(&self, state: &mut State, gap: Option<(f64, f64)>) {
        let half = self.half_gap;
        let carried = -self.gravity(state.angle);
        let (lead, rate) = gap.unwrap_or((half.copysign(carried), state.rate));
        state.lead = lead.clamp(-half, half);
        state.loose = (lead.abs() < half).then_some(rate);
        if state.loose.is_none() && rate != state.rate {
            // The gap of the state was wider.
            self.meet(state, rate);
        }
    }

    /// A step of the motor, whose rate is given, and of the arm beside it, at most to where teeth
    /// meet, or where the motor comes to rest. The arm has no friction of its own.
    pub(crate) fn loose_step(
        &self,
        bridge: Bridge,
        state: &mut State,
        rate: f64,
        seconds: f64,
        works: &mut Works,
    ) -> Stepped {
        let whole = self.apart(bridge, state, rate, seconds);
        let step = match self.meeting(state, rate, &whole) {
            Some(seconds) => Apart {
                meets: true,
                ..self.apart(bridge, state, rate, seconds)
            },
            None => whole,
        };
        works.motor += step.torques[0] * step.turned;
        works.friction += step.torques[1] * step.turned.abs();
        let lead = state.lead + step.turned - (step.arm[0] - state.angle);
        [state.angle, state.rate] = step.arm;
        if step.meets {
            works.friction += self.meet(state, step.rate);
            state.lead = self.half_gap.copysign(lead);
        } else {
            (state.lead, state.loose) = (lead, Some(step.rate));
        }
        Stepped {
            taken: step.taken,
            current: step.current,
        }
    }

    /// A perfectly inelastic impact of motor and arm; returns the energy that is lost.
    pub(crate) fn meet(&self, state: &mut State, motor_rate: f64) -> f64 {
        let (own, load) = (self.motor_inertia, self.load_inertia);
        let apart = motor_rate - state.rate;
        state.rate = (own * motor_rate + load * state.rate) / (own + load);
        state.loose = None;
        0.5 * own * load / (own + load) * apart * apart
    }

    /// Returns motor and arm after a step, as if no teeth met.
    fn apart(&self, bridge: Bridge, state: &State, rate: f64, seconds: f64) -> Apart {
        let shaft = Shaft::motor(self, bridge, state.rise);
        let mut step = match shaft.direction(0.0, rate) {
            Some(direction) => {
                let step = shaft.midpoint([0.0, rate], direction, seconds);
                Apart {
                    turned: step.end[0],
                    rate: step.end[1],
                    taken: step.taken,
                    current: step.forces.current,
                    torques: [step.forces.motor, step.forces.friction],
                    arm: [0.0; 2],
                    meets: false,
                }
            }
            None => Apart {
                turned: 0.0,
                rate,
                taken: seconds,
                current: self.winding.electric(bridge, rate, state.rise).current,
                torques: [0.0; 2],
                arm: [0.0; 2],
                meets: false,
            },
        };
        let half = 0.5 * step.taken;
        let acceleration = |angle: f64| self.gravity(angle) / self.load_inertia;
        let middle_rate = state.rate + half * acceleration(state.angle);
        let middle = acceleration(state.angle + half * state.rate);
        step.arm = [
            state.angle + step.taken * middle_rate,
            state.rate + step.taken * middle,
        ];
        step
    }

    /// Returns the time after which teeth meet, by the cubic of the lead through both ends of a
    /// step; none where they do not.
    fn meeting(&self, state: &State, rate: f64, step: &Apart) -> Option<f64> {
        let from = state.lead;
        let to = from + step.turned - (step.arm[0] - state.angle);
        if to.abs() < self.half_gap {
            return None;
        }
        let side = to.signum();
        let slopes = [
            (rate - state.rate) * step.taken,
            (step.rate - step.arm[1]) * step.taken,
        ];
        let rise = to - from;
        let excess = |share: f64| {
            let left = 1.0 - share;
            let bend = (slopes[0] - rise) * left + (rise - slopes[1]) * share;
            side * (from + share * rise + share * left * bend) - self.half_gap
        };
        let (mut below, mut above) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (below + above);
            if excess(middle) < 0.0 {
                below = middle;
            } else {
                above = middle;
            }
        }
        Some(above * step.taken)
    }
}

/// A step of motor and arm that are apart.
struct Apart {
    /// Angle by which the motor turned, and its rate at the end.
    turned: f64,
    rate: f64,
    taken: f64,
    current: f64,
    /// Torques of motor and friction.
    torques: [f64; 2],
    /// Angle and rate of the arm at the end.
    arm: [f64; 2],
    /// Whether teeth meet at the end.
    meets: bool,
}

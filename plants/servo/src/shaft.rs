//! Rotation of a shaft against friction, within a step of constant duty cycle.

use twinrig_actuator::serial::{Bridge, Electric};

use crate::model::Model;

/// Forces on the shaft at an instant.
pub(crate) struct Forces {
    pub acceleration: f64,
    pub current: f64,
    pub motor: f64,
    pub friction: f64,
}

/// A step of the shaft.
pub(crate) struct ShaftStep {
    /// Angle and rate at its end.
    pub end: [f64; 2],
    /// In the middle.
    pub forces: Forces,
    /// Duration, shorter where the shaft comes to rest \[s\].
    pub taken: f64,
}

/// Motor with the arm, or alone while no teeth touch.
pub(crate) struct Shaft<'m> {
    model: &'m Model,
    bridge: Bridge,
    /// Rise of the temperature of the winding \[K\].
    rise: f64,
    has_arm: bool,
}

impl<'m> Shaft<'m> {
    pub(crate) fn whole(model: &'m Model, bridge: Bridge, rise: f64) -> Self {
        Self {
            model,
            bridge,
            rise,
            has_arm: true,
        }
    }

    pub(crate) fn motor(model: &'m Model, bridge: Bridge, rise: f64) -> Self {
        Self {
            has_arm: false,
            ..Self::whole(model, bridge, rise)
        }
    }

    /// Returns the forces on a shaft that moves in `direction`, 1 or −1.
    fn forces(&self, [angle, rate]: [f64; 2], direction: f64) -> Forces {
        let model = self.model;
        let Electric {
            current,
            torque: motor,
            ..
        } = model.winding.electric(self.bridge, rate, self.rise);
        if !self.has_arm {
            let friction = model.friction.torque(rate, motor, 0.0);
            return Forces {
                acceleration: (motor - direction * friction) / model.motor_inertia,
                current,
                motor,
                friction,
            };
        }
        let external = model.gravity(angle);
        let simple = model.friction.torque(rate, motor, external);
        let loss = if model.is_lossy {
            self.gear_loss(rate, motor * direction - simple, external * direction)
        } else {
            0.0
        };
        let friction = simple + loss;
        let inertia = model.motor_inertia + model.load_inertia;
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
        let gear = &self.model.gear;
        let (own, load) = (self.model.motor_inertia, self.model.load_inertia);
        let excess = load * motor - own * external;
        if excess < 0.0 {
            let share = gear.driven_share(rate);
            return -share * excess / (own + load * (1.0 - share));
        }
        let share = gear.driving_share(rate);
        let slope = own + load * (1.0 + share);
        let square = gear.driving_square;
        let transmitted = if square == 0.0 {
            excess / slope
        } else {
            2.0 * excess / (slope + (slope * slope + 4.0 * load * square * excess).sqrt())
        };
        (share + square * transmitted) * transmitted
    }

    /// Returns the acceleration of the motor alone; zero where friction holds it.
    pub(crate) fn acceleration(&self, rate: f64) -> f64 {
        let direction = self.direction(0.0, rate);
        direction.map_or(0.0, |direction| {
            self.forces([0.0, rate], direction).acceleration
        })
    }

    /// Returns the direction of motion, in which a shaft at rest starts; none where friction holds
    /// it.
    pub(crate) fn direction(&self, angle: f64, rate: f64) -> Option<f64> {
        if rate != 0.0 {
            return Some(rate.signum());
        }
        [1.0, -1.0]
            .into_iter()
            .find(|direction| self.forces([angle, rate], *direction).acceleration * direction > 0.0)
    }

    /// Returns the state after `seconds`, or where the shaft comes to rest before.
    pub(crate) fn midpoint(
        &self,
        [angle, rate]: [f64; 2],
        direction: f64,
        seconds: f64,
    ) -> ShaftStep {
        let first = self.forces([angle, rate], direction).acceleration;
        let half = 0.5 * seconds;
        let middle = [angle + half * rate, rate + half * first];
        if middle[1] * direction <= 0.0 {
            return self.to_rest([angle, rate], direction, [first; 2], seconds);
        }
        let forces = self.forces(middle, direction);
        let end = [
            angle + seconds * middle[1],
            rate + seconds * forces.acceleration,
        ];
        if end[1] * direction > 0.0 {
            return ShaftStep {
                end,
                forces,
                taken: seconds,
            };
        }
        let accelerations = [first, forces.acceleration];
        self.to_rest([angle, rate], direction, accelerations, seconds)
    }

    /// Advances to the instant at which the rate vanishes, by the parabola of the rate with the
    /// accelerations at the start and in the middle of the step.
    fn to_rest(
        &self,
        [angle, rate]: [f64; 2],
        direction: f64,
        [first, middle]: [f64; 2],
        seconds: f64,
    ) -> ShaftStep {
        // rate(t) = rate + first t + curve t²
        let curve = (middle - first) / seconds;
        let discriminant = (first * first - 4.0 * curve * rate).max(0.0);
        let q = -0.5 * (first + discriminant.sqrt().copysign(first));
        let roots = [q / curve, rate / q];
        let root = roots
            .into_iter()
            .filter(|root| root.is_finite() && *root >= 0.0 && *root <= seconds)
            .fold(seconds, f64::min);
        let stop = angle + root * (rate + root * (0.5 * first + root * curve / 3.0));
        let mean = [0.5 * (angle + stop), 0.5 * rate];
        ShaftStep {
            end: [stop, 0.0],
            forces: self.forces(mean, direction),
            taken: root,
        }
    }
}

use serde::{Deserialize, Serialize};

/// Trapezoidal profile: a set-point that moves towards a goal at a limited speed and acceleration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Set-point \[counts\].
    pub position: f64,
    /// Its rate \[counts/s\].
    pub rate: f64,
}

/// Limits of a profile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfileLimits {
    /// Speed \[counts/s\].
    pub speed: f64,
    /// Acceleration \[counts/s²\]; 0 for no limit.
    pub acceleration: f64,
}

impl Profile {
    /// Returns a set-point at rest.
    pub fn at(position: f64) -> Self {
        Self {
            position,
            rate: 0.0,
        }
    }

    /// Moves the set-point towards the goal for a time \[s\].
    pub fn approach(&mut self, goal: f64, limits: ProfileLimits, seconds: f64) {
        let ProfileLimits {
            speed,
            acceleration,
        } = limits;
        let distance = goal - self.position;
        if acceleration == 0.0 {
            self.rate = speed.copysign(distance);
        } else {
            let change = acceleration * seconds;
            // The rate from which the set-point can still stop at the goal, after a whole step.
            let stopping = (0.25 * change * change + 2.0 * acceleration * distance.abs()).sqrt();
            let wanted = speed
                .min((stopping - 0.5 * change).max(0.0))
                .copysign(distance);
            self.rate += (wanted - self.rate).clamp(-change, change);
        }
        let moved = self.rate * seconds;
        if moved.abs() >= distance.abs() && moved * distance >= 0.0 {
            *self = Self::at(goal);
        } else {
            self.position += moved;
        }
    }
}

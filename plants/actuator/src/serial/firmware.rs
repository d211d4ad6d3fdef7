//! The position controller: commands after their delay, a profile of the set-point, a duty cycle.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_robot::serial::Controller;

use super::Bridge;

/// A command to a servo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ServoCommand {
    /// Position \[rad\].
    pub position: f64,
    /// Whether the torque is on.
    pub enabled: bool,
}

/// State of the controller.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FirmwareState {
    /// Commands under way, with the instants from which they are in force.
    pending: VecDeque<(SimTime, ServoCommand)>,
    /// Command in force.
    command: ServoCommand,
    /// Set-point of the profile, and its rate.
    set_point: f64,
    set_rate: f64,
}

/// Position controller of a servo, which works in steps of its period.
#[derive(Clone, Debug)]
pub struct Firmware {
    controller: Controller,
    per_radian: f64,
    delay: SimDuration,
    period: SimDuration,
    /// State.
    pub state: FirmwareState,
}

impl Firmware {
    /// Creates the controller of a shaft that it holds at `angle` \[rad\].
    pub fn new(controller: &Controller, angle: f64) -> Self {
        let period = super::duration(controller.period);
        let delay = super::duration(controller.command_delay);
        let command = ServoCommand {
            position: angle,
            enabled: true,
        };
        let pending = delay.as_nanos() / period.as_nanos() + 2;
        Self {
            controller: *controller,
            per_radian: controller.counts as f64 / core::f64::consts::TAU,
            delay,
            period,
            state: FirmwareState {
                pending: VecDeque::with_capacity(usize::try_from(pending).unwrap_or_default()),
                command,
                set_point: angle,
                set_rate: 0.0,
            },
        }
    }

    /// Holds the shaft at `angle`, and forgets the commands under way.
    pub fn restart(&mut self, angle: f64) {
        self.state.pending.clear();
        self.state.command = ServoCommand {
            position: angle,
            enabled: true,
        };
        (self.state.set_point, self.state.set_rate) = (angle, 0.0);
    }

    /// Returns the time between steps.
    pub fn period(&self) -> SimDuration {
        self.period
    }

    /// Accepts a command that arrives at `now`; `tick` is the next step of the controller. Of the
    /// commands that come into force at the same step the last one counts.
    pub fn command(&mut self, now: SimTime, tick: SimTime, command: ServoCommand) {
        let arrival = now + self.delay;
        let late = arrival.max(tick) - tick;
        let steps = late.as_nanos().div_ceil(self.period.as_nanos());
        let due = tick + SimDuration::from_nanos(steps * self.period.as_nanos());
        match self.state.pending.back_mut() {
            Some((last, pending)) if *last == due => *pending = command,
            _ => self.state.pending.push_back((due, command)),
        }
    }

    /// A step of the controller at `tick`, where the shaft is at `angle` \[rad\].
    pub fn step(&mut self, tick: SimTime, angle: f64) -> Bridge {
        while let Some((due, command)) = self.state.pending.front() {
            if *due > tick {
                break;
            }
            self.state.command = *command;
            self.state.pending.pop_front();
        }
        if !self.state.command.enabled {
            (self.state.set_point, self.state.set_rate) = (angle, 0.0);
            return Bridge::Open;
        }
        self.follow_profile();
        let (set, at) = (
            self.state.set_point * self.per_radian,
            angle * self.per_radian,
        );
        let error = if self.controller.quantized {
            set.round() - at.round()
        } else {
            set - at
        };
        Bridge::Duty(self.duty(error))
    }

    /// Returns the duty cycle for an error of position in counts.
    fn duty(&self, error: f64) -> f64 {
        let Controller {
            gain,
            duty_per_count,
            dead_zone,
            starting_duty,
            duty_limit,
            ..
        } = self.controller;
        let beyond = error.abs() - dead_zone;
        if beyond <= 0.0 {
            return 0.0;
        }
        let duty = starting_duty + gain * duty_per_count * beyond;
        duty.min(duty_limit).copysign(error)
    }

    /// Moves the set-point towards the command, at the greatest speed and acceleration.
    fn follow_profile(&mut self) {
        let target = self.state.command.position;
        let Controller {
            profile_speed,
            profile_acceleration,
            period,
            ..
        } = self.controller;
        if profile_speed.is_none() && profile_acceleration.is_none() {
            self.state.set_point = target;
            return;
        }
        let distance = target - self.state.set_point;
        let mut rate = profile_speed.unwrap_or(f64::INFINITY);
        if let Some(acceleration) = profile_acceleration {
            // The rate from which the set-point can still stop at the target, after a whole step.
            let change_max = acceleration * period;
            let stopping =
                (0.25 * change_max * change_max + 2.0 * acceleration * distance.abs()).sqrt();
            rate = rate.min((stopping - 0.5 * change_max).max(0.0));
            let wanted = rate.copysign(distance);
            let change = (wanted - self.state.set_rate).clamp(-change_max, change_max);
            self.state.set_rate += change;
        } else {
            self.state.set_rate = rate.copysign(distance);
        }
        let moved = self.state.set_rate * period;
        if moved.abs() >= distance.abs() && moved * distance >= 0.0 {
            (self.state.set_point, self.state.set_rate) = (target, 0.0);
        } else {
            self.state.set_point += moved;
        }
    }
}

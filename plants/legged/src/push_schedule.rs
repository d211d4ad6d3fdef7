//! Schedule of pushes: the ends of steps, the load in a step, and the signals.
//!
//! Steps end where a push begins, has a corner or ends, so a push is smooth within a step, and
//! `Dynamics::set_load` gets it as a function of the time in the step (`StepLoad`): explicit
//! methods evaluate it at their stages, the others hold its mean, a closed form. Its work is a flow
//! of the ledger of its own, `external`. Without pushes nothing of this is computed. A kind of
//! plant declares that it takes pushes; the others refuse them when the scenario is read.

use twinrig_kernel::{Port, SimTime, Unit, signal};

use crate::error::{LeggedError, PushProblem};
use crate::external_load::{ExternalLoad, Pulse, PulseTarget, StepLoad};
use crate::push::{Push, PushTarget};
use crate::setup::Base;

/// Pushes of a run, which end steps where one of them is not smooth. They are a part of the
/// configuration: snapshots do not contain them.
#[derive(Debug, Clone, Default)]
pub struct PushSchedule {
    pushes: Vec<Scheduled>,
    load: StepLoad,
    outputs: Vec<(Output, Port)>,
}

#[derive(Debug, Clone)]
struct Scheduled {
    begin: SimTime,
    /// Instants at which the push is not smooth.
    corners: Vec<SimTime>,
    end: SimTime,
    /// With no time elapsed.
    pulse: Pulse,
}

/// A signal of pushes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Output {
    Force,
    Torque,
    Foot(usize),
    Work,
}

impl PushSchedule {
    /// Creates the schedule of pushes on a robot with these legs; `selected` selects the signals.
    ///
    /// # Errors
    /// [`LeggedError::Push`].
    pub fn new(
        pushes: &[Push],
        base: Base,
        legs: &[&str],
        selected: &dyn Fn(&str) -> bool,
    ) -> Result<Self, LeggedError> {
        let scheduled = pushes.iter().map(|push| Scheduled::new(push, base, legs));
        let pushes = scheduled.collect::<Result<Vec<_>, _>>()?;
        let pushed = |is: &dyn Fn(&PulseTarget) -> bool| {
            let mut targets = pushes.iter().map(|push| &push.pulse.target);
            targets.any(is)
        };
        let vector = |name: &str, unit| Port::output(name, unit, 3);
        let force = vector(signal::BODY_PUSH_FORCE, Unit::Newton);
        let torque = vector(signal::BODY_PUSH_TORQUE, Unit::NewtonMeter);
        let work = Port::output(signal::ENERGY_EXTERNAL, Unit::Joule, 1);
        let on_trunk = pushed(&|target| matches!(target, PulseTarget::Trunk(_)));
        let twists = pushed(&|target| *target == PulseTarget::TrunkTorque);
        let mut outputs = vec![
            (on_trunk, Output::Force, force),
            (twists, Output::Torque, torque),
        ];
        for (i, leg) in legs.iter().enumerate() {
            let name = signal::of_leg(leg, signal::PUSH_FORCE);
            let is_pushed = pushed(&|target| *target == PulseTarget::Foot(i));
            outputs.push((is_pushed, Output::Foot(i), vector(&name, Unit::Newton)));
        }
        outputs.push((!pushes.is_empty(), Output::Work, work));
        let outputs = outputs.into_iter();
        let outputs = outputs.filter(|(exists, _, port)| *exists && selected(&port.name));
        Ok(Self {
            load: StepLoad {
                pulses: Vec::with_capacity(pushes.len()),
            },
            outputs: outputs.map(|(_, output, port)| (output, port)).collect(),
            pushes,
        })
    }

    /// Returns whether there are no pushes.
    pub fn is_empty(&self) -> bool {
        self.pushes.is_empty()
    }

    /// Returns the output ports: force and torque on the trunk and forces on the feet where a push
    /// of the schedule has them, and the work of all pushes.
    pub fn ports(&self) -> impl Iterator<Item = &Port> {
        self.outputs.iter().map(|(_, port)| port)
    }

    /// Returns the end of the step from `now` to at most `next` in which all pushes are smooth.
    pub fn step_end(&self, now: SimTime, next: SimTime) -> SimTime {
        let corners = self.pushes.iter().flat_map(|push| &push.corners);
        let later = corners.copied().filter(|corner| *corner > now);
        later.fold(next, SimTime::min)
    }

    /// Returns the load over a step from `now` to at most [`Self::step_end`].
    pub fn over(&mut self, now: SimTime) -> &StepLoad {
        let pulses = &mut self.load.pulses;
        pulses.clear();
        for push in &self.pushes {
            if push.begin <= now && now < push.end {
                pulses.push(Pulse {
                    elapsed_s: (now - push.begin).as_secs_f64(),
                    ..push.pulse.clone()
                });
            }
        }
        &self.load
    }

    /// Writes the selected signals: mean loads over a window of the run \[s\], zero for an empty
    /// one, and `work` \[J\].
    pub fn write(&self, window: [f64; 2], work: f64, mut outputs: &mut [f64]) {
        if self.outputs.is_empty() {
            return;
        }
        let load = self.mean(window);
        for (output, port) in &self.outputs {
            let (values, rest) = outputs.split_at_mut(port.size);
            outputs = rest;
            match output {
                Output::Force => values.copy_from_slice(&load.force),
                Output::Torque => values.copy_from_slice(&load.torque),
                Output::Foot(leg) => values.copy_from_slice(&load.feet[*leg]),
                Output::Work => values.fill(work),
            }
        }
    }

    /// Returns the mean load between two times of the run \[s\].
    fn mean(&self, [from_s, to_s]: [f64; 2]) -> ExternalLoad {
        let mut load = ExternalLoad::default();
        if to_s <= from_s {
            return load;
        }
        for Scheduled { begin, pulse, .. } in &self.pushes {
            let share = |at_s: f64| {
                let elapsed_s = at_s - begin.as_secs_f64();
                (elapsed_s / pulse.duration_s).clamp(0.0, 1.0)
            };
            let (from, to) = (share(from_s), share(to_s));
            if to > from {
                let seconds = pulse.shape.integral(from, to) * pulse.duration_s;
                load.add(pulse, seconds / (to_s - from_s));
            }
        }
        load
    }
}

impl Scheduled {
    fn new(push: &Push, base: Base, legs: &[&str]) -> Result<Self, LeggedError> {
        let problem = |why| LeggedError::Push {
            push: push.name.clone(),
            why,
        };
        if push.duration.is_zero() {
            return Err(problem(PushProblem::Duration));
        }
        let mut values = push.peak.to_vec();
        let target = match &push.target {
            PushTarget::Foot(leg) => {
                let index = legs.iter().position(|known| known == leg);
                let no_leg = || PushProblem::NoSuchLeg(leg.clone());
                PulseTarget::Foot(index.ok_or_else(no_leg).map_err(problem)?)
            }
            _ if base == Base::Fixed => return Err(problem(PushProblem::FixedTrunk)),
            PushTarget::Trunk(point) => {
                values.extend(point);
                PulseTarget::Trunk(*point)
            }
            PushTarget::TrunkTorque => PulseTarget::TrunkTorque,
        };
        if values.iter().any(|value| !value.is_finite()) {
            return Err(problem(PushProblem::NotFinite));
        }
        let end = push.at.checked_add(push.duration);
        let end = end.ok_or(PushProblem::Duration).map_err(problem)?;
        let middle = push.at + push.duration / 2;
        let corner = push.shape.has_corner().then_some(middle);
        let corners = [Some(push.at), corner, Some(end)];
        Ok(Self {
            begin: push.at,
            corners: corners.into_iter().flatten().collect(),
            end,
            pulse: Pulse {
                target,
                shape: push.shape,
                peak: push.peak,
                duration_s: push.duration.as_secs_f64(),
                elapsed_s: 0.0,
            },
        })
    }
}

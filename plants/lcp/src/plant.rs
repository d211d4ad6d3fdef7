//! Implementation of [`Plant`].

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, Port, SimDuration, SimTime, Snapshot, SnapshotError, signal};
use twinrig_legged::{Drives, Signals, Window};
use twinrig_robot::Robot;
use twinrig_runtime::interrupt::LongLoop;
use twinrig_runtime::{
    EnergyBalance, Plant, PlantEvent, PlantEventKind, PlantFault, PlantState, WorkCounts,
};

use crate::body::{Body, SavedBody, initial_flow};
use crate::flow::FlowError;
use crate::options::{LcpError, Method, Options};
use crate::posture::ResumeError;

/// Plant in which every segment of the robot has inertia.
pub struct Lcp {
    body: Box<dyn Body>,
    now: SimTime,
    step: SimDuration,
    signals: Signals,
    window: Window,
    events: Vec<PlantEvent>,
}

/// Serialised state.
#[derive(Serialize, Deserialize)]
struct Saved {
    now: SimTime,
    window: Window,
    body: SavedBody,
}

impl Lcp {
    /// Builds the plant with the trunk level and at rest, the legs in their start pose, and the
    /// lowest foot at height zero, or on the ground where that is higher; onto lower ground the
    /// robot falls. `selected` selects the output signals.
    ///
    /// # Errors
    /// [`LcpError`] if robot and options do not match.
    pub fn new(
        robot: &Robot,
        options: &Options,
        selected: &dyn Fn(&str) -> bool,
    ) -> Result<Self, LcpError> {
        if options.tolerance.is_nan() || options.tolerance <= 0.0 {
            return Err(LcpError::Tolerance(options.tolerance));
        }
        let motors = matches!(options.setup.drives, Drives::Motors { .. });
        if motors && options.method == Method::Thesis {
            return Err(LcpError::Motors);
        }
        let selected_mounts = options.setup.selected_mounts(robot)?;
        let toes = options.toe && selected_mounts.iter().any(|mount| mount.leg.toe.is_some());
        if let Some(mount) = selected_mounts
            .iter()
            .find(|mount| toes && mount.leg.toe.is_none())
        {
            let leg = mount.name.clone();
            return Err(LcpError::Toe { leg });
        }
        let names: Vec<&str> = selected_mounts
            .iter()
            .map(|mount| mount.name.as_str())
            .collect();
        let body: Box<dyn Body> = if toes {
            Box::new(initial_flow::<4>(robot, options)?)
        } else {
            Box::new(initial_flow::<3>(robot, options)?)
        };
        Ok(Self {
            body,
            now: SimTime::ZERO,
            step: options.setup.step,
            signals: Signals::new(&names, &options.setup, selected),
            window: Window::default(),
            events: Vec::new(),
        })
    }

    fn fault(&self, error: &FlowError) -> PlantFault {
        let part = match error {
            FlowError::SolveError(_) | FlowError::Jammed(_) => "contact",
            _ => "integrator",
        };
        PlantFault {
            time: self.now,
            part: part.to_owned(),
            energy: self.energy().stored(),
            why: error.to_string(),
        }
    }

    /// Appends the events logged since the last call.
    fn collect_events(&mut self) {
        let logged = self.body.log(self.events.len());
        let new_events = logged.iter().map(|(event, leg)| PlantEvent {
            at_s: event.at_s,
            part: signal::of_leg(leg, event.what),
            kind: if event.reached {
                PlantEventKind::Reached
            } else {
                PlantEventKind::Released
            },
        });
        let new_events: Vec<_> = new_events.collect();
        self.events.extend(new_events);
    }

    fn inputs(&self) -> usize {
        let ports = self.signals.ports().iter();
        ports
            .filter(|port| port.direction == Direction::Input)
            .count()
    }
}

impl Plant for Lcp {
    fn name(&self) -> &'static str {
        "lcp"
    }

    fn ports(&self) -> Vec<Port> {
        self.signals.ports().to_vec()
    }

    fn initial_inputs(&self, inputs: &mut [f64]) {
        let count = self.inputs().min(inputs.len());
        self.body.initial_inputs(&mut inputs[..count]);
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        self.signals
            .check_inputs(inputs, self.now, || self.energy().stored())?;
        self.body.set_inputs(inputs);
        let mut steps = LongLoop::default();
        while self.now < to {
            if steps.is_interrupted() {
                return Err(PlantFault::interrupted(self, self.now));
            }
            let next = to.min(self.now + self.step);
            let seconds = (next - self.now).as_secs_f64();
            let now_s = self.now.as_secs_f64();
            if let Err(error) = self.body.run(now_s, seconds) {
                return Err(self.fault(&error));
            }
            self.now = next;
        }
        self.collect_events();
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        let now_s = self.now.as_secs_f64();
        self.signals
            .write(self.body.as_ref(), &self.window, now_s, outputs);
    }

    fn begin_window(&mut self) {
        self.window
            .begin(self.now.as_secs_f64(), self.body.ground_impulses());
    }

    fn energy(&self) -> EnergyBalance {
        self.body.energy()
    }

    fn work(&self) -> WorkCounts {
        self.body.counts()
    }

    fn constraint_violation(&self) -> Option<f64> {
        Some(self.body.constraint_violation())
    }

    fn log_events(&mut self, enabled: bool) {
        self.body.set_logging(enabled);
        self.events.clear();
    }

    fn events(&self) -> &[PlantEvent] {
        &self.events
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&Saved {
            now: self.now,
            window: self.window,
            body: self.body.save(),
        })
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        let saved: Saved = snapshot.read()?;
        self.body
            .restore(&saved.body)
            .map_err(|found| SnapshotError::Mismatch {
                expected: "lcp".to_owned(),
                found,
            })?;
        (self.now, self.window) = (saved.now, saved.window);
        Ok(())
    }

    fn state(&self) -> Option<PlantState> {
        Some(self.body.state(self.now))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let resumed = self.body.resume_from(from);
        let lines = resumed.map_err(|ResumeError { part, why }| PlantFault {
            time: from.time,
            part,
            energy: self.energy().stored(),
            why,
        })?;
        self.now = from.time;
        self.events.clear();
        self.window = Window::default();
        self.begin_window();
        Ok(lines)
    }
}

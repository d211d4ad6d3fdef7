//! Runs of a gait for studies of footsteps: a scenario on a plant, with changes of its own.

use std::path::Path;

use serde::{Deserialize, Serialize};
use twinrig_kernel::{Direction, SimDuration, SimTime, signal};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::error::guarded;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;
use twinrig_runtime::{Group, Observer, ProcessVariable, Rig, RunEvent};
use twinrig_scenario::{
    ActuatorKind, ChangeSpec, Footstep, Judge, Layouts, LegFact, LoadCycle, RunEnd, Scenario,
    Scene, Setting,
};

use crate::error::{Error, first_line};
use crate::gait::slip_meter::SlipMeter;
use crate::runs::scene::RunScene;
use crate::{FootContact, GaitRun, MeasuredCycle, MotionSample, PhaseSample};

/// Simulated time between two checks for a fall or an interrupt.
const SLICE: SimDuration = SimDuration::from_millis(100);
/// Time between two samples of the phases of oscillators: 25 in a cycle at 4 Hz.
const PHASE_PERIOD: SimDuration = SimDuration::from_millis(10);
/// Limits of a servo that no gait reaches: speed \[rad/s\] and torque \[N·m\].
const UNSATURATED: [f64; 2] = [1e3, 1e3];
/// Process variable that scales the feedback of loads.
const FEEDBACK: &str = "feedback";

/// Difference from a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Factor {
    /// None.
    AsGiven,
    /// Servos without limits of speed and torque.
    UnsaturatedServos,
    /// The controller without feedback of loads.
    NoFeedback,
}

impl Factor {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::AsGiven => "as given",
            Self::UnsaturatedServos => "unsaturated servos",
            Self::NoFeedback => "no feedback",
        }
    }
}

/// A scenario with a gait on a plant.
pub(crate) struct GaitScene<'r> {
    files: RunScene,
    assembly: Assembly<'r>,
    scenario: Scenario,
    variables: Vec<ProcessVariable>,
}

impl<'r> GaitScene<'r> {
    /// Reads the scenario at `path` with `settings`, on the plant `plant` or on its own.
    ///
    /// # Errors
    /// Errors of the scenario; [`Error::NoGait`] without feet on the ground or a controller.
    pub(crate) fn new(
        registry: &'r Registry,
        path: &Path,
        settings: &[Setting],
        plant: Option<&str>,
    ) -> Result<Self, Error> {
        let name = path.display().to_string();
        let read = guarded(&name, || RunScene::read(registry, path, settings, plant));
        let (files, assembly) = read?;
        Self::of(files, assembly)
    }

    /// Returns the scene of another process, without files.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn on_worker(registry: &'r Registry, files: &RunScene) -> Result<Self, Error> {
        Self::of(files.clone(), files.assembly(registry, &[])?)
    }

    fn of(files: RunScene, assembly: Assembly<'r>) -> Result<Self, Error> {
        let mut scenario = assembly.scenario().without_expectations();
        scenario.record.signals = Some(Vec::new());
        scenario.record.frames = None;
        let no_gait = |why: &str, help: &str| Error::no_gait(&scenario.file, why, help);
        if scenario.plant.ground.is_none() || observed(&assembly).len() < SIGNALS {
            let help = "choose a scenario with ground on a plant of a whole robot";
            return Err(no_gait("its feet touch no ground", help));
        }
        if scenario.controller.is_none() {
            let help = "add a [controller] with a gait, as in scenarios/trot.toml";
            return Err(no_gait("it has no controller", help));
        }
        let variables = assembly.rig()?.process().variables().to_vec();
        Ok(Self {
            files,
            assembly,
            scenario,
            variables,
        })
    }

    /// Returns the contents of the files.
    pub(crate) fn files(&self) -> &RunScene {
        &self.files
    }

    pub(crate) fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    pub(crate) fn legs(&self) -> &[LegFact] {
        &self.assembly.scene().legs
    }

    /// Returns whether the controller has an input of this name.
    pub(crate) fn takes(&self, name: &str) -> bool {
        let mut ports = self.assembly.process_ports().iter();
        ports.any(|port| port.direction == Direction::Input && port.name == name)
    }

    /// Returns the process variables of the controller, with the values of the scenario.
    pub(crate) fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    /// Returns the variables called `name`: one, or those of all its groups or legs.
    pub(crate) fn variables_called(&self, name: &str) -> Vec<&ProcessVariable> {
        let variables = self.variables.iter();
        let is_called = |variable: &&ProcessVariable| base(variable.name()) == name;
        let exact = self.variables.iter().find(|it| it.name() == name);
        exact.map_or_else(|| variables.filter(is_called).collect(), |one| vec![one])
    }

    /// Returns whether the factor makes a difference.
    pub(crate) fn has(&self, factor: Factor) -> bool {
        match factor {
            Factor::AsGiven => true,
            Factor::UnsaturatedServos => self.scenario.actuator.kind == ActuatorKind::Servo,
            Factor::NoFeedback => {
                let feedback = self.variables_called(FEEDBACK);
                feedback.iter().any(|variable| variable.value() != 0.0)
            }
        }
    }

    /// Runs the scenario with `changes` in place of its own up to `end`, or up to a fall.
    ///
    /// # Errors
    /// The reason of a run that cannot be built, or fails.
    pub(crate) fn run(
        &self,
        factor: Factor,
        changes: Vec<ChangeSpec>,
        end: SimTime,
    ) -> Result<GaitRun, String> {
        let run = self.observed_run(factor, changes, end, |_, _| ());
        let run = run.map(|(run, ())| run);
        run.map_err(|error| first_line(&error.to_string()))
    }

    /// Runs the scenario with its own changes and duration, up to a fall, with another observer of
    /// the run.
    ///
    /// # Errors
    /// The reason of a run that cannot be built, or fails.
    pub(crate) fn run_with<O: Observer>(
        &self,
        observer: impl FnOnce(&Scene, &Rig) -> O,
    ) -> Result<(GaitRun, O), String> {
        let changes = self.scenario.changes.clone();
        let run = self.observed_run(Factor::AsGiven, changes, self.scenario.end(), observer);
        run.map_err(|error| first_line(&error.to_string()))
    }

    fn observed_run<O: Observer>(
        &self,
        factor: Factor,
        changes: Vec<ChangeSpec>,
        end: SimTime,
        other: impl FnOnce(&Scene, &Rig) -> O,
    ) -> Result<(GaitRun, O), Error> {
        let mut scenario = self.scenario.clone();
        self.apply(factor, &mut scenario);
        scenario.changes = changes;
        scenario.duration = end.since_start();
        let assembly = self
            .assembly
            .with_scenario(&scenario, &observed(&self.assembly))?;
        let mut rig = assembly.rig()?;
        let footsteps = FootstepObserver::new(assembly.scene(), &rig);
        let mut observer = (footsteps, other(assembly.scene(), &rig));
        let mut now = rig.now();
        while now < end && observer.0.judge.fell_at().is_none() && !interrupt::is_requested() {
            now = (now + SLICE).min(end);
            rig.run_until(now, &mut observer)
                .map_err(|error| assembly.rig_error(error))?;
        }
        let (footsteps, other) = observer;
        Ok((footsteps.finish(rig.now()), other))
    }

    fn apply(&self, factor: Factor, scenario: &mut Scenario) {
        match factor {
            Factor::AsGiven => {}
            Factor::UnsaturatedServos => {
                let actuator = &mut scenario.actuator;
                for servo in [&mut actuator.hip, &mut actuator.knee] {
                    [servo.speed, servo.torque] = UNSATURATED.map(Some);
                }
            }
            Factor::NoFeedback => {
                let names = self.variables_called(FEEDBACK);
                let names: Vec<&str> = names.iter().map(|it| it.name()).collect();
                if let Some(controller) = &mut scenario.controller {
                    let variables = &mut controller.variables;
                    variables.retain(|(name, _)| !names.contains(&&**name));
                    variables.extend(names.iter().map(|name| ((*name).to_owned(), 0.0)));
                }
            }
        }
    }
}

/// Returns the name of a variable without its group or leg.
pub(crate) fn base(name: &str) -> &str {
    name.split('/').next().unwrap_or(name)
}

/// Least number of observed signals: those of the trunk and of one leg.
const SIGNALS: usize = 4;

/// The outputs that are observed: positions of trunk and feet, and loads.
fn observed(assembly: &Assembly<'_>) -> Vec<String> {
    let names = assembly.plant_outputs().iter().map(|port| &port.name);
    let names = names.filter(|name| match signal::parse_leg(name) {
        Some((_, of_leg)) => [signal::FOOT_POSITION, signal::FOOT_LOAD].contains(&of_leg),
        None => [signal::BODY_POSITION, signal::BODY_RPY].contains(&&***name),
    });
    names.cloned().collect()
}

/// Collects footsteps by two judges: one merges bounces, the other does not.
struct FootstepObserver {
    judge: Judge,
    bounces: Judge,
    footsteps: Vec<Footstep>,
    contacts: Vec<Footstep>,
    cycles: Vec<MeasuredCycle>,
    /// Indices of the phases of the legs in the outputs of the controller; none without them.
    oscillators: Option<Vec<usize>>,
    phases: Vec<PhaseSample>,
    next_phases: SimTime,
    slip: SlipMeter,
    /// Indices of the trunk's position and angles in the outputs of the plant.
    trunk: Option<[usize; 2]>,
    motion: Vec<MotionSample>,
    next_motion: SimTime,
}

impl FootstepObserver {
    fn new(scene: &Scene, rig: &Rig) -> Self {
        let tasks: Vec<String> = rig.task_names().map(str::to_owned).collect();
        let judge = |scene: &Scene| {
            let layouts = Layouts {
                plant: rig.layout(Group::Plant),
                process_inputs: rig.layout(Group::ProcessInputs),
                process_outputs: rig.layout(Group::ProcessOutputs),
                diagnostics: rig.layout(Group::Diagnostics),
                tasks: &tasks,
            };
            Judge::new(scene, layouts)
        };
        let mut every_contact = scene.clone();
        let footsteps = &mut every_contact.scenario.observe.footsteps;
        footsteps.shortest_swing = SimDuration::ZERO;
        footsteps.least_impulse = 0.0;
        let plant = rig.layout(Group::Plant);
        let start = |name| plant.find(name).map(|range| range.start);
        let outputs = rig.layout(Group::ProcessOutputs);
        let phase = |leg: &LegFact| {
            let phase = outputs.find(&signal::of_leg(&leg.name, signal::PHASE));
            phase.map(|range| range.start)
        };
        let trunk = start(signal::BODY_POSITION).zip(start(signal::BODY_RPY));
        let lift_off = scene.scenario.observe.footsteps.lift_off;
        Self {
            judge: judge(scene).with_load_cycles(),
            slip: SlipMeter::new(plant, lift_off.newton(scene.weight)),
            bounces: judge(&every_contact),
            footsteps: Vec::new(),
            contacts: Vec::new(),
            cycles: Vec::new(),
            oscillators: scene.legs.iter().map(phase).collect(),
            phases: Vec::new(),
            next_phases: SimTime::ZERO,
            trunk: trunk.map(|(position, angles)| [position, angles]),
            motion: Vec::new(),
            next_motion: SimTime::ZERO,
        }
    }

    fn finish(mut self, end: SimTime) -> GaitRun {
        let at_end = RunEnd {
            at: end,
            energy: None,
            work: None,
            real_time_factor: None,
            buses: &[],
        };
        for (judge, steps) in [
            (&mut self.judge, &mut self.footsteps),
            (&mut self.bounces, &mut self.contacts),
        ] {
            let _ = judge.finish(&at_end);
            steps.extend_from_slice(judge.closed());
            steps.sort_by_key(|step| (step.touch_down, step.leg));
        }
        self.cycles
            .extend(self.judge.load_cycles().iter().map(measured));
        let contacts = |steps: &[Footstep]| steps.iter().map(contact).collect();
        GaitRun {
            legs: self.judge.legs().map(str::to_owned).collect(),
            footsteps: contacts(&self.footsteps),
            contacts: contacts(&self.contacts),
            cycles: self.cycles,
            oscillators: self.phases,
            motion: self.motion,
            fell_at_s: self.judge.fell_at().map(SimTime::as_secs_f64),
            end_s: end.as_secs_f64(),
        }
    }
}

fn contact(step: &Footstep) -> FootContact {
    FootContact {
        leg: step.leg,
        touch_down_s: step.touch_down.as_secs_f64(),
        lift_off_s: step.lift_off.map(SimTime::as_secs_f64),
        position_m: step.position,
        impulse_n_s: step.impulse,
        slip_m: step.slip,
    }
}

fn measured(cycle: &LoadCycle) -> MeasuredCycle {
    MeasuredCycle {
        centre_s: cycle.centre.as_secs_f64(),
        period_s: cycle.period.as_secs_f64(),
        phases: cycle.legs.iter().map(|leg| leg.phase).collect(),
        contacts: cycle.legs.iter().map(|leg| leg.contacts).collect(),
    }
}

impl Observer for FootstepObserver {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        self.judge.samples(now, group, values);
        self.bounces.samples(now, group, values);
        self.footsteps.extend_from_slice(self.judge.closed());
        self.contacts.extend_from_slice(self.bounces.closed());
        self.cycles
            .extend(self.judge.load_cycles().iter().map(measured));
        if let (Group::ProcessOutputs, Some(phases)) = (group, &self.oscillators)
            && now >= self.next_phases
        {
            self.phases.push(PhaseSample {
                at_s: now.as_secs_f64(),
                phases_rad: phases.iter().map(|phase| values[*phase]).collect(),
            });
            self.next_phases = now + PHASE_PERIOD;
        }
        if let (Group::Plant, Some([position, angles])) = (group, self.trunk) {
            self.slip.sample(values);
            if now >= self.next_motion {
                self.motion.push(MotionSample {
                    at_s: now.as_secs_f64(),
                    trunk_m: [values[position], values[position + 1]],
                    yaw_rad: values[angles + 2],
                    slip_m: self.slip.path_m(),
                });
                self.next_motion = now + SLICE;
            }
        }
    }

    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.judge.event(now, event);
    }
}

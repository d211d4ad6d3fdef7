//! Observer of the loads that a controller takes, and of those of the plant.

use serde::{Deserialize, Serialize};
use twinrig_gait::low_pass;
use twinrig_kernel::{Layout, SimTime, signal};
use twinrig_runtime::{Group, Observer, Rig, RunEvent};
use twinrig_scenario::{Options, Scene};

use crate::{ControlStep, FeedbackRun, GaitRun};

/// Place of the leg in the name of a load.
const LEG: &str = "*";
/// Output of a controller with the phase of a leg.
const PHASE: &str = "phase";

/// Signal from which a controller takes its loads.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct LoadSource {
    /// Name, with `*` for the leg.
    pub(crate) name: String,
    component: usize,
}

impl LoadSource {
    /// Returns the source in the options of a controller.
    pub(crate) fn of(options: &Options) -> Self {
        let own = || signal::of_leg(LEG, signal::FOOT_LOAD);
        let component = options.text("load_component");
        let component = ["x", "y", "z"]
            .into_iter()
            .position(|it| Some(it) == component);
        Self {
            name: options.text("load").map_or_else(own, str::to_owned),
            component: component.unwrap_or(0),
        }
    }

    /// Returns the name for a leg.
    pub(crate) fn of_leg(&self, leg: &str) -> String {
        self.name.replace(LEG, leg)
    }
}

/// Records every step of a controller, and the loads of the plant.
pub(crate) struct LoadObserver {
    /// Indices of the loads in the inputs of the process, by leg.
    inputs: Vec<usize>,
    /// Indices of the phases in its outputs.
    phases: Vec<usize>,
    /// Indices of the loads in the outputs of the plant.
    plant: Vec<usize>,
    /// Time constant of the filter of the load \[s\], and its state.
    lag_s: f64,
    filtered: Vec<f64>,
    last: Option<SimTime>,
    run: FeedbackRun,
}

impl LoadObserver {
    pub(crate) fn new(scene: &Scene, rig: &Rig, source: &LoadSource, lag_s: f64) -> Self {
        let legs = || scene.legs.iter().map(|leg| &*leg.name);
        let found = |group: Group, name: &dyn Fn(&str) -> String| -> Vec<usize> {
            let layout: &Layout = rig.layout(group);
            legs()
                .filter_map(|leg| Some(layout.find(&name(leg))?.start))
                .collect()
        };
        let inputs = found(Group::ProcessInputs, &|leg| source.of_leg(leg));
        Self {
            filtered: vec![0.0; inputs.len()],
            inputs: inputs.iter().map(|at| at + source.component).collect(),
            phases: found(Group::ProcessOutputs, &|leg| signal::of_leg(leg, PHASE)),
            plant: found(Group::Plant, &|leg| signal::of_leg(leg, signal::FOOT_LOAD)),
            lag_s,
            last: None,
            run: FeedbackRun::default(),
        }
    }

    pub(crate) fn finish(self, gait: GaitRun) -> FeedbackRun {
        FeedbackRun { gait, ..self.run }
    }

    fn take(&mut self, now: SimTime, inputs: &[f64]) {
        let elapsed_s = self.last.map_or(0.0, |last| (now - last).as_secs_f64());
        self.last = Some(now);
        for (filtered, at) in self.filtered.iter_mut().zip(&self.inputs) {
            // As the rule does: a load that is negative or no number is none.
            let load = inputs.get(*at).copied().filter(|load| load.is_finite());
            let load = load.unwrap_or(0.0).max(0.0);
            *filtered = low_pass(*filtered, load, self.lag_s, elapsed_s);
        }
        self.run.control.push(ControlStep {
            at_s: now.as_secs_f64(),
            loads_n: self.filtered.clone(),
            ..ControlStep::default()
        });
    }

    fn command(&mut self, outputs: &[f64]) {
        let Some(step) = self.run.control.last_mut() else {
            return;
        };
        let outputs = outputs.iter().enumerate();
        let (phases, commands): (Vec<_>, Vec<_>) =
            outputs.partition(|(place, _)| self.phases.contains(place));
        let values = |of: Vec<(usize, &f64)>| of.into_iter().map(|(_, value)| *value).collect();
        step.phases_rad = values(phases);
        step.commands = values(commands);
    }
}

impl Observer for LoadObserver {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        match group {
            Group::ProcessInputs => self.take(now, values),
            Group::ProcessOutputs => self.command(values),
            Group::Plant => {
                let loads = self.plant.iter().filter_map(|at| values.get(*at));
                self.run.loads_n.push(loads.copied().collect());
                self.run.observed_s.push(now.as_secs_f64());
            }
            Group::Diagnostics => {}
        }
    }

    fn event(&mut self, _: SimTime, _: RunEvent) {}
}

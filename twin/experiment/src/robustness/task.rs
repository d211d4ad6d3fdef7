//! Members of ensembles as tasks of an engine.

use serde::{Deserialize, Serialize};
use twinrig_campaign::sweep::SweepRow;
use twinrig_kernel::{SimDuration, SimTime, Unit, signal};
use twinrig_rig::assembly::Assembly;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::observers::{RunLayouts, RunObserver};
use twinrig_runtime::Group;
use twinrig_scenario::{Footstep, Varied};

use super::{MemberRun, Trajectory};
use crate::ensemble::Ensemble;
use crate::error::{Error, first_line};
use crate::parallel::RunResult;
use crate::runs::rounds::{StudyRuns, run_on_worker};
use crate::runs::scene::RunScene;

/// Greatest number of instants of a trajectory.
const INSTANTS: u64 = 2000;

/// Member of an ensemble: 0 is the unperturbed one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct MemberTask {
    pub(super) scene: usize,
    pub(super) member: usize,
    /// Size of the ensemble, on which the perturbations depend.
    pub(super) of: usize,
}

/// A scenario whose positions are observed, and its ensemble.
pub(crate) struct MemberScene<'r> {
    files: RunScene,
    ensemble: Ensemble<Assembly<'r>>,
}

impl<'r> MemberScene<'r> {
    pub(super) fn new(
        files: RunScene,
        assembly: &Assembly<'r>,
        runs: usize,
    ) -> Result<Self, Error> {
        let mut scenario = assembly.scenario().clone();
        scenario.record.signals = Some(Vec::new());
        scenario.record.frames = None;
        let names = positions(assembly).into_iter().map(|(name, _)| name);
        let names: Vec<String> = names.collect();
        let assembly = assembly.with_scenario(&scenario, &names)?;
        let ensemble = Ensemble::new(assembly, runs, Varied::Start)?;
        Ok(Self { files, ensemble })
    }

    pub(super) fn ensemble(&self) -> &Ensemble<Assembly<'r>> {
        &self.ensemble
    }

    fn run(&self, member: usize) -> RunResult<MemberRun> {
        let mut observer = TrajectoryObserver::new(self.ensemble.assembly());
        let row = self.ensemble.run(member, Some(&mut observer));
        let row = row.map_err(|error| error.to_string())?;
        Ok(observer.finish(row))
    }
}

/// Members of ensembles.
pub(crate) struct MemberRuns<'s, 'r>(pub(super) &'s [MemberScene<'r>]);

impl StudyRuns for MemberRuns<'_, '_> {
    type Task = MemberTask;
    type Run = MemberRun;
    const NAME: &'static str = "member";

    fn scenes(&self) -> Vec<&RunScene> {
        self.0.iter().map(|scene| &scene.files).collect()
    }

    fn scene_of(task: &MemberTask) -> usize {
        task.scene
    }

    fn run(&self, task: &MemberTask) -> RunResult<MemberRun> {
        self.0[task.scene].run(task.member)
    }
}

/// Does a task of another process.
pub(crate) fn run_member(
    registry: &Registry,
    scenes: &[RunScene],
    task: &[u8],
) -> Result<Option<Vec<u8>>, String> {
    run_on_worker::<MemberRuns<'_, '_>>(scenes, task, |files, task| {
        let scene = files.assembly(registry, &[]).map_err(Error::from);
        let scene = scene.and_then(|it| MemberScene::new(files.clone(), &it, task.of));
        let scene = scene.map_err(|error| first_line(&error.to_string()))?;
        scene.run(task.member)
    })
}

/// Returns the observed positions of a plant with their units: trunk and feet, or of a plant
/// without them all positions and lifts.
pub(super) fn positions(assembly: &Assembly<'_>) -> Vec<(String, Unit)> {
    let of = |ends: &[&str]| -> Vec<(String, Unit)> {
        let outputs = assembly.plant_outputs().iter();
        let found = outputs.filter(|port| {
            let has_end = |end: &&str| port.name.ends_with(end);
            ends.iter().any(has_end) && [Unit::Meter, Unit::Radian].contains(&port.unit)
        });
        found.map(|port| (port.name.clone(), port.unit)).collect()
    };
    let trunk_and_feet = of(&[signal::BODY_POSITION, signal::FOOT_POSITION]);
    if trunk_and_feet.is_empty() {
        of(&["/position", "/lift"])
    } else {
        trunk_and_feet
    }
}

/// Keeps positions and the times of touch-downs.
struct TrajectoryObserver {
    names: Vec<String>,
    period: SimDuration,
    next: SimTime,
    /// Ranges in the samples of the plant.
    ranges: Vec<std::ops::Range<usize>>,
    trajectory: Trajectory,
    /// Leg and time.
    touch_downs: Vec<(usize, SimTime)>,
}

impl TrajectoryObserver {
    fn new(assembly: &Assembly<'_>) -> Self {
        let scenario = assembly.scenario();
        let names = positions(assembly).into_iter().map(|(name, _)| name);
        Self {
            names: names.collect(),
            period: SimDuration::from_nanos(scenario.duration.as_nanos() / INSTANTS),
            next: SimTime::ZERO,
            ranges: Vec::new(),
            trajectory: Trajectory::default(),
            touch_downs: Vec::new(),
        }
    }

    fn finish(self, row: SweepRow) -> MemberRun {
        let touch_downs = self.touch_downs.iter().enumerate();
        let strides = touch_downs.filter_map(|(index, (leg, at))| {
            let mut later = self.touch_downs[index + 1..].iter();
            let (_, next) = later.find(|(other, _)| other == leg)?;
            Some((*next - *at).as_secs_f64())
        });
        MemberRun {
            row,
            strides_s: strides.collect(),
            trajectory: self.trajectory,
        }
    }
}

impl RunObserver for TrajectoryObserver {
    fn begin(&mut self, layouts: &RunLayouts<'_>) {
        let layout = layouts.layout(Group::Plant);
        let names = self.names.iter();
        self.ranges = names.filter_map(|name| layout.find(name)).collect();
        self.trajectory.sizes = self.ranges.iter().map(ExactSizeIterator::len).collect();
    }

    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if group != Group::Plant || now < self.next {
            return;
        }
        self.next = now + self.period;
        self.trajectory.at_s.push(now.as_secs_f64());
        for range in &self.ranges {
            let values = &values[range.clone()];
            self.trajectory.values.extend_from_slice(values);
        }
    }

    fn footstep(&mut self, footstep: &Footstep) {
        self.touch_downs.push((footstep.leg, footstep.touch_down));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runs::scene::tests::trot;

    #[test]
    fn stride_is_the_time_to_the_next_touch_down_of_the_same_leg() {
        let registry = Registry::standard();
        let scene = trot(&registry, "'1 s'", None);
        let mut observer = TrajectoryObserver::new(&scene.assembly(&registry, &[]).unwrap());
        let at = |ms| SimTime::ZERO + SimDuration::from_millis(ms);
        observer.touch_downs = vec![(0, at(0)), (1, at(125)), (0, at(250)), (1, at(625))];
        let run = observer.finish(SweepRow::of_error(""));
        assert_eq!(run.strides_s, [0.25, 0.5]);
    }
}

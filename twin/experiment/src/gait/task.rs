//! Runs of gaits as tasks of an engine.

use serde::{Deserialize, Serialize};
use twinrig_kernel::SimTime;
use twinrig_rig::registry::Registry;
use twinrig_runtime::Change;
use twinrig_scenario::ChangeSpec;

use super::run::GaitRun;
use super::scene::{Factor, GaitScene};
use crate::error::first_line;
use crate::parallel::RunResult;
use crate::runs::rounds::{StudyRuns, run_on_worker};
use crate::runs::scene::RunScene;

/// Run of a gait: all that it depends on beside its scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct GaitTask {
    scene: usize,
    factor: Factor,
    /// Time \[ns\], variable and amount of each change.
    changes: Vec<(u64, String, Change)>,
    /// End \[ns\].
    end: u64,
}

impl GaitTask {
    /// Returns the run of a scene with these changes up to `end`, or up to a fall.
    pub(crate) fn new(
        scene: usize,
        factor: Factor,
        changes: Vec<ChangeSpec>,
        end: SimTime,
    ) -> Self {
        let changes = changes.into_iter();
        Self {
            scene,
            factor,
            changes: changes
                .map(|it| (it.at.as_nanos(), it.variable, it.change))
                .collect(),
            end: end.as_nanos(),
        }
    }

    fn changes(&self) -> Vec<ChangeSpec> {
        let changes = self.changes.iter().cloned();
        let change = |(at, variable, change)| ChangeSpec {
            at: SimTime::from_nanos(at),
            variable,
            change,
        };
        changes.map(change).collect()
    }

    fn run(&self, scene: &GaitScene<'_>) -> RunResult<GaitRun> {
        scene.run(self.factor, self.changes(), SimTime::from_nanos(self.end))
    }
}

/// Runs of gaits.
pub(crate) struct GaitRuns<'s, 'r>(pub(crate) &'s [GaitScene<'r>]);

impl StudyRuns for GaitRuns<'_, '_> {
    type Task = GaitTask;
    type Run = GaitRun;
    const NAME: &'static str = "gait";

    fn scenes(&self) -> Vec<&RunScene> {
        self.0.iter().map(GaitScene::files).collect()
    }

    fn scene_of(task: &GaitTask) -> usize {
        task.scene
    }

    fn run(&self, task: &GaitTask) -> RunResult<GaitRun> {
        task.run(&self.0[task.scene])
    }
}

/// Does a task of another process.
pub(crate) fn run_gait(
    registry: &Registry,
    scenes: &[RunScene],
    task: &[u8],
) -> Result<Option<Vec<u8>>, String> {
    run_on_worker::<GaitRuns<'_, '_>>(scenes, task, |files, task| {
        task.run(&worker_scene(registry, files)?)
    })
}

/// Reads a scene on a worker.
pub(crate) fn worker_scene<'r>(
    registry: &'r Registry,
    files: &RunScene,
) -> RunResult<GaitScene<'r>> {
    let scene = GaitScene::on_worker(registry, files);
    scene.map_err(|error| first_line(&error.to_string()))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use twinrig_kernel::SimDuration;

    use super::*;

    #[test]
    fn run_has_the_factor_of_its_task() {
        let registry = Registry::standard();
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../scenarios/trot-slow-servo.toml"
        );
        let scenes = [GaitScene::new(&registry, Path::new(path), &[], None).unwrap()];
        let run = |factor| {
            let end = SimTime::ZERO + SimDuration::from_millis(600);
            GaitRuns(&scenes).run(&GaitTask::new(0, factor, Vec::new(), end))
        };
        assert_ne!(run(Factor::AsGiven), run(Factor::UnsaturatedServos));
    }
}

//! Runs of a controller with feedback of loads as tasks of an engine.

use serde::{Deserialize, Serialize};
use twinrig_rig::registry::Registry;

use super::FeedbackRun;
use super::load_observer::{LoadObserver, LoadSource};
use crate::gait::scene::GaitScene;
use crate::gait::task::worker_scene;
use crate::parallel::RunResult;
use crate::runs::rounds::{StudyRuns, run_on_worker};
use crate::runs::scene::RunScene;

/// Run with feedback: all that it depends on beside its scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LoadTask {
    pub(super) scene: usize,
    pub(super) source: LoadSource,
    /// Time constant of the controller's filter of the load \[s\].
    pub(super) lag_s: f64,
}

impl LoadTask {
    fn run(&self, scene: &GaitScene<'_>) -> RunResult<FeedbackRun> {
        let (gait, loads) =
            scene.run_with(|scene, rig| LoadObserver::new(scene, rig, &self.source, self.lag_s))?;
        Ok(loads.finish(gait))
    }
}

/// Runs with feedback.
pub(crate) struct LoadRuns<'s, 'r>(pub(super) &'s [GaitScene<'r>]);

impl StudyRuns for LoadRuns<'_, '_> {
    type Task = LoadTask;
    type Run = FeedbackRun;
    const NAME: &'static str = "load";

    fn scenes(&self) -> Vec<&RunScene> {
        self.0.iter().map(GaitScene::files).collect()
    }

    fn scene_of(task: &LoadTask) -> usize {
        task.scene
    }

    fn run(&self, task: &LoadTask) -> RunResult<FeedbackRun> {
        task.run(&self.0[task.scene])
    }
}

/// Does a task of another process.
pub(crate) fn run_load(
    registry: &Registry,
    scenes: &[RunScene],
    task: &[u8],
) -> Result<Option<Vec<u8>>, String> {
    run_on_worker::<LoadRuns<'_, '_>>(scenes, task, |files, task| {
        task.run(&worker_scene(registry, files)?)
    })
}

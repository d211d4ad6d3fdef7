//! Judged runs of scenes with further settings.

use serde::{Deserialize, Serialize};
use twinrig_campaign::sweep::SweepRow;
use twinrig_rig::error::{Error as RigError, guarded};
use twinrig_rig::registry::Registry;
use twinrig_rig::report::row;
use twinrig_rig::run::execute::execute_until;
use twinrig_rig::run::execution::Execution;
use twinrig_scenario::Setting;

use super::rounds::{StudyRuns, run_on_worker};
use super::scene::RunScene;
use crate::parallel::RunResult;

/// Run of a scene with further settings: key and value in TOML.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct JudgedTask {
    pub(crate) scene: usize,
    pub(crate) settings: Vec<(String, String)>,
}

impl JudgedTask {
    /// Runs the scene. A run that cannot start, or panics, is a row with the error.
    fn run(&self, registry: &Registry, scene: &RunScene) -> SweepRow {
        let settings = self.settings.iter().map(|(key, value)| Setting {
            origin: "study".to_owned(),
            key: key.clone(),
            value: value.clone(),
        });
        let settings: Vec<Setting> = settings.collect();
        let report = guarded::<_, RigError>(scene.file(), || {
            let assembly = scene.assembly(registry, &settings)?;
            execute_until(&assembly, &Execution::default(), assembly.end())
        });
        match report {
            Ok(report) => row::of_report(report),
            Err(error) => SweepRow::of_error(error.to_string()),
        }
    }
}

/// Judged runs.
pub(crate) struct JudgedRuns<'r> {
    pub(crate) registry: &'r Registry,
    pub(crate) scenes: Vec<RunScene>,
}

impl StudyRuns for JudgedRuns<'_> {
    type Task = JudgedTask;
    type Run = SweepRow;
    const NAME: &'static str = "judged";

    fn scenes(&self) -> Vec<&RunScene> {
        self.scenes.iter().collect()
    }

    fn scene_of(task: &JudgedTask) -> usize {
        task.scene
    }

    fn run(&self, task: &JudgedTask) -> RunResult<SweepRow> {
        Ok(task.run(self.registry, &self.scenes[task.scene]))
    }
}

/// Does a task of another process.
pub(crate) fn run_judged(
    registry: &Registry,
    scenes: &[RunScene],
    task: &[u8],
) -> Result<Option<Vec<u8>>, String> {
    run_on_worker::<JudgedRuns<'_>>(scenes, task, |scene, task| Ok(task.run(registry, scene)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runs::scene::tests::trot;

    #[test]
    fn task_is_run_on_its_scene() {
        let registry = Registry::standard();
        let scene = |duration| trot(&registry, duration, None);
        let runs = JudgedRuns {
            registry: &registry,
            scenes: vec![scene("'10 ms'"), scene("'20 ms'")],
        };
        for (scene, end_s) in [0.01, 0.02].into_iter().enumerate() {
            let settings = vec![("seed".to_owned(), "7".to_owned())];
            let row = runs.run(&JudgedTask { scene, settings }).unwrap();
            assert_eq!(
                (row.simulated_s, row.seed),
                (Some(end_s), Some(7)),
                "{row:?}"
            );
        }
    }
}

//! Rounds of runs that give a number.

use twinrig_campaign::engine::{Engine, EngineError, EngineEvent, EngineOptions, EngineStatus};
use twinrig_scenario::Setting;

use super::*;

const SCENARIO: &str = "robot = 'cheetah-cub'\nduration = '1 s'\n[plant]\nmodel = 'massless'\n";

const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/cheetah-cub.toml");

/// Numbers of a scene.
struct Numbers(Vec<RunScene>);

impl StudyRuns for Numbers {
    type Task = (usize, u64);
    type Run = u64;
    const NAME: &'static str = "number";

    fn scenes(&self) -> Vec<&RunScene> {
        self.0.iter().collect()
    }

    fn scene_of(task: &(usize, u64)) -> usize {
        task.0
    }

    fn run(&self, task: &(usize, u64)) -> RunResult<u64> {
        Ok(task.1)
    }
}

fn key(scene: RunScene, task: u64, build: u8) -> RowKey {
    key_of(vec![scene], (0, task), build)
}

fn key_of(scenes: Vec<RunScene>, task: (usize, u64), build: u8) -> RowKey {
    let build = BuildKey::of_key(&[build; 32]).unwrap();
    RoundJob::new(&Numbers(scenes), &[task], build).keys[0]
}

/// Reads a scenario from a folder of its own, which has a robot file, in `heavier` with another
/// mass.
fn scene(name: &str, text: &str, set: &[(&str, &str)], plant: Option<&str>) -> RunScene {
    let folder = format!("twinrig-rounds-{}-{name}", std::process::id());
    let folder = std::env::temp_dir().join(folder);
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let mass = if name == "heavier" { "950 g" } else { "900 g" };
    let robot = std::fs::read_to_string(ROBOT).unwrap();
    let robot = robot.replace("mass = \"900 g\"", &format!("mass = \"{mass}\""));
    std::fs::write(folder.join("cub.toml"), robot).unwrap();
    let settings = set.iter().map(|(key, value)| Setting {
        origin: "--set".to_owned(),
        key: (*key).to_owned(),
        value: (*value).to_owned(),
    });
    let settings: Vec<Setting> = settings.collect();
    let registry = Registry::standard();
    let read = RunScene::read(&registry, &path, &settings, plant);
    let (scene, _) = read.unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    scene
}

#[test]
fn key_depends_on_everything_that_changes_a_run_and_on_nothing_else() {
    let plain = || scene("a", SCENARIO, &[], None);
    let other_duration = SCENARIO.replace("1 s", "2 s");
    let other_robot = SCENARIO.replace("cheetah-cub", "oncilla");
    let own_robot = SCENARIO.replace("cheetah-cub", "cub.toml");
    let different = [
        key(plain(), 1, 0),
        key(plain(), 2, 0),
        key(plain(), 1, 1),
        key(scene("a", &other_duration, &[], None), 1, 0),
        key(scene("a", &other_robot, &[], None), 1, 0),
        key(scene("a", SCENARIO, &[("seed", "2")], None), 1, 0),
        key(scene("a", SCENARIO, &[("seed", "3")], None), 1, 0),
        key(scene("a", SCENARIO, &[], Some("massless")), 1, 0),
        key(scene("a", SCENARIO, &[], Some("lcp")), 1, 0),
        key(scene("a", &own_robot, &[], None), 1, 0),
        key(scene("heavier", &own_robot, &[], None), 1, 0),
        key_of(vec![plain(), plain()], (1, 1), 0),
        key_of(
            vec![plain(), scene("a", &other_duration, &[], None)],
            (1, 1),
            0,
        ),
    ];
    let keys: BTreeSet<RowKey> = different.iter().copied().collect();
    assert_eq!(keys.len(), different.len());
    // The same files in another folder, as on another machine.
    assert_eq!(key(scene("b", SCENARIO, &[], None), 1, 0), different[0]);
}

#[test]
fn scene_of_a_worker_is_that_of_the_files() {
    let here = scene("c", SCENARIO, &[("duration", "'3 s'")], Some("lcp"));
    let registry = Registry::standard();
    let bytes = encoded(&here);
    let there: RunScene = postcard::from_bytes(&bytes).unwrap();
    let assembly = there.assembly(&registry, &[]).unwrap();
    assert_eq!(assembly.scenario().plant.model, "lcp");
    assert_eq!(assembly.scenario().duration.as_secs_f64(), 3.0);
}

#[test]
fn rounds_run_equal_tasks_once_and_later_calls_none() {
    let folder = folder("equal");
    let registry = Registry::standard();
    let runs = Numbers(vec![scene("d", SCENARIO, &[], None)]);
    let tasks = [(0, 5), (0, 6), (0, 5)];
    for stored in [0, 2] {
        let mut engine = kept(&registry, &folder, Partition::WHOLE);
        let mut parts = Vec::new();
        let mut observer = |part: usize, of: usize| parts.push((part, of));
        let mut watch = Watch(&mut observer);
        let done = engine.round(&runs, &tasks, RoundShare::Every, &mut watch);
        assert_eq!(done.unwrap(), [Ok(5), Ok(6), Ok(5)]);
        let text = std::fs::read_to_string(folder.join("number/all.jsonl")).unwrap();
        assert_eq!(text.lines().count(), 2, "after {stored} stored");
        assert!(parts.iter().all(|(part, of)| part <= of));
        // An equal task is not one of an earlier call.
        assert_eq!(notes(&engine).contains("of earlier calls"), stored > 0);
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn notes_have_the_runs_of_earlier_calls_and_damaged_lines() {
    let folder = folder("notes");
    let registry = Registry::standard();
    let runs = Numbers(vec![scene("e", SCENARIO, &[], None)]);
    let all = [(0, 5), (0, 6), (0, 7)];
    let mut earlier = kept(&registry, &folder, Partition::WHOLE);
    earlier
        .round(&runs, &all[..2], RoundShare::Every, &mut ())
        .unwrap();
    assert_eq!(notes(&earlier), "");
    std::fs::write(folder.join("number/other.jsonl"), "no row\n").unwrap();
    let mut engine = kept(&registry, &folder, Partition::WHOLE);
    let mut last = (0, 0);
    let mut observer = |part: usize, of: usize| last = (part, of);
    for tasks in [&all[..2], &all[2..]] {
        let mut watch = Watch(&mut observer);
        engine
            .round(&runs, tasks, RoundShare::Every, &mut watch)
            .unwrap();
    }
    assert_eq!(last, (3, 3));
    let notes = notes(&engine);
    assert!(notes.contains("1, and 2 of earlier calls"), "{notes}");
    assert!(notes.contains("1 damaged line in"), "{notes}");
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn partition_that_ends_meanwhile_completes_the_round() {
    let folder = folder("meanwhile");
    let registry = Registry::standard();
    let runs = Numbers(vec![scene("f", SCENARIO, &[], None)]);
    let tasks = [(0, 5), (0, 6)];
    let part = |part| kept(&registry, &folder, Partition { part, of: 2 });
    let (mut one, mut two) = (part(1), part(2));
    let mut other = |_: usize, _: usize| {
        let _ = two.round(&runs, &tasks, RoundShare::Partition, &mut ());
    };
    let done = one.round(&runs, &tasks, RoundShare::Partition, &mut Watch(&mut other));
    assert_eq!(done.unwrap(), [Ok(5), Ok(6)]);
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn interruption_counts_the_rounds_before_and_a_lost_run_is_an_error() {
    let registry = Registry::standard();
    let runs = Numbers(vec![scene("g", SCENARIO, &[], None)]);
    let mut engine = StudyEngine::local(&registry, Path::new("scene.toml")).unwrap();
    engine.workers.engine = &OneByOne { lost: Some(1) };
    engine.expect(5);
    let begun = engine.round(&runs, &[(0, 5)], RoundShare::Every, &mut ());
    assert_eq!(begun.unwrap(), [Ok(5)]);
    let tasks = [(0, 6), (0, 7), (0, 8)];
    let lost = engine.round(&runs, &tasks, RoundShare::Every, &mut ());
    assert!(
        matches!(&lost, Err(Error::LostRuns { count: 1, reason, .. }) if reason == "it died"),
        "{lost:?}"
    );
    let stopped = engine.round(&runs, &tasks, RoundShare::Every, &mut Stop);
    let Err(Error::Study { source, .. }) = stopped else {
        panic!("{stopped:?}");
    };
    assert_eq!(source, StudyError::Interrupted { done: 2, of: 5 });
}

/// Does one task after the other, up to one that is lost.
struct OneByOne {
    lost: Option<usize>,
}

impl Engine for OneByOne {
    fn name(&self) -> &'static str {
        "one by one"
    }

    fn run(
        &self,
        job: &dyn Job,
        tasks: &[usize],
        _: &EngineOptions,
        observer: &mut dyn FnMut(EngineEvent) -> bool,
    ) -> Result<EngineStatus, EngineError> {
        for &task in tasks {
            let event = if self.lost == Some(task) {
                let reason = "it died".to_owned();
                EngineEvent::Lost { task, reason }
            } else {
                let result = Ok(job.run(task).unwrap());
                EngineEvent::Done { task, result }
            };
            if !observer(event) {
                break;
            }
        }
        Ok(EngineStatus::default())
    }
}

struct Stop;

impl ProgressObserver for Stop {
    fn at(&mut self, _: usize, _: usize, _: &str) -> bool {
        false
    }
}

/// Returns a folder of the test with this name.
fn folder(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("twinrig-rounds-{}-rows-{name}", std::process::id()))
}

/// Returns the engine of a partition that keeps rows.
fn kept<'r>(registry: &'r Registry, folder: &Path, partition: Partition) -> StudyEngine<'r> {
    StudyEngine {
        folder: Some(folder.to_owned()),
        partition,
        ..StudyEngine::local(registry, Path::new("scene.toml")).unwrap()
    }
}

/// Returns the notes of an engine as text.
fn notes(engine: &StudyEngine<'_>) -> String {
    let mut summary = Summary::new("", "", String::new());
    engine.note(&mut summary);
    let text = summary.finish(&[]);
    text.split_once('\n')
        .map_or("", |(_, notes)| notes.trim())
        .to_owned()
}

struct Watch<'f>(&'f mut dyn FnMut(usize, usize));

impl ProgressObserver for Watch<'_> {
    fn at(&mut self, part: usize, of: usize, _: &str) -> bool {
        (self.0)(part, of);
        true
    }
}

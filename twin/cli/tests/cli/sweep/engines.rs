//! Engines whose workers have nothing but the bytes of a job.

use proptest::prelude::*;
use twinrig::campaign::engine::{
    Engine, EngineError, EngineEvent, EngineOptions, EngineStatus, Job,
};
use twinrig::{JobError, WorkerJob};

use super::{SEEDS, STAND, Sweep, built};

/// A worker in this process, which does the last task first.
#[derive(Default)]
struct Elsewhere {
    /// File that is damaged before the first task.
    damaged: Option<String>,
    /// Build of the worker.
    build: Option<&'static str>,
    /// Plant that the worker lacks.
    lacks: Option<&'static str>,
    /// Number of tasks after which the cluster is lost.
    ends_after: Option<usize>,
    /// Task that no worker survives.
    fatal: Option<usize>,
}

impl Engine for Elsewhere {
    fn name(&self) -> &'static str {
        "elsewhere"
    }

    fn run(
        &self,
        job: &dyn Job,
        tasks: &[usize],
        _: &EngineOptions,
        observer: &mut dyn FnMut(EngineEvent) -> bool,
    ) -> Result<EngineStatus, EngineError> {
        let failed = |message: String| EngineError::Workers {
            engine: "elsewhere",
            message,
            help: "none".to_owned(),
        };
        if let Some(path) = &self.damaged {
            std::fs::write(path, "no TOML [").unwrap();
        }
        let mut build = built(self.build.unwrap_or("one"));
        if let Some(name) = self.lacks {
            let plants = build.catalogue(None).plants;
            let kind = plants.into_iter().find(|kind| kind.name == name).unwrap();
            build = build.without_plant(kind, "install it");
        }
        let worker = WorkerJob::new(build, &job.shared());
        let worker = worker.map_err(|error| failed(error.to_string()))?;
        for (count, &task) in tasks.iter().rev().enumerate() {
            if self.ends_after == Some(count) {
                return Err(failed("the cluster is lost".to_owned()));
            }
            let event = if self.fatal == Some(task) {
                let reason = "the worker died".to_owned();
                EngineEvent::Lost { task, reason }
            } else {
                let result = worker.run(&job.task(task)).unwrap().unwrap();
                let result = Ok(result);
                EngineEvent::Done { task, result }
            };
            assert!(observer(event));
        }
        Ok(EngineStatus::default())
    }
}

impl Sweep {
    fn stored_rows(&self, out: &str) -> usize {
        let path = self.folder.join(&format!("{out}/rows/all.jsonl"));
        std::fs::read_to_string(path).map_or(0, |text| text.lines().count())
    }

    /// Sweeps by this engine.
    fn elsewhere(&self, out: &str, engine: Elsewhere) -> crate::common::Done {
        let registry = built("one").with_engine(engine);
        self.run_of(&registry, out, &["--engine", "elsewhere"])
    }
}

/// The files are those of the sweep, whatever is on the disk of the worker.
#[test]
fn bytes_of_the_job_give_the_files_of_the_local_engine() {
    let scenario = STAND.replace("cheetah-cub", "own");
    let spec = format!("{SEEDS}[[dimension]]\nkey = 'duration'\nvalues = ['70 ms', '100 ms']\n");
    let sweep = Sweep::new("elsewhere", &scenario, &spec);
    let robots = sweep.folder.join("robots");
    std::fs::create_dir(&robots).unwrap();
    let robot = format!("{robots}/own.toml");
    std::fs::write(
        &robot,
        include_str!("../../../../../robots/cheetah-cub.toml"),
    )
    .unwrap();
    // The shorter runs fail.
    sweep.json(1, "local", &[]);
    let damaged = Some(robot);
    let done = sweep.elsewhere(
        "elsewhere",
        Elsewhere {
            damaged,
            ..Elsewhere::default()
        },
    );
    assert_eq!(done.code, 1, "{done:?}");
    assert_eq!(sweep.files("elsewhere"), sweep.files("local"));
}

#[test]
fn worker_of_another_build_refuses_the_job() {
    let sweep = Sweep::new("build", STAND, SEEDS);
    let build = Some("two");
    let done = sweep.elsewhere(
        "out",
        Elsewhere {
            build,
            ..Elsewhere::default()
        },
    );
    assert_eq!(done.code, 2);
    assert!(
        done.err.contains("the worker has another build"),
        "{}",
        done.err
    );
    assert_eq!(sweep.stored_rows("out"), 0);
}

/// Rows of its errors would stay in the store.
#[test]
fn worker_without_a_plant_of_the_sweep_refuses_the_job() {
    let plants = "[[dimension]]\nkey = 'plant.model'\nvalues = ['massless', 'lcp']\n";
    for (spec, lacks, code) in [
        (plants, "lcp", 2),
        (SEEDS, "massless", 2),
        (SEEDS, "lcp", 0),
    ] {
        let sweep = Sweep::new("lacks", STAND, spec);
        let engine = Elsewhere {
            lacks: Some(lacks),
            ..Elsewhere::default()
        };
        let done = sweep.elsewhere("out", engine);
        assert_eq!(done.code, code, "{done:?}");
        assert_eq!(sweep.stored_rows("out") == 0, code == 2);
        let reason = format!("lacks the plant `{lacks}`\n  = help: install it");
        assert_eq!(done.err.contains(&reason), code == 2, "{}", done.err);
    }
}

#[test]
fn lost_cluster_keeps_its_rows_and_another_engine_continues() {
    let sweep = Sweep::new("lost-cluster", STAND, SEEDS);
    let ends_after = Some(5);
    let done = sweep.elsewhere(
        "out",
        Elsewhere {
            ends_after,
            ..Elsewhere::default()
        },
    );
    assert_eq!((done.code, done.out.as_str()), (2, ""));
    assert!(done.err.contains("the cluster is lost"), "{}", done.err);
    assert_eq!(sweep.stored_rows("out"), 5);
    let done = sweep.run("out", &[]);
    assert!(done.out.contains("5 of earlier calls"), "{}", done.out);
    sweep.json(0, "whole", &[]);
    assert_eq!(sweep.files("out"), sweep.files("whole"));
}

/// Not a row: another worker may survive it.
#[test]
fn run_that_no_worker_survives_is_missing_and_named() {
    let sweep = Sweep::new("fatal", STAND, SEEDS);
    let fatal = Some(3);
    let done = sweep.elsewhere(
        "out",
        Elsewhere {
            fatal,
            ..Elsewhere::default()
        },
    );
    assert_eq!(done.code, 2);
    let expected = "1 of the runs have no result; the first is stand@seed-4: the worker died";
    assert!(done.err.contains(expected), "{}", done.err);
    assert_eq!(sweep.stored_rows("out"), 11);
    assert_eq!(sweep.run("out", &[]).code, 0);
}

#[test]
fn engine_of_another_program_is_an_error_with_its_remedy() {
    let sweep = Sweep::new("no-engine", STAND, SEEDS);
    let done = sweep.run("out", &["--engine", "ray"]);
    assert_eq!(done.code, 2);
    assert!(
        done.err.contains("pip install \"twinrig[ray]\""),
        "{}",
        done.err
    );
    let done = sweep.run("out", &["--engine", "locl"]);
    assert!(done.err.contains("did you mean `local`?"), "{}", done.err);
    let done = sweep.run("out", &["--address", "auto"]);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("`local` has no address"), "{}", done.err);
}

/// Recordings are listed beside the results, which do not name machines.
#[test]
fn recordings_are_where_the_runs_were() {
    let sweep = Sweep::new("record", STAND, SEEDS);
    let folder = sweep.folder.join("recordings");
    let record = ["--record", &folder];
    sweep.json(0, "local", &record);
    let list = std::fs::read_to_string(sweep.folder.join("local/recordings.csv")).unwrap();
    let mut lines = list.lines();
    assert_eq!(lines.next(), Some("key,machine,path"));
    assert_eq!(lines.clone().count(), 12);
    let rows = sweep.files("local").remove(0);
    for line in lines {
        let [key, _, path] = line.split(',').collect::<Vec<_>>()[..] else {
            panic!("{line}")
        };
        assert!(rows.contains(key) && !rows.contains(&folder));
        let recording = std::fs::metadata(path.trim_matches('"')).unwrap();
        assert!(recording.len() > 1000);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damaged_job_is_an_error(bytes in prop::collection::vec(any::<u8>(), 0..60), is_job: bool) {
        let start = if is_job { b"twinjob1".to_vec() } else { Vec::new() };
        let read = WorkerJob::new(built("one"), &[start, bytes].concat());
        let is_refused = matches!(
            read.err(),
            Some(JobError::Damaged(_) | JobError::OtherBuild { .. })
        );
        prop_assert!(is_refused);
    }
}

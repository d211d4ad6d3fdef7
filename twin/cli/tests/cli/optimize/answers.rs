use twinrig::WorkerJob;
use twinrig::campaign::engine::{
    Engine, EngineError, EngineEvent, EngineOptions, EngineStatus, Job,
};

use super::{Optimization, SPACE, WALK, built};

/// Both methods: the files are the same, byte for byte.
#[test]
fn number_of_workers_has_no_influence_and_the_seed_has() {
    for method in ["cma-es", "pso"] {
        let space = format!("method = '{method}'\nconstraints = ['level']\n{SPACE}");
        let optimization = Optimization::new(method, WALK, &space);
        let one = optimization.json(0, "one", &["--jobs", "1"]);
        for jobs in ["2", "3"] {
            optimization.json(0, jobs, &["--jobs", jobs]);
            assert_eq!(optimization.files(jobs), optimization.files("one"));
        }
        let other = optimization.json(0, "other", &["--seed", "2"]);
        assert_ne!(other["hash"], one["hash"]);
        // The best of all generations is the last entry of the history, and never gets worse.
        let history = one["history"].as_array().unwrap();
        let costs = history.iter().map(|it| it["cost"].as_f64().unwrap());
        assert!(costs.is_sorted_by(|one, next| one >= next));
        assert_eq!(history.last().unwrap()["best"], one["best"]["objective"]);
        // Its last line has the values of the best point, as `points.csv` has them.
        let (history, points) = ["history.csv", "points.csv"]
            .map(|name| optimization.read("one", name))
            .into();
        let number = usize::try_from(one["best"]["number"].as_u64().unwrap()).unwrap();
        let point = points.lines().nth(number).unwrap();
        let values = point.split(',').skip(1).take(2);
        let last = history.lines().last().unwrap().split(',').skip(6);
        assert!(last.eq(values), "{history}");
        assert_eq!(one["counts"]["evaluations"], 30);
    }
}

/// A worker in this process, which has nothing but the bytes of the job.
pub(super) struct Elsewhere;

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
        let worker = WorkerJob::new(built(), &job.shared()).unwrap();
        for &task in tasks.iter().rev() {
            let result = Ok(worker.run(&job.task(task)).unwrap().unwrap());
            assert!(observer(EngineEvent::Done { task, result }));
        }
        Ok(EngineStatus::default())
    }
}

#[test]
fn another_engine_has_the_same_answer() {
    let optimization = Optimization::new("engine", WALK, SPACE);
    optimization.json(0, "local", &[]);
    let registry = built().with_engine(Elsewhere);
    let done = optimization.run_of(&registry, "elsewhere", &["--engine", "elsewhere"]);
    assert_eq!(done.code, 0, "{done:?}");
    assert_eq!(optimization.files("elsewhere"), optimization.files("local"));
}

/// Of a constraint that no point meets; and of runs that all have an error.
#[test]
fn search_without_a_feasible_point_fails_and_shows_the_best_one() {
    let space = format!("constraints = ['level']\n{SPACE}");
    let strict = WALK.replace("12 deg", "0.001 deg");
    let optimization = Optimization::new("infeasible", &strict, &space);
    let result = optimization.json(1, "out", &[]);
    assert_eq!(result["verdict"], "infeasible");
    assert_eq!(result["counts"]["feasible"], 0);
    let done = optimization.run("out", &[]);
    assert!(
        done.out
            .contains("INFEASIBLE  no point meets all constraints"),
        "{}",
        done.out
    );
    // A plant that fails in every run.
    let snapping = "robot = 'cheetah-cub'\nduration = '1 s'\nplant = { model = 'snapping' }\n\
                    [[expect]]\nname = 'speed'\nbody = { speed = { min = '1 m/s' } }\n";
    let space = "maximize = 'speed'\niterations = 1\n\
                 dimension = [{ key = 'fall.height', from = 0.1, to = 0.2 }]";
    let optimization = Optimization::new("errors", snapping, space);
    let result = optimization.json(1, "out", &[]);
    assert_eq!(
        result["counts"]["error"], result["counts"]["evaluations"],
        "{result}"
    );
    assert!(
        result["error"].as_str().unwrap().contains("it snapped"),
        "{result}"
    );
    assert_eq!(result["history"][1]["best"], serde_json::Value::Null);
    assert!(!std::fs::exists(optimization.folder.join("out/best.toml")).unwrap());
}

/// Known points are not run again: more iterations continue from the rows on disk.
#[test]
fn more_iterations_continue() {
    let optimization = Optimization::new("more", WALK, &format!("method = 'pso'\n{SPACE}"));
    let first = optimization.run("out", &["--iterations", "2"]);
    assert!(first.out.contains("18 runs in"), "{}", first.out);
    let second = optimization.run("out", &[]);
    assert!(second.out.contains("12 runs in"), "{}", second.out);
    optimization.run("whole", &[]);
    assert_eq!(optimization.files("out"), optimization.files("whole"));
}

/// An expectation of few samples is unobserved, whether its bound holds or not: a search must not
/// find the point that violates it most because that has a value.
#[test]
fn objective_has_its_value_on_both_sides_of_its_bound() {
    let few = "[[expect]]\nname = 'ahead'\nafter = '1190 ms'\nbefore = '1194 ms'\n\
               signal = { name = 'body/position', component = 'x', always = { min = 'BOUND' } }\n";
    let value = |test: &str, bound: &str, space: &str, code: u8| {
        let scenario = format!("{WALK}{}", few.replace("BOUND", bound));
        Optimization::new(test, &scenario, space).json(code, "out", &[])
    };
    let space = SPACE.replace("'speed'", "'ahead'");
    let below = value("few-below", "-10 m", &space, 0);
    let above = value("few-above", "10 m", &space, 0);
    assert_eq!(below["best"]["objective"], above["best"]["objective"]);
    assert_eq!(below["best"]["point"], above["best"]["point"]);
}

/// A search in which the objective cannot be observed is no search.
#[test]
fn search_without_values_fails_and_says_why() {
    let scenario = format!(
        "{WALK}[[expect]]\nname = 'late'\nafter = '1191 ms'\nbefore = '1191500 us'\n\
         signal = {{ name = 'body/position', component = 'x', always = {{ min = '-10 m' }} }}\n"
    );
    let space = SPACE
        .replace("'speed'", "'late'")
        .replace("'2 m'", "'6 cm'");
    let optimization = Optimization::new("no-values", &scenario, &space);
    let result = optimization.json(1, "out", &[]);
    assert_eq!(result["verdict"], "unobserved", "{result}");
    assert_eq!(
        result["unobserved"],
        "there is no observation in its window"
    );
    let text = optimization.run("out", &[]).out;
    assert!(text.contains("late has no value in "), "{text}");
}

/// The found point of one robot is not replaced by a point of another one.
#[test]
fn folder_of_another_search_is_refused() {
    let optimization = Optimization::new("foreign", WALK, SPACE);
    let first = optimization.json(0, "out", &["--iterations", "0"]);
    let best = optimization.read("out", "best.toml");
    let other = optimization.run("out", &["--iterations", "0", "--set", "seed=2"]);
    assert_eq!(other.code, 2, "{other:?}");
    assert!(other.err.contains("with other settings") && other.err.contains("--out DIR"));
    assert_eq!(optimization.read("out", "best.toml"), best);
    let again = optimization.json(0, "out", &["--iterations", "0"]);
    assert_eq!(again["hash"], first["hash"]);
}

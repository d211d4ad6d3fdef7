//! End-to-end tests of `twin study` with toy plants.

use std::path::Path;

use crate::common::{Done, Folder, json, registry, study_result, twin, twin_of};
use twinrig::Method;
use twinrig::kernel::{Port, SimDuration, SimTime, Unit};
use twinrig::runtime::{EnergyBalance, Plant, PlantFault, WorkCounts};
use twinrig::{PlantKind, Registry};

/// Foot on a spring that follows the command of the first hip, integrated by explicit or
/// semi-implicit Euler.
struct Spring {
    /// Panics at its first step.
    cracks: bool,
    ports: Vec<Port>,
    implicit: bool,
    step: SimDuration,
    omega_squared: f64,
    now: SimTime,
    state: [f64; 2],
    steps: u64,
}

impl Plant for Spring {
    fn name(&self) -> &'static str {
        "spring"
    }

    fn ports(&self) -> Vec<Port> {
        self.ports.clone()
    }

    fn advance(&mut self, to: SimTime, inputs: &[f64]) -> Result<(), PlantFault> {
        assert!(!self.cracks, "it cracked");
        let aim = inputs.first().map_or(0.0, |command| 0.1 * command);
        while self.now < to {
            let next = to.min(self.now + self.step);
            let h = (next - self.now).as_secs_f64();
            let [x, v] = self.state;
            let faster = v - h * (self.omega_squared * (x - aim) + 20.0 * v);
            let along = if self.implicit { faster } else { v };
            self.state = [x + h * along, faster];
            self.now = next;
            self.steps += 1;
        }
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&[self.state[0], 0.0, 0.0]);
    }

    fn energy(&self) -> EnergyBalance {
        EnergyBalance {
            kinetic: 0.5 * self.state[1] * self.state[1],
            ..EnergyBalance::default()
        }
    }

    fn work(&self) -> WorkCounts {
        WorkCounts {
            steps: self.steps,
            evaluations: self.steps,
            ..WorkCounts::default()
        }
    }
}

/// Returns the registry of the other tests with the plant `spring`.
fn springs() -> Registry {
    registry().with_plant(spring("spring"))
}

/// Returns the ports: commands of all legs, and the position of one foot.
fn spring_ports(legs: &[&str]) -> Vec<Port> {
    let joints = ["hip", "knee"];
    let commands = legs
        .iter()
        .flat_map(|leg| joints.map(|joint| format!("leg/{leg}/{joint}/command")));
    let foot = Port::output("leg/LF/foot/position", Unit::Meter, 3);
    let commands = commands.map(|name| Port::input(name, Unit::Radian, 1));
    commands.chain([foot]).collect()
}

/// Returns the plant kind `name`. The kind `cracking` panics with explicit Euler at short steps,
/// the kind `unbuildable` panics when it is built.
pub fn spring(name: &'static str) -> PlantKind {
    let spring = PlantKind::new(name, "a foot on a spring", move |context| {
        assert_ne!(name, "unbuildable", "no blueprint");
        let leg = &context.robot.legs[0].leg;
        let implicit = context.plant.options.text("how") == Some("semi-implicit");
        let step = context.plant.step.unwrap_or(SimDuration::from_millis(1));
        let short = step <= SimDuration::from_micros(1_500);
        Ok(Spring {
            cracks: name == "cracking" && !implicit && short,
            ports: spring_ports(context.legs),
            implicit,
            step,
            // Numerically equal to the stiffness of the robot, 4400 N/m.
            omega_squared: leg.diagonal.stiffness,
            now: SimTime::ZERO,
            state: [0.01, 0.0],
            steps: 0,
        })
    });
    let option = twinrig::scenario::OptionSpec {
        name: "how".to_owned(),
        about: "a method".to_owned(),
        accepts: twinrig::scenario::Accepts::Text,
        default: None,
    };
    let method = |name: &str| Method::stepped(name, "a method").with_option("how", name);
    spring
        .with_ports(|context| Ok(spring_ports(context.legs)))
        .with_option(option)
        .with_method(method("semi-implicit").trusted_at_step(SimDuration::from_micros(5)))
        .with_method(method("explicit-euler"))
}

pub const STILL: &str = r#"
name = "a <spring>"
robot = "cheetah-cub"
duration = "200 ms"
plant = { model = "spring" }
actuator = { kind = "none" }
"#;

const DRIVEN: &str = r#"
robot = "cheetah-cub"
duration = "200 ms"
plant = { model = "spring", legs = ["LF"] }
controller = { kind = "cpg", gait = "trot", period = "2 ms", frequency = "3 Hz" }
"#;

fn study(folder: &Folder, words: &[&str], text: &str) -> Done {
    let scenario = folder.file("spring.toml", text);
    let out = folder.join("out");
    let mut all = vec!["study", words[0], &scenario, "--out", &out];
    all.extend(&words[1..]);
    twin_of(&springs(), &all)
}

#[test]
fn study_prints_documented_keys_and_writes_html_csv_and_json() {
    let folder = Folder::new("study");
    let done = study(
        &folder,
        &["precision", "--plant", "spring", "--json"],
        STILL,
    );
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    let printed = &json(&done.out)[0];
    let keys: Vec<&str> = printed
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    assert_eq!(
        keys[..5],
        ["study", "scenario", "machine", "reference", "rows"]
    );
    assert_eq!(printed["scenario"], "a <spring>");
    assert_eq!(printed["rows"].as_array().unwrap().len(), 20);
    for ending in ["html", "csv", "json"] {
        let path = folder.join(&format!("out/precision-spring.{ending}"));
        let text = std::fs::read_to_string(Path::new(&path)).unwrap();
        assert!(text.len() > 1000, "{path}");
        if ending == "json" {
            assert_eq!(
                &serde_json::from_str::<serde_json::Value>(&text).unwrap(),
                printed
            );
        }
    }
}

#[test]
fn table_shows_methods_orders_reference_and_files() {
    let folder = Folder::new("study-table");
    let done = study(&folder, &["precision", "--plant", "spring"], STILL);
    for expected in [
        "a <spring>",
        "explicit-euler",
        "semi-implicit",
        "1.0",
        "reference",
        "precision-spring.html",
    ] {
        assert!(
            done.out.contains(expected),
            "no {expected} in\n{}",
            done.out
        );
    }
}

#[test]
fn unsuitable_plant_is_left_out_unless_requested() {
    let folder = Folder::new("study-all");
    let scene = STILL.replace("\"spring\" }", "\"spring\", how = \"semi-implicit\" }");
    let done = study(
        &folder,
        &["precision", "--json", "--duration", "50 ms"],
        &scene,
    );
    assert_eq!(done.code, 0, "{}", done.err);
    let found = &json(&done.out)[0];
    let of = |plant: &str| {
        let rows = found["rows"].as_array().unwrap().iter();
        rows.filter(|row| row["plant"] == plant).collect::<Vec<_>>()
    };
    // Only `spring` has the option of the scene.
    assert_eq!(of("massless"), Vec::<&serde_json::Value>::new());
    let mut left_out = found["left_out"].as_array().unwrap().iter();
    let why = left_out.find_map(|left| left.as_str()?.strip_prefix("massless: "));
    assert!(why.is_some_and(|why| why.contains("how")), "{found}");
    assert!(of("spring").iter().any(|row| row["status"] == "ok"));
    let requested = study(&folder, &["precision", "--plant", "massless"], &scene);
    assert_eq!((requested.code, requested.out.as_str()), (2, ""));
    assert!(requested.err.contains("how"), "{}", requested.err);
}

#[test]
fn stability_limit_of_explicit_euler_depends_on_stiffness() {
    let folder = Folder::new("study-stable");
    let words = [
        "stability",
        "--plant",
        "spring",
        "--json",
        "--duration",
        "1 s",
    ];
    let done = study(&folder, &words, STILL);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    let rows = &json(&done.out)[0]["rows"];
    let limit = |stiffness: f64| {
        let mut rows = rows.as_array().unwrap().iter();
        let selected = |row: &&serde_json::Value| {
            row["method"] == "explicit-euler"
                && row["stiffness"] == stiffness
                && row["damping"] == 1.0
        };
        rows.find(selected).unwrap()["largest_stable_step_s"]
            .as_f64()
            .unwrap()
    };
    // c/k: 4.5 ms, and four times as much at a quarter of the stiffness.
    assert!(
        (limit(1.0) * 4400.0 / 20.0 - 1.0).abs() < 0.1,
        "{}",
        limit(1.0)
    );
    assert!((limit(0.25) / limit(1.0) - 4.0).abs() < 0.4);
}

#[test]
fn commands_are_recorded_once_and_replayed_to_all_plants() {
    let folder = Folder::new("study-driven");
    let done = study(
        &folder,
        &["precision", "--plant", "spring", "--json"],
        DRIVEN,
    );
    assert_eq!(done.code, 0, "{}{}", done.out, done.err);
    let study = &json(&done.out)[0];
    assert_eq!(study["commands_played"], true);
    // Steps longer than the period of the commands are not studied.
    assert_eq!(study["compared_every_s"], 0.002);
    let rows = study["rows"].as_array().unwrap();
    assert!(
        rows.iter()
            .all(|row| row["step_s"].as_f64().unwrap() <= 0.002)
    );
    assert!(rows.iter().all(|row| row["status"] == "ok"));
}

#[test]
fn errors_are_reported_with_exit_code_2() {
    let folder = Folder::new("study-wrong");
    for (words, expected) in [
        (
            &["precision", "--plant", "sprung"][..],
            "did you mean `spring`?",
        ),
        (&["precision", "--duration", "1 ms"], "too short to study"),
        (&["precision", "--duration", "1 m"], "--duration"),
        (&["stability", "--budget", "0"], "--budget"),
        (&["precision", "--set", "duratoin=1"], "duratoin"),
    ] {
        let done = study(&folder, words, STILL);
        assert_eq!((done.code, done.out.as_str()), (2, ""), "{words:?}");
        assert!(done.err.contains(expected), "{words:?}: {}", done.err);
    }
    let missing = twin(&[
        "study",
        "stability",
        "nowhere.toml",
        "--json",
        "--out",
        &folder.join("out"),
    ]);
    assert_eq!(missing.code, 2);
    assert!(
        json(&missing.out)[0]["error"]
            .as_str()
            .unwrap()
            .contains("nowhere.toml")
    );
}

#[test]
fn coupling_study_runs_complete_rig_and_reports_missing_bus() {
    let folder = Folder::new("study-coupling");
    let words = [
        "coupling",
        "--plant",
        "spring",
        "--duration",
        "60 ms",
        "--json",
    ];
    // Expectations are not evaluated in studies, so an observation period that is too long for them
    // is not an error.
    let expecting = format!(
        "{DRIVEN}\n[footsteps]\nshortest_swing = \"8 ms\"\n[[expect]]\nfootstep = {{ slip = {{ max = \"1 mm\" }} }}\n"
    );
    let done = study(&folder, &words, &expecting);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    let printed = &json(&done.out)[0];
    assert_eq!(printed["study"], "coupling");
    assert!(printed["left_out"][0].as_str().unwrap().contains("no bus"));
    let rows = printed["rows"].as_array().unwrap();
    // Three methods with the complete rig and two with the plant alone, at eight steps each.
    assert_eq!(rows.len(), 40);
    assert!(rows.iter().all(|row| row["status"] == "ok"), "{rows:?}");
    let error = |method: &str, step: f64| {
        let mut ours = rows.iter().filter(|row| {
            row["method"] == method && row["step_s"] == step && row["kind"] == "alone"
        });
        ours.next().unwrap()["error_max_m"].as_f64().unwrap()
    };
    // On a grid that divides the controller period of 2 ms no sample is interpolated, so the error
    // is zero.
    for method in ["grid", "grid-held"] {
        for step in [2e-3, 1e-3, 5e-4, 1e-4] {
            assert_eq!(error(method, step), 0.0, "{method} {step}");
        }
        assert!(error(method, 5e-3) > 0.0, "{method}");
    }
    for ending in ["html", "csv", "json"] {
        let path = folder.join(&format!("out/coupling-spring.{ending}"));
        assert!(Path::new(&path).exists(), "{path}");
    }
    let table = study(&folder, &words[..5], DRIVEN);
    for expected in ["grid-held: RMS", "5 ms", "no bus", "coupling-spring.html"] {
        assert!(
            table.out.contains(expected),
            "no {expected} in\n{}",
            table.out
        );
    }
}

#[test]
fn coupling_study_refuses_a_plant_without_positions() {
    let bench = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/bench.toml");
    let done = twin(&["study", "coupling", bench]);
    assert_eq!((done.code, done.out.as_str()), (2, ""));
    assert!(done.err.contains("body/position"), "{}", done.err);
}

#[test]
fn plan_shows_coupling_of_plant_and_boards() {
    let folder = Folder::new("plan-coupling");
    let scenario = folder.file("spring.toml", DRIVEN);
    let plan = |more: &[&str]| twin_of(&springs(), &[&["plan", &scenario], more].concat());
    let exact = plan(&["--json"]);
    assert_eq!(
        json(&exact.out)[0]["schedule"]["coupling_grid_s"],
        serde_json::Value::Null
    );
    let set = [
        "--set",
        "plant.coupling={ grid = \"0.5 ms\", inputs = \"held\" }",
    ];
    let grid = plan(&[&set[..], &["--json"]].concat());
    assert_eq!(json(&grid.out)[0]["schedule"]["coupling_grid_s"], 5e-4);
    let text = plan(&set).out;
    assert!(
        text.contains("fixed grid of 0.5 ms: commands act from the next grid point on"),
        "{text}"
    );
    let wrong = plan(&["--set", "plant.coupling={ grid = \"3 ms\" }"]);
    assert_eq!(wrong.code, 2);
    assert!(
        wrong.err.contains("must divide the observation period"),
        "{}",
        wrong.err
    );
}

/// A program that reads servos one by one waits for the latency timer each time, by a sync read
/// once.
#[test]
fn timing_of_a_bus_is_by_servos_timer_and_pattern() {
    let folder = Folder::new("study-timing");
    let out = folder.join("out");
    let begin = ["study", "timing", "--out", &out, "--baud", "1000000"];
    let words = [
        "--servos",
        "1,6",
        "--timer",
        "16 ms",
        "--read",
        "sync,one-by-one",
        "--json",
    ];
    let done = twin(&[&begin[..], &words].concat());
    let found = study_result(&done);
    let rows = found["rows"].as_array().unwrap();
    let timers = rows.iter().map(|row| {
        let duration = row["duration_s"].as_f64().unwrap();
        let servos = row["servos"].as_u64().unwrap();
        (
            row["read"].as_str().unwrap(),
            servos,
            (duration / 0.016).round(),
        )
    });
    let expected = [
        ("sync", 1, 1.0),
        ("sync", 6, 1.0),
        ("one-by-one", 1, 1.0),
        ("one-by-one", 6, 6.0),
    ];
    assert_eq!(timers.collect::<Vec<_>>(), expected);
    assert!(found["stated"].as_array().unwrap().len() >= 7);
    let page = std::fs::read_to_string(folder.join("out/timing.html")).unwrap();
    assert!(page.contains("/DynamixelSDK/issues/302"));
    let refused = twin(&[
        "study", "timing", "--out", &out, "--model", "ax-12a", "--read", "sync",
    ]);
    assert!(
        refused.err.contains("choose from one-by-one"),
        "{}",
        refused.err
    );
}

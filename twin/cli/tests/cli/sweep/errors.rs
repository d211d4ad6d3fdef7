use super::{SEEDS, STAND, Sweep};

/// A scenario whose controller has process variables.
const WALK: &str = r#"
robot = "cheetah-cub"
duration = "100 ms"
plant = { model = "massless" }
[controller]
kind = "cpg"
gait = "trot"
period = "2 ms"
frequency = "3 Hz"
step_length = "10 cm"
hip_height = { fore = "125 mm", hind = "125 mm" }
[[expect]]
name = "stands"
body = { height = { min = "1 cm" } }
"#;

fn error(test: &str, spec: &str, more: &[&str]) -> String {
    let sweep = Sweep::new(test, WALK, spec);
    let done = sweep.run("out", more);
    assert_eq!(done.code, 2, "{done:?}");
    assert!(done.out.is_empty(), "{}", done.out);
    let written = std::fs::read_dir(sweep.folder.join("out"))
        .into_iter()
        .flatten();
    assert_eq!(written.count(), 0, "no run has begun");
    done.err
}

/// Before the first run, at the place in the specification, with a remedy.
#[test]
fn mistakes_are_errors_before_the_runs() {
    let dimension = |text: &str| format!("{SEEDS}[[dimension]]\n{text}\n");
    for (spec, message, help, line) in [
        (
            format!("{SEEDS}[[share]]\nof = 'stnads'\nmin = 0.5\n"),
            "no run has an expectation `stnads`",
            "did you mean `stands`?",
            6,
        ),
        (
            "design = 'random'\npoints = 2\nassumed = [\n'leg.aslp.l5']".to_owned(),
            "the robot has no assumed value `leg.aslp.l5`",
            "leg.aslp.l1",
            4,
        ),
        (
            dimension("key = 'frequncy'\nvalues = ['1 Hz', '2 Hz']"),
            "`frequncy` is neither a key nor a process variable",
            "did you mean `frequency`?",
            6,
        ),
        (
            dimension("key = 'plant.stepp'\nvalues = ['1 ms']"),
            "unknown key `stepp` in `plant`",
            "did you mean `step`?",
            6,
        ),
        (
            dimension("key = 'plant.step'\nvalues = ['1 m']"),
            "`1 m` is a length; expected a duration",
            "",
            6,
        ),
        (
            dimension("key = 'plant.ground.friction'\nvalues = [0.1, -0.2, 0.3]"),
            "which is out of range (with plant.ground.friction = -0.2)",
            "at least 0",
            6,
        ),
        (
            format!("{SEEDS}[[dimension]]\nkey = 'controller.seed.x'\nvalues = [1]\n"),
            "unknown key `seed` in `controller`",
            "",
            6,
        ),
        (
            format!("set = {{ seed = 3 }}\n{SEEDS}"),
            "`seed` is set for all runs, by `set`",
            "leave out the dimension or the setting",
            3,
        ),
    ] {
        let error = error("mistakes", &spec, &[]);
        for part in [message, help, &format!("spec.toml:{line}:")] {
            assert!(error.contains(part), "{part}\n{error}");
        }
    }
}

#[test]
fn setting_of_the_command_line_and_dimension_exclude_each_other() {
    let error = error("twice", SEEDS, &["--set", "seed=2"]);
    assert!(
        error.contains("`seed` is set for all runs, by --set"),
        "{error}"
    );
}

#[test]
fn variable_is_set_by_its_bare_name() {
    let spec = "[[dimension]]\nkey = 'frequency'\nfrom = '2 Hz'\nto = '4 Hz'\ncount = 3\n\
                [[dimension]]\nkey = 'hip_height/fore'\nvalues = ['12 cm']\n";
    let sweep = Sweep::new("bare", WALK, spec);
    let result = sweep.json(0, "out", &[]);
    let command = result["rows"][1]["command"].as_str().unwrap();
    let end = "--set 'controller.frequency=\"3 Hz\"' --set 'controller.hip_height.fore=\"12 cm\"'";
    assert!(command.ends_with(end), "{command}");
    assert_eq!(
        result["rows"][1]["point"]["controller.hip_height.fore"],
        0.12
    );
    assert_eq!(result["dimensions"][1]["unit"], "m");
}

#[test]
fn errors_are_json_where_it_is_requested() {
    let sweep = Sweep::new("json", STAND, "dimension = []");
    let result = sweep.json(2, "out", &[]);
    assert!(
        result["error"]
            .as_str()
            .unwrap()
            .contains("there is no dimension")
    );
}

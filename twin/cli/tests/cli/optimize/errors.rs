use super::{Optimization, SPACE, WALK};

fn error(space: &str, more: &[&str]) -> String {
    let of_massless = "before = \"1 s\"\nplants = [\"massless\"]\n[[expect]]\nname = \"stays";
    let scenario = WALK.replacen("[[expect]]\nname = \"stays", of_massless, 1);
    let optimization = Optimization::new("mistakes", &scenario, space);
    let done = optimization.run("out", more);
    assert_eq!(done.code, 2, "{done:?}");
    let written = std::fs::read_dir(optimization.folder.join("out"));
    assert_eq!(written.into_iter().flatten().count(), 0, "no run has begun");
    done.err
}

/// Before the first run, at the place in the search space, with a remedy.
#[test]
fn mistakes_are_errors_before_the_runs() {
    let objective = |name: &str| SPACE.replace("'speed'", name);
    let constrained = |text: &str| format!("{text}\n{SPACE}");
    for (space, message, help, line) in [
        (
            objective("'sped'"),
            "has no expectation `sped`",
            "did you mean `speed`?",
            1,
        ),
        (
            objective("'stays up'"),
            "`stays up` is about a fall, which has no one measure",
            "make it a constraint",
            1,
        ),
        (
            constrained(
                "set = { expect = [{ name = 'speed', body = { gets_up = { within = '1 s' } } }] }",
            ),
            "a run in which the robot falls has no value of `speed`",
            "set thresholds that nothing crosses",
            2,
        ),
        (
            constrained("constraints = ['speed', 'leveled']"),
            "has no expectation `leveled`",
            "did you mean `level`?",
            1,
        ),
        (
            constrained("constraints = ['level', 'level']"),
            "`level` is listed twice",
            "leave one of them out",
            1,
        ),
        (
            SPACE.replace("'step_length'", "'step_lenght'"),
            "`step_lenght` is neither a key nor a process variable",
            "did you mean `step_length`?",
            9,
        ),
        (
            SPACE.replace("'step_length'", "'plant.ground.frictoin'"),
            "unknown key `frictoin`",
            "did you mean `friction`?",
            9,
        ),
        (
            SPACE.replace("'14 cm'", "'14 s'"),
            "`14 s` is a duration; expected a length",
            "",
            7,
        ),
        (
            SPACE
                .replace("'hip_height/fore'", "'plant.step'")
                .replace("8 cm'", "8 ms'")
                .replace("14 cm'", "14 ms'"),
            "out of range (with plant.step = ",
            "",
            5,
        ),
        (
            constrained("set = { controller.step_length = '5 cm' }"),
            "`step_length` is set for all runs, by `set`",
            "leave out the dimension or the setting",
            10,
        ),
    ] {
        let error = error(&space, &[]);
        for part in [message, help, &format!("space.toml:{line}:")] {
            assert!(error.contains(part), "{part}\n{error}");
        }
    }
    let few = error(SPACE, &["--particles", "2"]);
    assert!(few.contains("a population of 2 is too small"), "{few}");
}

#[test]
fn mistakes_in_cases_are_errors_at_their_place() {
    for (case, message, help, line) in [
        (
            "set = { plant.ground.frictoin = 0.2 }",
            "unknown key `frictoin`",
            "did you mean `friction`?",
            15,
        ),
        (
            "set = { plant.model = 'masless' }",
            "there is no plant `masless`",
            "did you mean `massless`?",
            15,
        ),
        (
            "set = { controller.step_length = '5 cm' }",
            "`step_length` is set by the case `other`",
            "leave out the dimension or the setting",
            9,
        ),
        (
            "set = { plant.model = 'lcp' }",
            "the expectation `speed` is not about lcp",
            "it is about massless",
            1,
        ),
        (
            "set = { seed = 2 }\n[set]\nseed = 3",
            "`seed` is set for all runs, by `set`",
            "leave out one of both settings",
            15,
        ),
    ] {
        let error = error(&format!("{SPACE}[[case]]\nname = 'other'\n{case}"), &[]);
        for part in [message, help, &format!("space.toml:{line}:")] {
            assert!(error.contains(part), "{part}\n{error}");
        }
    }
}

/// A result would depend on the machine.
#[test]
fn speed_of_the_machine_is_no_objective() {
    let scenario =
        format!("{WALK}[[expect]]\nname = 'fast'\ncost = {{ real_time_factor = {{ min = 1 }} }}\n");
    for space in [
        SPACE.replace("'speed'", "'fast'"),
        format!("constraints = 'all'\n{SPACE}"),
    ] {
        let optimization = Optimization::new("machine", &scenario, &space);
        let done = optimization.run("out", &[]);
        let expected = "`fast` depends on the machine and its load";
        assert!(done.code == 2 && done.err.contains(expected), "{done:?}");
    }
}

/// Runs would all have this error.
#[test]
fn mistake_of_the_scenario_is_an_error_before_the_runs() {
    let scenario = WALK.replace("phase_output = true\n", "");
    let optimization = Optimization::new("scenario", &scenario, SPACE);
    let done = optimization.run("out", &[]);
    assert_eq!(done.code, 2);
    assert!(
        done.err.contains("there is no signal `leg/LF/phase`"),
        "{done:?}"
    );
    assert!(!std::fs::exists(optimization.folder.join("out")).unwrap());
}

#[test]
fn errors_are_json_where_it_is_requested() {
    let optimization = Optimization::new("json", WALK, "maximize = 'speed'\ndimension = []");
    let result = optimization.json(2, "out", &[]);
    assert!(
        result["error"]
            .as_str()
            .unwrap()
            .contains("there is no dimension")
    );
}

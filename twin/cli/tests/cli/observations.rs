//! Observation periods that are too long for the expectations.

use crate::common::{Folder, json, twin};

/// Scenario of a robot that walks over an edge and falls.
const FALLS: &str = r#"
robot = "cheetah-cub"
duration = "2 s"
plant = { model = "massless", ground = { profile = "step-down", at = "5 cm", height = "50 cm" } }
controller = { kind = "cpg", gait = "walk", period = "2 ms" }

[[expect]]
name = "does not fall"
body = { fall = false }

[[expect]]
name = "height"
body = { height = { min = "80 mm" } }

[[expect]]
name = "signal"
signal = { name = "body/position", component = "z", always = { min = "50 mm" } }
"#;

fn verdicts(words: &[&str]) -> (u8, Vec<String>) {
    let done = twin(words);
    let report = &json(&done.out)[0];
    let lines = report["expectations"].as_array().unwrap();
    let verdicts = lines.iter().map(|line| line["verdict"].as_str().unwrap());
    (done.code, verdicts.map(str::to_owned).collect())
}

#[test]
fn fall_between_observations_does_not_pass() {
    let folder = Folder::new("rarely");
    let file = folder.file("falls.toml", FALLS);
    let run = ["run", &file, "--no-record", "--json"];
    let fails = ["fail"; 3].map(str::to_owned).to_vec();
    assert_eq!(verdicts(&run), (1, fails));
    for period in ["10 s", "2 s", "21 ms"] {
        let set = format!("observe.period={period}");
        let refused = twin(&[&run[..], &["--set", &set]].concat());
        assert_eq!(refused.code, 2, "{period}");
        let error = json(&refused.out)[0]["error"].as_str().unwrap().to_owned();
        assert!(
            error.contains("write [observe] period = \"20 ms\""),
            "{error}"
        );
        assert_eq!(twin(&["check", &file, "--set", &set]).code, 2, "{period}");
    }
    // An expectation of a signal allows any period, and is not decided by nine samples before the
    // fall.
    let signal = FALLS.replace("body = { fall = false }", "cost = { steps = { min = 1 } }");
    let signal = signal.replace(
        "body = { height = { min = \"80 mm\" } }",
        "cost = { events = { min = 1 } }",
    );
    let file = folder.file("signal.toml", &signal);
    let set = ["--set", "observe.period=250 ms", "--set", "duration=2 s"];
    let (code, verdicts) = verdicts(&[&["run", &file, "--no-record", "--json"], &set[..]].concat());
    assert_ne!(code, 0);
    assert_ne!(verdicts[2], "pass");
}

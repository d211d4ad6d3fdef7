//! Commands that run nothing: `twin check`, `plan` and `list`.

use crate::common::{Folder, SOUND, hanging, json, twin};
use serde_json::json;

#[test]
fn check_validates_all_scenarios() {
    let folder = Folder::new("check");
    let sound = folder.file("sound.toml", SOUND);
    let wrong = folder.file("wrong.toml", &SOUND.replace("cheetah-cub", "cheetah-cup"));
    let done = twin(&["check", &sound, &wrong]);
    assert_eq!(done.code, 2);
    assert!(
        done.out.contains('✓') && done.err.contains("did you mean `cheetah-cub`?"),
        "{done:?}"
    );
    let valid: Vec<_> = json(&twin(&["check", &sound, &wrong, "--json"]).out);
    assert_eq!(
        (&valid[0]["valid"], &valid[1]["valid"]),
        (&json!(true), &json!(false))
    );
}

#[test]
fn plan_lists_the_effects_of_sensors_in_their_order() {
    let scenarios = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios");
    let scenario = format!("{scenarios}/tegotae-noisy.toml");
    let text = twin(&["plan", &scenario]).out;
    let row = "[N]  noise 0.2 N → 0 N … 20 N → resolution 0.1 N → drop-out 0.02 → delay 5 ms\n";
    assert!(text.contains(&format!("leg/*/foot/load  {row}")), "{text}");
    let plan = &json(&twin(&["plan", &scenario, "--json"]).out)[0];
    let [first, ..] = &plan["sensors"].as_array().unwrap()[..] else {
        panic!("{plan}");
    };
    assert_eq!(first["signal"], "leg/LF/foot/load");
    assert_eq!(
        (&first["noise"], &first["delay_max_s"]),
        (&json!(0.2), &json!(0.005))
    );
}

#[test]
fn plan_lists_left_out_parts_with_reasons() {
    let folder = Folder::new("plan");
    let record = "record = { signals = [\"body/position\"], frames = \"0 Hz\" }";
    let scenario = folder.file("lean.toml", &format!("{record}\n{SOUND}"));
    let done = twin(&["plan", &scenario, "--json"]);
    assert_eq!(done.code, 0, "{done:?}");
    let plan = &json(&done.out)[0];
    let parts = plan["left_out"].as_array().unwrap();
    assert!(
        parts
            .iter()
            .all(|part| part["why"].as_str().is_some_and(|why| !why.is_empty()))
    );
    assert!(
        parts.iter().any(|part| part["part"] == "controller"),
        "{parts:?}"
    );
    let why = |part: &str| {
        let found = parts.iter().find(|one| one["part"] == part).unwrap();
        found["why"].as_str().unwrap().to_owned()
    };
    let text = twin(&["plan", &scenario]).out;
    assert!(text.contains("\n  left out\n"), "{text}");
    let line = format!("\n    controller ({})\n", why("controller"));
    assert!(text.contains(&line), "{text}");
}

#[test]
fn parts_left_out_for_one_reason_share_a_line() {
    let folder = Folder::new("plan-lines");
    let scenario = hanging("").replace(
        "controller =",
        "record = { signals = [\"body/position\"], frames = \"0 Hz\" }\ncontroller =",
    );
    let fails = "[[expect]]\nname = 'rises'\nsignal = { name = 'body/position', component = 'z', \
                 always = { min = '9 m' } }\n";
    let scenario = folder.file("lean.toml", &(scenario + fails));
    let done = twin(&["plan", &scenario, "--json"]);
    let plan = &json(&done.out)[0];
    let parts = plan["left_out"].as_array().unwrap().iter();
    let named = parts.filter_map(|left| left["part"].as_str()?.strip_prefix("recording of "));
    let recordings: Vec<&str> = named.filter(|name| *name != "poses").collect();
    assert!(recordings.len() > 1, "{plan}");
    let line = format!("recording of {} (", recordings.join(", "));
    let text = twin(&["plan", &scenario]).out;
    assert_eq!(text.matches("recording of ").count(), 2, "{text}");
    assert!(text.contains(&line), "{line} is not in {text}");
    // Those of a run that fails are wrapped.
    let text = twin(&["run", &scenario, "--no-record"]).out;
    let words: Vec<&str> = text.split_whitespace().collect();
    assert!(words.join(" ").contains(&line), "{line} is not in {text}");
}

#[test]
fn list_shows_the_variables_of_the_named_robot() {
    let step_length = |words: &[&str]| {
        let listing = &json(&twin(&[&["list", "--json"], words].concat()).out)[0];
        let variables = listing["controllers"][0]["variables"].as_array().unwrap();
        let variable = variables.iter().find(|it| it["name"] == "step_length");
        variable.unwrap()["default"].as_f64().unwrap()
    };
    assert_eq!(step_length(&[]), step_length(&["cheetah-cub"]));
    assert!(step_length(&["oncilla"]) > 1.2 * step_length(&[]));
    let unknown = twin(&["list", "oncila"]);
    assert!(
        unknown.code == 2 && unknown.err.contains("`oncilla`"),
        "{unknown:?}"
    );
}

#[test]
fn list_names_all_parts() {
    let done = twin(&["list", "--json"]);
    let listing = &json(&done.out)[0];
    let names = |key: &str| -> Vec<String> {
        let parts = listing[key].as_array().unwrap().iter();
        parts
            .map(|part| part["name"].as_str().unwrap().to_owned())
            .collect()
    };
    let mut plants = names("plants");
    plants.sort();
    // Plants on engines, which the standard registry lacks, are listed with the remedy.
    let known = [
        "bench", "drives", "fmu", "lcp", "massless", "mjcf", "mujoco", "rapier", "servo",
    ];
    let tested = ["snapping", "toy"];
    assert_eq!(plants, [&known[..], &tested].concat());
    let lacking = |name: &str| {
        let mut parts = listing["plants"].as_array().unwrap().iter();
        let part = parts.find(|part| part["name"] == name).unwrap();
        part["remedy"].clone()
    };
    let mujoco = json!("build with `--features mujoco`, after `ci/setup mujoco`");
    assert_eq!((lacking("mjcf"), lacking("lcp")), (mujoco, json!(null)));
    let controllers = [
        "cpg", "tegotae", "planner", "stand", "script", "turn", "swing",
    ];
    assert_eq!(names("controllers"), controllers);
    assert!(
        listing["robots"]
            .as_array()
            .unwrap()
            .contains(&json!("oncilla"))
    );
    assert!(names("tables").contains(&"[plant]".to_owned()));
    let text = twin(&["list"]).out;
    assert!(
        text.contains("frequency") && text.contains("cheetah-cub") && text.contains("[[expect]]"),
        "{text}"
    );
}

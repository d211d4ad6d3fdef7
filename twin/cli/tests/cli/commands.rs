//! End-to-end tests of the commands, in this process.

use std::fs;

use crate::common::{Folder, SOUND, json, twin};
use serde_json::{Value, json};

#[test]
fn run_prints_documented_keys_first_and_in_order() {
    let folder = Folder::new("keys");
    let scenario = folder.file("bob.toml", SOUND);
    let done = twin(&["run", &scenario, "--json", "--out", &folder.join("out")]);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    let report = &json(&done.out)[0];
    let keys: Vec<&str> = report
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect();
    assert_eq!(
        keys[..11],
        [
            "scenario",
            "verdict",
            "seed",
            "plant",
            "fingerprint",
            "simulated_s",
            "wall_s",
            "real_time_factor",
            "expectations",
            "left_out",
            "recording"
        ]
    );
    let first = report["expectations"][0].as_object().unwrap();
    let keys: Vec<&str> = first.keys().map(String::as_str).collect();
    let documented = [
        "name",
        "verdict",
        "measured",
        "bound",
        "unit",
        "margin",
        "first_violation_s",
    ];
    assert_eq!(keys[..7], documented);
    assert_eq!(report["verdict"], "pass");
    assert_eq!(report["scenario"], "bobbing <& fast>");
    assert_eq!(report["seed"], 7);
    assert_eq!(report["simulated_s"], 1.0);
    assert_eq!(first["unit"], "m/s");
    let recording = report["recording"].as_str().unwrap();
    assert!(recording.ends_with("bob-seed7.mcap"), "{recording}");
    assert!(std::path::Path::new(recording).is_file());
}

#[test]
fn exit_codes_distinguish_pass_fail_and_error() {
    let folder = Folder::new("codes");
    let sound = folder.file("sound.toml", SOUND);
    let failing = folder.file("failing.toml", &SOUND.replace("109 mm", "119 mm"));
    let wrong = folder.file("wrong.toml", &SOUND.replace("duration", "duratoin"));
    let code = |words: &[&str]| twin(&[words, &["--no-record"]].concat()).code;
    assert_eq!(code(&["run", &sound]), 0);
    assert_eq!(code(&["run", &failing]), 1);
    assert_eq!(code(&["run", &wrong]), 2);
    assert_eq!(code(&["run", &sound, &failing]), 1);
    assert_eq!(code(&["run", &failing, &wrong, &sound]), 2);
    assert_eq!(twin(&["run"]).code, 2);
    assert_eq!(twin(&["jump"]).code, 2);
    assert_eq!(twin(&["--help"]).code, 0);
}

#[test]
fn error_of_one_scenario_does_not_affect_others() {
    let folder = Folder::new("others");
    let wrong = folder.file("wrong.toml", &SOUND.replace("duration", "duratoin"));
    let missing = folder.join("missing.toml");
    let sound = folder.file("sound.toml", SOUND);
    let done = twin(&["run", &wrong, &missing, &sound, "--json", "--no-record"]);
    let reports = json(&done.out);
    let verdicts: Vec<_> = reports.iter().map(|report| &report["verdict"]).collect();
    assert_eq!(verdicts, ["error", "error", "pass"]);
    let error = reports[0]["error"].as_str().unwrap();
    assert!(
        error.contains("did you mean `duration`?") && error.contains("wrong.toml:4:1"),
        "{error}"
    );
    assert!(
        reports[1]["error"]
            .as_str()
            .unwrap()
            .contains("cannot be read")
    );

    let done = twin(&["run", &wrong, &sound, "--no-record"]);
    let summary: Vec<&str> = done.out.lines().rev().take(2).collect();
    assert!(
        summary[0].contains("PASS") && summary[0].contains("2 of 2 hold"),
        "{}",
        done.out
    );
    assert!(summary[1].contains("ERROR"), "{}", done.out);
    assert!(done.err.contains("^^^^^^^^"), "{}", done.err);
}

#[test]
fn failure_reports_value_bound_margin_and_first_violation() {
    let folder = Folder::new("failure");
    let scenario = folder.file("failing.toml", &SOUND.replace("109 mm", "119 mm"));
    let report = &json(&twin(&["run", &scenario, "--json", "--no-record"]).out)[0];
    let height = &report["expectations"][1];
    assert_eq!(height["verdict"], "fail");
    assert_eq!(height["bound"], 0.119);
    let (measured, margin) = (
        height["measured"].as_f64().unwrap(),
        height["margin"].as_f64().unwrap(),
    );
    assert!((0.1095..0.1105).contains(&measured) && (measured - 0.119 - margin).abs() < 1e-12);
    // 10 mm cos(20 t) falls to −1 mm at 84 ms.
    let at = height["first_violation_s"].as_f64().unwrap();
    assert!((0.080..0.088).contains(&at), "{at}");
    let text = twin(&["run", &scenario, "--no-record"]).out;
    assert!(
        text.contains("✗  height") && text.contains("first at 0.08"),
        "{text}"
    );
}

#[test]
fn plant_fault_ends_run_with_verdict_and_recording() {
    let folder = Folder::new("fault");
    let scenario = folder.file("snap.toml", SOUND);
    let out = folder.join("out");
    let done = twin(&[
        "run", &scenario, "--plant", "snapping", "--out", &out, "--json",
    ]);
    assert_eq!(done.code, 2);
    let report = &json(&done.out)[0];
    assert_eq!(report["verdict"], "error");
    let error = report["error"].as_str().unwrap();
    for part in ["toy/spring", "498", "1.500e0 J", "it snapped", "snap.toml"] {
        assert!(error.contains(part), "{part} in {error}");
    }
    for line in report["expectations"].as_array().unwrap() {
        assert_ne!(line["verdict"], "pass", "{line}");
    }
    let recording =
        twinrig_record::Recording::open(report["recording"].as_str().unwrap().as_ref()).unwrap();
    assert_eq!(recording.series("body/position").unwrap().times.len(), 250);
    assert!(recording.is_complete());
}

#[test]
fn settings_apply_to_scenario_and_recording_name() {
    let folder = Folder::new("settings");
    let scenario = folder.file("bob.toml", SOUND);
    let out = folder.join("out");
    let run = |words: &[&str]| {
        let all = [&["run", &scenario, "--out", &out, "--json"], words].concat();
        json(&twin(&all).out).remove(0)
    };
    let (plain, shorter) = (
        run(&[]),
        run(&["--set", "duration=500 ms", "--set", "seed=8"]),
    );
    assert_eq!(
        (&shorter["simulated_s"], &shorter["seed"]),
        (&json!(0.5), &json!(8))
    );
    assert_ne!(plain["recording"], shorter["recording"]);
    assert_eq!(
        shorter["recording"],
        run(&["--set", "duration=500 ms", "--set", "seed=8"])["recording"]
    );
    let wrong = run(&["--set", "plant.modle=toy"]);
    assert!(
        wrong["error"]
            .as_str()
            .unwrap()
            .contains("did you mean `model`?"),
        "{wrong}"
    );
}

#[test]
fn junit_has_one_case_per_expectation_and_error() {
    let folder = Folder::new("junit");
    let failing = folder.file("failing.toml", &SOUND.replace("109 mm", "119 mm"));
    let scenario = folder.file("snap.toml", SOUND);
    let file = folder.join("junit.xml");
    twin(&["run", &failing, "--no-record", "--junit", &file]);
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(
        text.contains(
            r#"<testsuite name="bobbing &lt;&amp; fast&gt;" tests="2" failures="1" errors="0""#
        ),
        "{text}"
    );
    assert!(
        text.contains("0.110 m is not ≥ 0.119 m, first at 0.084 s"),
        "{text}"
    );
    twin(&[
        "run",
        &scenario,
        "--plant",
        "snapping",
        "--no-record",
        "--junit",
        &file,
    ]);
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(
        text.contains(r#"errors="1""#) && text.contains("<error message="),
        "{text}"
    );
    let done = twin(&[
        "run",
        &scenario,
        "--no-record",
        "--junit",
        &folder.join("no/such/folder.xml"),
    ]);
    assert_eq!(done.code, 2);
}

#[test]
fn errors_are_json_objects_with_json_option() {
    let folder = Folder::new("errors");
    let wrong = folder.file("wrong.toml", &SOUND.replace("duration", "duratoin"));
    let lost = folder.join("lost.mcap");
    for words in [
        &["diff", &lost, &lost][..],
        &["replay", &lost],
        &["plan", &wrong],
        &["check", &wrong],
        &["run", &wrong],
    ] {
        let done = twin(&[words, &["--json"]].concat());
        assert_eq!((done.code, done.err.as_str()), (2, ""), "{words:?}");
        let objects = json(&done.out);
        assert_eq!(objects.len(), 1, "{}", done.out);
        let error = objects[0]["error"].as_str().unwrap();
        assert!(error.starts_with("error: "), "{error}");
    }
}

#[test]
fn times_are_printed_without_rounding_errors() {
    let folder = Folder::new("times");
    let scenario = folder.file("bob.toml", &SOUND.replace("1 s", "1148 ms"));
    let done = twin(&["run", &scenario, "--json", "--no-record"]);
    assert!(done.out.contains("\"simulated_s\":1.148,"), "{}", done.out);
    let shown = twin(&["run", &scenario, "--no-record"]).out;
    assert!(shown.contains(" 1.148 s simulated"), "{shown}");
    let plan = twin(&["plan", &scenario]).out;
    assert!(plan.contains(" 1.148 s, seed 7"), "{plan}");
}

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
    let scenario = folder.file("lean.toml", &scenario);
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
    // Lines of facts are wrapped.
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
    // Plants on engines that this build lacks are listed with the remedy.
    let known = [
        "bench", "drives", "fmu", "lcp", "massless", "mjcf", "mujoco", "rapier",
    ];
    let tested = ["snapping", "toy"];
    assert_eq!(plants, [&known[..], &tested].concat());
    let lacking = |name: &str| {
        let mut parts = listing["plants"].as_array().unwrap().iter();
        let part = parts.find(|part| part["name"] == name).unwrap();
        part["remedy"].clone()
    };
    let mujoco = if cfg!(feature = "mujoco") {
        json!(null)
    } else {
        json!("build with `--features mujoco`, after `ci/setup mujoco`")
    };
    assert_eq!((lacking("mjcf"), lacking("lcp")), (mujoco, json!(null)));
    let controllers = ["cpg", "tegotae", "planner", "stand", "script", "turn"];
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

/// Returns a scenario of the massless-leg plant with a fixed trunk; `plant` contains further keys
/// of the plant.
fn hanging(plant: &str) -> String {
    format!(
        r#"
robot = "cheetah-cub"
duration = "10 ms"
plant = {{ model = "massless", base = "fixed", {plant} }}
controller = {{ kind = "stand", period = "2 ms" }}
"#
    )
}

#[test]
fn cells_require_lookup_table() {
    let folder = Folder::new("cells");
    let check = |name: &str, plant: &str| {
        let file = folder.file(name, &hanging(plant));
        twin(&["check", &file])
    };
    assert_eq!(
        check("table.toml", "force = \"lookup\", cells = 16").code,
        0
    );
    let stray = check("stray.toml", "cells = 64");
    assert_eq!(stray.code, 2);
    assert!(stray.err.contains("force = \"lookup\""), "{}", stray.err);
    for cells in ["0", "15", "513", "18446744073709551615"] {
        let plant = format!("force = \"lookup\", cells = {cells}");
        let refused = check("range.toml", &plant);
        assert_eq!(refused.code, 2);
        assert!(
            refused.err.contains("at least 16, at most 512"),
            "{}",
            refused.err
        );
    }
}

#[test]
fn integrator_of_massless_requires_rigid_constraints() {
    let folder = Folder::new("massless-integrator");
    let check = |plant: &str| twin(&["check", &folder.file("euler.toml", &hanging(plant))]);
    let euler = "integrator = \"explicit-euler\", force = \"linear-lookup\", cells = 16";
    let accepted = check(euler);
    assert_eq!(accepted.code, 0, "{}", accepted.err);
    let refused = check("integrator = \"explicit-euler\", constraints = \"compliant\"");
    assert_eq!(refused.code, 2);
    assert!(
        refused.err.contains("constraints = \"rigid\""),
        "{}",
        refused.err
    );
}

#[test]
fn plan_shows_step_of_plant_or_its_default() {
    let folder = Folder::new("step");
    for (plant, step_s, text) in [
        ("", 0.001, "step 1 ms"),
        ("step = \"0.3 ms\"", 0.0003, "step 0.3 ms"),
    ] {
        let file = folder.file("hanging.toml", &hanging(plant));
        let plan = json(&twin(&["plan", &file, "--json"]).out).remove(0);
        assert_eq!(plan["schedule"]["plant_step_s"], step_s);
        let shown = twin(&["plan", &file]).out;
        assert!(shown.contains(text), "{shown}");
    }
}

#[test]
fn plan_shows_constraints_and_set_points_and_their_delay() {
    let folder = Folder::new("set-points");
    let controlled = hanging("");
    let passive = controlled.replace("controller", "# controller");
    let held = (Some("held"), 0.0, "held set-points\n");
    let linear = (
        Some("linear"),
        0.001,
        "linear set-points: later than held ones by 1 ms in the mean, 2 ms at most\n",
    );
    let without = (None, 0.0, "");
    for (scenario, actuator, plant, constraints, set_point) in [
        // The default, and values that a scenario names.
        (&controlled, "{}", "lcp", Some("compliant"), linear),
        (
            &controlled,
            "{ set_point = \"held\" }",
            "lcp",
            Some("compliant"),
            held,
        ),
        (
            &controlled,
            "{ kind = \"ideal\" }",
            "massless",
            Some("compliant"),
            linear,
        ),
        // Rigid where no controller drives the legs.
        (
            &passive,
            "{ kind = \"none\" }",
            "lcp",
            Some("rigid"),
            without,
        ),
        (&passive, "{}", "lcp", Some("rigid"), held),
        // Rigid where the scenario asks for it, or for a method that only rigid constraints have.
        (
            &controlled,
            "{}",
            "lcp\", constraints = \"rigid",
            Some("rigid"),
            held,
        ),
        (
            &controlled,
            "{}",
            "lcp\", integrator = \"moreau",
            Some("rigid"),
            held,
        ),
        (
            &controlled,
            "{}",
            "lcp\", integrator = \"rk4",
            Some("compliant"),
            linear,
        ),
        (
            &controlled,
            "{}",
            "massless\", force = \"lookup",
            Some("rigid"),
            held,
        ),
    ] {
        let file = folder.file(
            "hanging.toml",
            &format!("{scenario}actuator = {actuator}\n")
                .replace("\"massless", &format!("\"{plant}")),
        );
        let case = format!("{plant}, {actuator}");
        let plan = json(&twin(&["plan", &file, "--json"]).out).remove(0);
        assert_eq!(plan["constraints"], json!(constraints), "{case}: {plan}");
        let found = &plan["actuator"];
        assert_eq!(found["set_point"], json!(set_point.0), "{case}: {found}");
        assert_eq!(found["set_point_delay_mean_s"], set_point.1);
        assert_eq!(found["set_point_delay_max_s"], 2.0 * set_point.1);
        let shown = twin(&["plan", &file]).out;
        let constraints = constraints.unwrap();
        let formulation = format!(", {constraints} constraints, step");
        assert!(
            shown.contains(set_point.2) && shown.contains(&formulation),
            "{case}: {shown}"
        );
        let report = json(&twin(&["run", &file, "--no-record", "--json"]).out).remove(0);
        assert_eq!(report["constraints"], constraints, "{case}: {report}");
    }
}

#[test]
fn rebounding_ground_is_rigid_unless_the_scenario_asks_for_compliance() {
    let folder = Folder::new("rebound");
    let scenario = hanging("").replace("fixed", "free");
    let file = folder.file("hanging.toml", &scenario);
    let rebounds = ["--set", "plant.ground.restitution=0.3"];
    let plan = twin(&[&["plan", &file, "--json"], &rebounds[..]].concat());
    assert_eq!(json(&plan.out).remove(0)["constraints"], "rigid");
    let compliant = ["--set", "plant.constraints=compliant"];
    let refused = twin(&[&["check", &file], &rebounds[..], &compliant].concat());
    assert_eq!(refused.code, 2);
    assert!(
        refused.err.contains("restitution of 0.3"),
        "{}",
        refused.err
    );
}

#[test]
fn driven_legs_without_compliance_are_rigid_and_the_reason_is_shown() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let read = |path: &str| fs::read_to_string(format!("{root}/{path}")).unwrap();
    let robot = read("robots/cheetah-cub.toml");
    let (before, compliance) = robot.split_once("[leg.aslp.compliance]").unwrap();
    let mounts = compliance.find("[[mount]]").unwrap();
    let folder = Folder::new("no-compliance");
    fs::create_dir(folder.join("robots")).unwrap();
    folder.file(
        "robots/stiff.toml",
        &(before.to_owned() + &compliance[mounts..]),
    );
    let file = folder.file("trot.toml", &read("scenarios/trot.toml"));
    let plan =
        |set: &[&str]| json(&twin(&[&["plan", &file, "--json"], set].concat()).out).remove(0);
    let why = |plan: &Value| {
        let parts = plan["left_out"].as_array().unwrap();
        let part = parts
            .iter()
            .find(|it| it["part"].to_string().contains("compliance"));
        part.map(|it| it["why"].as_str().unwrap().to_owned())
    };
    let own = plan(&["--set", "robot=stiff"]);
    assert_eq!(own["constraints"], "rigid");
    assert!(
        why(&own).unwrap().contains("no [leg.aslp.compliance]"),
        "{own}"
    );
    for set in [
        &[][..],
        &["--set", "robot=stiff", "--set", "plant.constraints=rigid"],
    ] {
        assert_eq!(why(&plan(set)), None, "{set:?}");
    }
}

#[test]
fn robot_error_caused_by_override_names_the_override() {
    let folder = Folder::new("override");
    let file = folder.file("hanging.toml", &hanging(""));
    let longer = "override.leg.aslp.l2=500 mm";
    let done = twin(&["check", &file, "--set", longer]);
    assert_eq!(done.code, 2);
    assert!(
        done.err.contains("diagonal_min") && done.err.contains("`leg.aslp.l2`"),
        "{}",
        done.err
    );
    // An error in the override itself has no such hint.
    let wrong = "override.leg.aslp.l2=-5 mm";
    let done = twin(&["check", &file, "--set", wrong]);
    assert_eq!(done.code, 2);
    assert!(!done.err.contains("`leg.aslp.l2`"), "{}", done.err);
}

#[test]
fn failure_of_a_plant_names_the_push_that_acts() {
    let trot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/trot.toml");
    let push = |force: &str, at: &str| {
        let push =
            format!("{{on=\"body\",at=\"{at}\",for=\"0.1 s\",force=\"{force}\",direction=\"y\"}}");
        let pushes = format!("push=[{push}]");
        twin(&[
            "run",
            trot,
            "--no-record",
            "--json",
            "--until",
            "2 s",
            "--set",
            &pushes,
        ])
    };
    let failed = push("1e6 N", "1 s");
    let error = json(&failed.out)[0]["error"].as_str().unwrap().to_owned();
    assert_eq!(failed.code, 2);
    assert!(
        error.contains("the push `push 1` (--set:1) acts from 1 s to 1.1 s with 1000000 N"),
        "{error}"
    );
    assert!(json(&push("1 N", "1 s").out)[0]["error"].is_null());
}

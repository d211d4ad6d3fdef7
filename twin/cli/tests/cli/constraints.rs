//! Constraints and methods of plants: their choice, and why others are refused.

use std::fs;

use crate::common::{Folder, hanging, json, twin};
use serde_json::{Value, json};

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

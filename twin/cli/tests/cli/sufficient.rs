//! The cheapest sufficient twin of legs that hang and swing, and the proof of its omissions.

use serde_json::Value;
use twinrig::kernel::SimDuration;
use twinrig::{PlantContext, PlantKind, Registry, lcp};

use crate::common::{Folder, twin_of};

/// Legs swing back from 10 degrees, for a third of a second.
const SWING: &str = r#"
robot = "cheetah-cub"
duration = "300 ms"

[plant]
model = "lcp"
base = "fixed"
start = { q1 = "10 deg", q2 = "-9.5 deg", q3 = "9.5 deg" }

[actuator]
kind = "none"

[[expect]]
name = "hips swing back"
signal = { name = "leg/*/hip/position", always = { max = "12 deg" } }

[[expect]]
name = "energy balance closes"
energy = { residual = { max = 1e-5 } }
plants = ["massless", "lcp"]
"#;

fn search(registry: &Registry, path: &str, more: &[&str]) -> (u8, Value) {
    let words = ["plan", path, "--sufficient", "--json"];
    let done = twin_of(registry, &[&words, more].concat());
    (done.code, serde_json::from_str(&done.out).unwrap())
}

#[test]
fn choice_passes_and_its_omissions_change_nothing() {
    let folder = Folder::new("sufficient");
    let path = folder.file("swing.toml", SWING);
    let registry = Registry::standard();
    let (code, found) = search(&registry, &path, &[]);
    assert_eq!(code, 0, "{found:#}");
    let proof = &found["scene"];
    assert_eq!(proof["verdict"], "pass");
    assert!(proof["kept"].as_u64() > Some(0) && proof["put_back"].as_u64() > Some(0));
    assert_eq!(proof["changed_signals"], Value::Array(Vec::new()));
    // A trunk that is held has one start, and no servo restricts the plants.
    assert_eq!(found["starts"], 1);
    let scope = found["scope"].as_str().unwrap();
    assert!(
        scope.starts_with("the scenario's settings only, from its start;"),
        "{scope}"
    );
    assert_eq!(found["reference"]["reference"]["plant"], "lcp");
    let chosen = found["chosen"].as_u64().unwrap();
    let row = &found["rows"][usize::try_from(chosen).unwrap()];
    assert_eq!(row["status"], "sufficient");
    let pairs = row["settings"].as_array().unwrap();
    let set = pairs.iter().map(|pair| {
        let [key, value] = [&pair[0], &pair[1]].map(|word| word.as_str().unwrap());
        format!("{key}={value}")
    });
    let set: Vec<String> = set.collect();
    let mut words = vec!["run", &path, "--no-record"];
    words.extend(set.iter().flat_map(|set| ["--set", set.as_str()]));
    assert_eq!(twin_of(&registry, &words).code, 0);
}

#[test]
fn part_whose_omission_changes_a_signal_is_found() {
    // A plant whose steps depend on whether an energy is asked for.
    let leaky = |context: &PlantContext<'_>| {
        let mut plant = context.plant.clone();
        if !(context.wanted)("energy/kinetic") {
            plant.step = Some(SimDuration::from_millis(1));
        }
        lcp(&PlantContext {
            plant: &plant,
            ..*context
        })
    };
    let leaky = PlantKind::new("leaky", "depends on what is observed", leaky);
    let registry = Registry::standard().with_plant(leaky);
    let text = SWING.replace("model = \"lcp\"", "model = \"leaky\"");
    let folder = Folder::new("sufficient-leaky");
    let path = folder.file("leaky.toml", &text);
    let (code, found) = search(&registry, &path, &["--plant", "leaky"]);
    assert_eq!(code, 1, "{found:#}");
    let changed = found["scene"]["changed_signals"].as_array().unwrap();
    assert!(
        changed.iter().any(|name| name == "leg/LF/hip/position"),
        "{changed:?}"
    );
}

#[test]
fn scenario_without_an_expectation_of_the_system_is_refused() {
    let text = SWING.split_once("[[expect]]").unwrap().0;
    let folder = Folder::new("sufficient-nothing");
    let path = folder.file("expects-nothing.toml", text);
    let done = twin_of(&Registry::standard(), &["plan", &path, "--sufficient"]);
    assert_eq!(done.code, 2);
    let expected = [
        "it expects nothing of the simulated system on lcp",
        "= help: add an [[expect]]",
    ];
    for part in expected {
        assert!(done.err.contains(part), "{}", done.err);
    }
}

#[test]
fn several_plants_require_a_search() {
    let folder = Folder::new("sufficient-plants");
    let path = folder.file("swing.toml", SWING);
    let words = ["plan", &path, "--plant", "lcp", "--plant", "massless"];
    let done = twin_of(&Registry::standard(), &words);
    assert_eq!(done.code, 2);
    assert!(done.err.contains("add --sufficient"), "{}", done.err);
}

//! Ensembles of perturbed runs: the study of robustness, and `ensemble` of a scenario.

use serde_json::Value;
use twinrig::kernel::{Port, SimTime, Unit, signal};
use twinrig::runtime::{Plant, PlantFault, PlantState};
use twinrig::{PlantContext, PlantKind, Registry};

use crate::common::{Done, Folder, SOUND, json, panicking, registry, twin, twin_of};

/// Growth rate of the plant `unstable` \[1/s\]; that of `stable` is the negative.
const RATE: f64 = 4.0;

/// A trunk at 0 that moves away from it, or returns to it, at a speed in proportion to its
/// position: every perturbation grows as exp(rate · t).
struct Linear {
    now: SimTime,
    position: [f64; 3],
    rate: f64,
}

impl Plant for Linear {
    fn name(&self) -> &'static str {
        "linear"
    }

    fn ports(&self) -> Vec<Port> {
        ports()
    }

    fn advance(&mut self, to: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        let factor = libm::exp(self.rate * (to - self.now).as_secs_f64());
        self.position = self.position.map(|x| x * factor);
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&self.position);
    }

    fn state(&self) -> Option<PlantState> {
        Some(PlantState::at(self.now).with(signal::BODY_POSITION, &self.position))
    }

    fn resume_from(&mut self, from: &PlantState) -> Result<Vec<String>, PlantFault> {
        let position = from.get(signal::BODY_POSITION).unwrap();
        self.position.copy_from_slice(position);
        self.now = from.time;
        Ok(Vec::new())
    }
}

fn ports() -> Vec<Port> {
    vec![Port::output(signal::BODY_POSITION, Unit::Meter, 3)]
}

fn linear() -> Registry {
    let kind = |name: &str, rate: f64| {
        let build = move |_: &PlantContext<'_>| {
            Ok(Linear {
                now: SimTime::ZERO,
                position: [0.0; 3],
                rate,
            })
        };
        PlantKind::new(name, "moves away from 0, or to it", build).with_ports(|_| Ok(ports()))
    };
    registry()
        .with_plant(kind("unstable", RATE))
        .with_plant(kind("stable", -RATE))
}

/// One expectation has its measured value as its bound, the other is far from it at first.
fn scenario(plant: &str, more: &str) -> String {
    format!(
        "{more}
        robot = \"cheetah-cub\"
        duration = \"10 s\"
        plant = {{ model = \"{plant}\" }}
        [[expect]]
        name = \"stays at 0\"
        signal = {{ name = \"body/position\", component = \"x\", always = {{ max = \"0 m\" }} }}
        [[expect]]
        name = \"stays near 0\"
        signal = {{ name = \"body/position\", always = {{ near = \"0 m\", within = \"1 m\" }} }}
        "
    )
}

fn study(files: &[&str], options: &[&str], folder: &Folder) -> Done {
    let out = folder.join("out");
    let begin = ["study", "robustness", "--out", &out];
    twin_of(&linear(), &[&begin[..], files, options].concat())
}

fn close(found: &Value, expected: f64, within: f64) {
    let found = found.as_f64().unwrap();
    assert!(
        (found - expected).abs() <= within,
        "{found}, not {expected}"
    );
}

#[test]
fn growth_horizon_and_expectation_at_its_bound_are_found() {
    let folder = Folder::new("robustness");
    let unstable = folder.file("unstable.toml", &scenario("unstable", ""));
    let stable = folder.file("stable.toml", &scenario("stable", ""));
    let done = study(&[&unstable, &stable], &["--json"], &folder);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    let results = json(&done.out).remove(0)["results"].take();

    let growing = &results[0];
    close(&growing["growth"]["per_second"], RATE, 1e-9);
    // Each coordinate, 0, is a unit in the last place of 2⁻¹⁰ away, and the samples are 6 ms apart.
    let least = 1.0 / 1024.0_f64;
    let unit = least.next_up() - least;
    let horizon = libm::log(1e-3 / (unit * 3.0_f64.sqrt())) / RATE;
    close(&growing["horizon_s"], horizon + 0.003, 0.0031);
    assert_eq!(growing["case"]["kind"], "starts");
    assert_eq!(growing["undetermined"], serde_json::json!(["stays at 0"]));
    let [at, near] = [0, 1].map(|n| &growing["expectations"][n]);
    assert_eq!(
        (&at["margin"], &at["verdict"]),
        (&0.0.into(), &"pass".into())
    );
    assert_eq!(at["changes_at"], "1 ulp");
    assert!((1..32).contains(&at["held"].as_u64().unwrap()), "{at}");
    // A perturbation p passes 1 m after 10 s from p exp(10 λ) on, 4e-18.
    assert_eq!((&near["held"], &near["runs"]), (&5.into(), &32.into()));
    close(&near["changes_at"], 1e-15, 1e-27);

    let returning = &results[1];
    assert_eq!(
        (&returning["growth"], &returning["horizon_s"]),
        (&Value::Null, &Value::Null)
    );
    let near = &returning["expectations"][1];
    assert_eq!((&near["held"], &near["changed"]), (&32.into(), &0.into()));

    let stem = folder.join("out/robustness-unstable-stable");
    let read = |ending: &str| std::fs::read_to_string(format!("{stem}.{ending}")).unwrap();
    let csv = read("csv");
    let held = csv
        .lines()
        .filter(|line| line.contains("stays near 0,pass"));
    assert_eq!(held.count(), 5 + 32);
    let table = read("md");
    assert!(table.contains("## unstable, on unstable"), "{table}");
    assert!(table.contains("| stays near 0 | **5 of 32** |"), "{table}");
    assert!(read("html").contains("1 ulp") && read("json").contains("unstable"));
}

#[test]
fn results_are_independent_of_the_number_of_jobs() {
    let folder = Folder::new("robustness-jobs");
    let file = folder.file("unstable.toml", &scenario("unstable", ""));
    let results = ["1", "3"].map(|jobs| {
        let done = study(
            &[&file],
            &["--json", "--jobs", jobs, "--ensemble", "9"],
            &folder,
        );
        json(&done.out).remove(0)["results"].take()
    });
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0][0]["runs"].as_array().unwrap().len(), 8);
}

#[test]
fn ensemble_of_a_scenario_keeps_fingerprint_and_recording_and_judges_shares() {
    let folder = Folder::new("ensemble");
    let plain = scenario("unstable", "");
    let run = |name: &str, text: &str| {
        let (file, out) = (folder.file("run.toml", text), folder.join(name));
        let done = twin_of(&linear(), &["run", &file, "--json", "--out", &out]);
        let bytes = std::fs::read(folder.join(&format!("{name}/run-seed1.mcap")));
        (done.code, json(&done.out).remove(0), bytes.unwrap())
    };
    let (code, one, _) = run("one", &plain);
    assert_eq!(
        (code, &one["expectations"][0]["ensemble"]),
        (0, &Value::Null)
    );
    let ensemble =
        |name: &str, value: &str| run(name, &scenario("unstable", &format!("ensemble = {value}")));
    let (code, many, recorded) = ensemble("many", "32");
    assert_eq!((code, &many["fingerprint"]), (1, &one["fingerprint"]));
    // The text of the scenario is in its recording.
    let (_, _, again) = ensemble("many", "32");
    assert!(recorded == again);
    let near = &many["expectations"][1];
    assert_eq!(
        (&near["verdict"], &near["ensemble"]["held"]),
        (&"pass".into(), &5.into())
    );
    let (code, few, _) = ensemble("few", "{ runs = 32, share = 0.1 }");
    assert_eq!((code, &few["verdict"]), (0, &"pass".into()));

    // The shares of the study.
    let file = folder.file("unstable.toml", &plain);
    let study = json(&study(&[&file], &["--json"], &folder).out).remove(0);
    let studied = &study["results"][0]["expectations"];
    for (index, line) in many["expectations"].as_array().unwrap().iter().enumerate() {
        for key in ["held", "share", "margins", "changes_at"] {
            assert_eq!(line["ensemble"][key], studied[index][key], "{key}");
        }
    }
}

#[test]
fn plants_without_named_state_differ_by_seed_and_hardware_is_refused() {
    let folder = Folder::new("ensemble-seeds");
    let file = folder.file("sound.toml", &format!("ensemble = 3\n{SOUND}"));
    let begin = ["run", &file, "--no-record", "--json"];
    let done = twin_of(&registry(), &begin);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    let found = &json(&done.out)[0]["expectations"][0]["ensemble"];
    assert_eq!(
        (&found["differ_by"], &found["held"]),
        (&"seeds".into(), &3.into())
    );

    let refused = twin_of(
        &registry(),
        &[&begin[..], &["--port", "sbcp=/dev/null"]].concat(),
    );
    assert!(
        refused.code == 2 && refused.out.contains("no runs on hardware"),
        "{}",
        refused.out
    );

    let text = format!(
        "ensemble = 3\n{}",
        SOUND.replace("\"toy\"", "\"panicking\"")
    );
    let file = folder.file("panicking.toml", &text);
    let done = twin_of(&panicking(), &["run", &file, "--no-record", "--json"]);
    assert!(
        done.code == 2 && done.out.contains("out of cheese"),
        "{}",
        done.out
    );
}

/// A run that draws no random number has the same fingerprint with every seed, one that does
/// another.
#[test]
fn random_streams_of_a_run_decide_whether_seeds_have_an_effect() {
    const EXPECT: &str = "expect=[{name='height',body={height={min='1 cm'}}}]";
    for (name, is_random) in [
        ("trot", false),
        ("oncilla-trot", false),
        ("tegotae-noisy", true),
    ] {
        let file = format!("{}/../../scenarios/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let run = |options: &[&str]| {
            let begin = ["run", &file, "--no-record", "--json", "--until", "0.6 s"];
            let done = twin(&[&begin, &["--set", EXPECT][..], options].concat());
            assert_eq!(done.code, 0, "{}", done.out);
            json(&done.out).remove(0)
        };
        let [one, other] = ["1", "2"].map(|seed| run(&["--seed", seed]));
        let drawn = one["random"].as_array().unwrap();
        assert_eq!(!drawn.is_empty(), is_random, "{name}: {drawn:?}");
        assert_eq!(one["random"], other["random"]);
        assert_eq!(
            one["fingerprint"] != other["fingerprint"],
            is_random,
            "{name}"
        );

        let over_seeds = run(&["--seeds", "3"]);
        assert_eq!(over_seeds["fingerprint"], one["fingerprint"]);
        let ensemble = &over_seeds["expectations"][0]["ensemble"];
        assert_eq!(
            (&ensemble["differ_by"], &ensemble["runs"]),
            (&"seeds".into(), &3.into())
        );
        let margins = &ensemble["margins"];
        assert_eq!(
            margins["min"] != margins["max"],
            is_random,
            "{name}: {margins}"
        );
    }
}

/// A leg that falls and a stand are not chaotic.
#[test]
fn drop_of_a_leg_never_changes_its_verdicts() {
    let folder = Folder::new("robustness-drop");
    let file = format!(
        "{}/../../scenarios/leg-drop.toml",
        env!("CARGO_MANIFEST_DIR")
    );
    let out = folder.join("out");
    let done = twin(&[
        "study",
        "robustness",
        &file,
        "--json",
        "--ensemble",
        "9",
        "--out",
        &out,
    ]);
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    let result = json(&done.out).remove(0)["results"][0].take();
    assert_eq!(
        (&result["horizon_s"], &result["case"]["kind"]),
        (&Value::Null, &"starts".into())
    );
    for one in result["expectations"].as_array().unwrap() {
        assert_eq!(one["changed"], 0, "{one}");
    }
}

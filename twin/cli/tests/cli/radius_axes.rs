//! Radii along the axes of loads, pushes and sensors, alone and of a study of robustness.

use std::process::{Child, Command, Stdio};

use serde_json::Value;
use twinrig::kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig::runtime::Process;
use twinrig::{BuildKey, ControllerKind, Registry};

use crate::common::{Folder, json, registry, twin_of};
use crate::hardware::wait_until;

/// A robot that falls, pushed at 2 N.
const PUSHED: &str = r#"
robot = "cheetah-cub"
duration = "400 ms"
plant = { model = "massless", base = "free" }
push = [{ on = "body", at = "0.1 s", for = "50 ms", force = "2 N", direction = "y" }]
[[expect]]
name = "kinetic energy"
signal = { name = "energy/kinetic", always = { max = "10 J" } }
[[expect]]
name = "force"
signal = { name = "body/push/force", component = "y", always = { max = "5 N" } }
"#;

/// A robot that falls.
const FREE: &str = r#"
robot = "cheetah-cub"
duration = "400 ms"
plant = { model = "massless", base = "free" }
[[expect]]
name = "is slow"
signal = { name = "body/velocity", component = "y", always = { max = "0.1 m/s" } }
"#;

/// Reads the attitude of a trunk that does not turn.
const READER: &str = r#"
robot = "cheetah-cub"
duration = "400 ms"
plant = { model = "toy" }
controller = { kind = "reader", period = "10 ms" }
[[expect]]
name = "reads no roll"
signal = { name = "reader/greatest", always = { max = "0.1 rad" } }
"#;

/// Controller that outputs the greatest roll that it has read.
#[derive(Default)]
struct Reader {
    greatest: f64,
}

impl Process for Reader {
    fn name(&self) -> &'static str {
        "reader"
    }

    fn ports(&self) -> Vec<Port> {
        let [input, output] = ["body/rpy", "reader/greatest"];
        vec![
            Port::input(input, Unit::Radian, 3),
            Port::output(output, Unit::Radian, 1),
        ]
    }

    fn is_monitor(&self, port: &str) -> bool {
        port == "reader/greatest"
    }

    fn step(&mut self, _: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        self.greatest = self.greatest.max(inputs[0]);
        outputs[0] = self.greatest;
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.greatest)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.greatest = snapshot.read()?;
        Ok(())
    }
}

fn built() -> Registry {
    let reader = ControllerKind::new("reader", "reads", |_| Ok(Reader::default()));
    let registry = registry().with_build(BuildKey::of_bytes(b"one"));
    registry.with_controller(reader)
}

/// Returns the radius of an expectation along an axis, of a result in JSON.
fn holds_to(result: &Value, axis: &str, expectation: &str) -> f64 {
    let named = |list: &Value, name: &str| {
        let all = list.as_array().unwrap().iter();
        let mut found = all.filter(|it| it["name"] == name).cloned();
        found.next().unwrap()
    };
    let axis = named(&result["axes"], axis);
    let one = named(&axis["expectations"], expectation);
    one["holds_to"].as_f64().unwrap()
}

fn study(folder: &Folder, kind: &str, scenario: &str, more: &[&str]) -> Value {
    let (scenario, out) = (folder.join(scenario), folder.join("out"));
    let words = ["study", kind, &scenario, "--out", &out, "--json"];
    let done = twin_of(&built(), &[&words, more].concat());
    assert_eq!(done.code, 0, "{done:?}");
    json(&done.out)[0].clone()
}

/// In free fall the kinetic energy is m g² t² / 2, and that of the motion to the left J² / 2 m.
#[test]
fn payload_and_push_are_those_of_the_closed_form() {
    let folder = Folder::new("radius-loads");
    folder.file("pushed.toml", PUSHED);
    folder.file("free.toml", FREE);
    let axes = ["--axis", "payload", "--axis", "pushes-up"];
    let result = study(&folder, "radius", "pushed.toml", &axes);
    assert!((holds_to(&result, "pushes-up", "force") / 2.5 - 1.0).abs() < 0.01);
    let square = |x: f64| x * x;
    let energy = |mass: f64| mass * square(9.80665 * 0.4) / 2.0 + square(0.1) / (2.0 * mass);
    let payload = holds_to(&result, "payload", "kinetic energy");
    // The brackets are 1 % of the payload wide; springs of the legs take and give a little.
    assert!(energy(1.1 + 0.98 * payload) < 10.0, "{result}");
    assert!(energy(1.1 + 1.02 * payload) > 10.0, "{result}");
    let planar = FREE
        .replace("\"free\"", "\"planar\"")
        .replace("\"y\"", "\"x\"");
    folder.file("planar.toml", &planar);
    // A planar robot is pushed forward, others to the left.
    for scenario in ["free.toml", "planar.toml"] {
        let result = study(&folder, "radius", scenario, &["--axis", "push"]);
        // Between the momentum of the trunk alone and that of the robot: legs swing.
        let momentum = holds_to(&result, "push", "is slow");
        assert!((0.09..0.11).contains(&momentum), "{scenario}: {momentum}");
    }
}

/// The readings are in proportion to the noise, and so are their distances from the bound.
#[test]
fn noise_of_a_sensor_fails_at_its_greatest_value() {
    let folder = Folder::new("radius-noise");
    folder.file("reader.toml", READER);
    let axis = ["--axis", "sensor-noise-angle"];
    let result = study(&folder, "radius", "reader.toml", &axis);
    let margins = &result["axes"][0]["expectations"][0]["margins"];
    let last = margins.as_array().unwrap().last().unwrap();
    let [noise, margin] = [0, 1].map(|index| last[index].as_f64().unwrap());
    let greatest = (0.1 - margin) / noise;
    // Of 40 normal variates: below 1.4 and above 3.9 with a probability of 4 % and 0.2 %.
    assert!((1.4..3.9).contains(&greatest), "{result}");
    let product = greatest * holds_to(&result, "sensor-noise-angle", "reads no roll") / 0.1;
    assert!((0.99..=1.0).contains(&product), "{result}");
}

/// The study of robustness has the same radii, and the same files of them.
#[test]
fn robustness_has_the_radii_if_asked() {
    let folder = Folder::new("radius-robustness");
    folder.file("pushed.toml", PUSHED);
    let few = ["--ensemble", "2"];
    let without = study(&folder, "robustness", "pushed.toml", &few);
    assert!(without.get("radius").is_none());
    let path = folder.join("out/radius-pushed.csv");
    assert!(!std::fs::exists(&path).unwrap());
    let with = [&few[..], &["--radius"]].concat();
    let with = study(&folder, "robustness", "pushed.toml", &with);
    let csv = std::fs::read_to_string(&path).unwrap();
    let alone = study(&folder, "radius", "pushed.toml", &[]);
    assert_eq!(with["radius"], Value::from(vec![alone]));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), csv);
}

/// Killed in the midst of its runs, it continues and gives the same files, byte for byte.
#[test]
fn killed_study_continues_with_the_same_radii() {
    let folder = Folder::new("radius-killed");
    let scenario = folder.file("pushed.toml", PUSHED);
    let start = |out: &str| -> Child {
        Command::new(env!("CARGO_BIN_EXE_twin"))
            .args(["study", "radius", &scenario, "--axis", "payload", "--out"])
            .arg(folder.join(out))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let rows = |out: &str| {
        let path = folder.join(&format!("{out}/radius-pushed/all.jsonl"));
        std::fs::metadata(path).map_or(0, |metadata| metadata.len())
    };
    let files = |out: &str| {
        let files = ["html", "csv", "json", "md"].into_iter();
        let path = |ending| folder.join(&format!("{out}/radius-pushed.{ending}"));
        let texts = files.map(|ending| std::fs::read_to_string(path(ending)).unwrap());
        texts.collect::<Vec<_>>()
    };
    assert!(start("whole").wait().unwrap().success());
    let end = rows("whole");
    for part in 0..2 {
        let mut child = start("parts");
        wait_until("runs are stored", || {
            rows("parts") > part * end / 4 || child.try_wait().unwrap().is_some()
        });
        child.kill().unwrap();
        child.wait().unwrap();
        if part == 0 {
            assert!(rows("parts") < end);
        }
    }
    assert!(start("parts").wait().unwrap().success());
    assert_eq!(files("parts"), files("whole"));
}

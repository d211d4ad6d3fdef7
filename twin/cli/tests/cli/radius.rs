//! Radii: planted weaknesses are found, and neither workers nor interruptions change the answer.

use serde_json::Value;
use twinrig::kernel::{Port, SimDuration, Snapshot, SnapshotError, Unit};
use twinrig::runtime::Process;
use twinrig::runtime::interrupt::Token;
use twinrig::{BuildKey, ControllerKind, Registry};

use crate::common::{Done, Folder, json, registry, twin_of};

/// Controller with three weaknesses: it is lost if an iteration begins later than 3.0 ms after the
/// one before, it resonates if that takes from 1.75 ms to 2.25 ms, and it hums if it takes 3.0 ms
/// or 3.25 ms.
#[derive(Default)]
struct Brittle {
    lost: bool,
    resonates: bool,
    hums: bool,
}

impl Process for Brittle {
    fn name(&self) -> &'static str {
        "brittle"
    }

    fn ports(&self) -> Vec<Port> {
        let output = |name| Port::output(name, Unit::One, 1);
        ["brittle/lost", "brittle/resonates", "brittle/hums"]
            .map(output)
            .to_vec()
    }

    fn is_monitor(&self, _: &str) -> bool {
        true
    }

    fn step(&mut self, elapsed: SimDuration, _: &[f64], outputs: &mut [f64]) {
        let us = elapsed.as_nanos() / 1000;
        self.lost |= us > 3000;
        self.resonates |= (1750..=2250).contains(&us);
        self.hums |= (3000..=3250).contains(&us);
        outputs.copy_from_slice(&[self.lost, self.resonates, self.hums].map(f64::from));
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(self.lost, self.resonates, self.hums))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.lost, self.resonates, self.hums) = snapshot.read()?;
        Ok(())
    }
}

/// The latency is a multiple of the period for the controller: of 0.25 ms.
const BRITTLE: &str = r#"
robot = "cheetah-cub"
duration = "100 ms"
plant = { model = "toy" }
controller = { kind = "brittle", period = "0.25 ms" }
[[expect]]
name = "is not lost"
signal = { name = "brittle/lost", always = { max = 0 } }
[[expect]]
name = "does not resonate"
signal = { name = "brittle/resonates", always = { max = 0 } }
[[expect]]
name = "bobs"
body = { height = { min = "10 cm" } }
[[expect]]
name = "leaps"
body = { height = { min = "1 m" } }
"#;

/// The controller hums at latencies above 2.75 ms, up to 3.25 ms.
const WINDOW: &str = r#"
robot = "cheetah-cub"
duration = "100 ms"
plant = { model = "toy" }
controller = { kind = "brittle", period = "0.25 ms" }
[[expect]]
name = "does not hum"
signal = { name = "brittle/hums", always = { max = 0 } }
"#;

const LATENCY: &[&str] = &["--along", "controller.compute_time=0 ms", "--to", "5 ms"];

fn built() -> Registry {
    let brittle = ControllerKind::new("brittle", "is easily lost", |_| Ok(Brittle::default()));
    let registry = registry().with_build(BuildKey::of_bytes(b"one"));
    registry.with_controller(brittle)
}

struct Radius {
    folder: Folder,
    scenario: String,
}

impl Radius {
    fn new(test: &str, scenario: &str) -> Self {
        let folder = Folder::new(&format!("radius-{test}"));
        Self {
            scenario: folder.file("weak.toml", scenario),
            folder,
        }
    }

    fn run(&self, out: &str, more: &[&str]) -> Done {
        let out = self.folder.join(out);
        let words = ["study", "radius", &self.scenario, "--out", &out];
        twin_of(&built(), &[&words, more].concat())
    }

    fn axis(&self, out: &str, more: &[&str]) -> Value {
        let done = self.run(out, &[&["--json"], more].concat());
        assert!(done.code < 2, "{done:?}");
        json(&done.out)[0]["axes"][0].clone()
    }

    fn files(&self, out: &str) -> Vec<String> {
        let files = ["html", "csv", "json", "md"].into_iter();
        let path = |ending| self.folder.join(&format!("{out}/radius-weak.{ending}"));
        files
            .map(|ending| std::fs::read_to_string(path(ending)).unwrap())
            .collect()
    }
}

/// The controller fails as soon as an iteration takes longer than 3.0 ms: to 1 % and to 0.01 %. Its
/// other weakness, a window of latencies from 1.5 ms to 2.25 ms, is between two values of the grid.
#[test]
fn planted_weaknesses_are_found() {
    let radius = Radius::new("planted", BRITTLE);
    for (out, precision) in [("coarse", 0.01), ("fine", 1e-4)] {
        let share = precision.to_string();
        let axis = radius.axis(out, &[LATENCY, &["--precision", &share]].concat());
        let found = |index: usize| &axis["expectations"][index];
        for (index, (threshold, monotone)) in
            [(3e-3, true), (1.5e-3, false)].into_iter().enumerate()
        {
            let value = |name: &str| found(index)[name].as_f64().unwrap();
            let (holds, fails) = (value("holds_to"), value("fails_at"));
            assert!(holds <= threshold && threshold <= fails, "{axis}");
            assert!(fails - holds <= precision * fails, "{axis}");
            let again = found(index)["holds_again"].as_array().unwrap();
            assert_eq!(again.is_empty(), monotone, "{axis}");
            let inside = |it: &Value| (2.25e-3..=5e-3).contains(&it.as_f64().unwrap());
            assert!(again.iter().all(inside), "{axis}");
        }
        assert_eq!(axis["first"], Value::from(vec!["does not resonate"]));
        assert_eq!(found(2)["state"], "beyond");
        assert_eq!(found(2)["holds_to"], 5e-3);
        assert_eq!(found(3)["state"], "fails-undisturbed");
    }
    let [_, _, _, markdown] = radius.files("coarse").try_into().unwrap();
    assert!(markdown.contains("| leaps | fails |\n"), "{markdown}");
    assert!(markdown.contains(r" ms\*** |"), "{markdown}");
}

/// The window in which the controller hums is 7 % of the range and between two values of the grid;
/// it is found in both directions of the axis. What could be missed is stated.
#[test]
fn window_of_a_fifteenth_of_the_range_is_found_in_both_directions() {
    for (from, to, threshold) in [("0.1 ms", "7.3 ms", 2.75e-3), ("7.3 ms", "0.1 ms", 3.25e-3)] {
        let radius = Radius::new("window", WINDOW);
        let key = format!("controller.compute_time={from}");
        let along = ["--along", &key, "--to", to];
        let axis = radius.axis("out", &along);
        let one = &axis["expectations"][0];
        let value = |name: &str| one[name].as_f64().unwrap();
        let [least, greatest] = [value("holds_to"), value("fails_at")];
        let [least, greatest] = [least.min(greatest), least.max(greatest)];
        assert!((least..=greatest).contains(&threshold), "{axis}");
        assert!(greatest - least <= 0.01 * 7.2e-3, "{axis}");
        assert!(!one["holds_again"].as_array().unwrap().is_empty(), "{axis}");
        assert!(value("resolution") <= 7.2e-3 / 15.0, "{axis}");
        let text = radius.run("out", &along).out;
        assert!(text.contains("could be missed"), "{text}");
        let html = &radius.files("out")[0];
        assert!(html.contains("every window of failures wider than"));
    }
}

/// A disturbance that the scenario does not permit ends the axis; a fault of the plant fails all.
#[test]
fn invalid_values_end_an_axis_and_faults_fail_all_expectations() {
    let radius = Radius::new("ends", BRITTLE);
    let axis = radius.axis(
        "out",
        &["--along", "expect.2.body.height.min", "--to", "13 cm"],
    );
    // The bound meets the height that is measured without a disturbance.
    let bobs = &axis["expectations"][2];
    let lowest = 0.1 + bobs["margins"][0][1].as_f64().unwrap();
    let [holds, fails] = ["holds_to", "fails_at"].map(|key| bobs[key].as_f64().unwrap());
    assert!(
        holds <= lowest && lowest <= fails && fails - holds < 2e-4,
        "{axis}"
    );
    // A height is not judged by observations that are more than 20 ms apart.
    let axis = radius.axis(
        "period",
        &["--along", "observe.period=2 ms", "--to", "50 ms"],
    );
    let end = &axis["end"]["refused"];
    let [to, from] = ["to", "from"].map(|key| end[key].as_f64().unwrap());
    assert!(
        to <= 0.02 && 0.02 < from && from - to <= 0.01 * from,
        "{axis}"
    );
    assert!(
        end["reason"].as_str().unwrap().contains("too long"),
        "{axis}"
    );
    assert_eq!(axis["expectations"][0]["holds_to"], end["to"]);
    // It snaps at 0.5 s: with a duration from there on.
    let snaps = Radius::new("snaps", &BRITTLE.replace("\"toy\"", "\"snapping\""));
    let axis = snaps.axis("out", &["--along", "duration", "--to", "1 s"]);
    for one in &axis["expectations"].as_array().unwrap()[..3] {
        assert!(
            one["error"].as_str().unwrap().contains("it snapped"),
            "{axis}"
        );
        let fails = one["fails_at"].as_f64().unwrap();
        assert!((0.5..0.505).contains(&fails), "{axis}");
    }
}

#[test]
fn number_of_workers_has_no_influence_and_a_second_study_costs_nothing() {
    let radius = Radius::new("jobs", BRITTLE);
    for jobs in ["1", "2", "3"] {
        radius.run(jobs, &[LATENCY, &["--jobs", jobs]].concat());
        assert_eq!(radius.files(jobs), radius.files("1"));
    }
    let rows = radius.folder.join("1/radius-weak/all.jsonl");
    let before = std::fs::read_to_string(&rows).unwrap();
    assert_eq!(radius.run("1", LATENCY).code, 1);
    assert_eq!(std::fs::read_to_string(&rows).unwrap(), before);
    // Of a process that was killed in the midst of a row.
    let lines: Vec<&str> = before.split_inclusive('\n').collect();
    let part = lines[..lines.len() / 2].concat() + "{\"check\":\"0123";
    std::fs::write(&rows, part).unwrap();
    let files = radius.files("1");
    let continued = radius.run("1", LATENCY);
    assert_eq!(continued.code, 1);
    assert!(continued.out.contains("1 damaged line in"), "{continued:?}");
    assert_eq!(radius.files("1"), files);
    // An interrupt before the first run.
    let token = Token::new();
    token.request();
    let done = token.scope(|| radius.run("interrupted", LATENCY));
    assert_eq!(done.code, 2);
    assert!(done.err.contains("the same command continues"), "{done:?}");
    assert_eq!(radius.run("interrupted", LATENCY).code, 1);
    assert_eq!(radius.files("interrupted"), files);
}

#[test]
fn mistakes_are_errors_with_a_remedy() {
    let radius = Radius::new("mistakes", BRITTLE);
    for (words, expected) in [
        (
            &["--axis", "frictoin-up"][..],
            "did you mean `friction-up`?",
        ),
        (&["--axis", "friction-up"], "there is no ground"),
        (&["--along", "seed.x", "--to", "3"], "--along seed.x=VALUE"),
        (
            &["--along", "duration", "--to", "3 m"],
            "--to 3 m is a length in m, and `duration` is a duration in s",
        ),
        (
            &["--along", "duration", "--to", "5"],
            "write its unit, as in --to \"5 s\"",
        ),
        (&["--along", "duration"], "1 --along and 0 --to"),
        (
            &["--along", "expect.7.after=0 s", "--to", "1 s"],
            "list with 4",
        ),
        (
            &["--along", "controller.compute_time=0 s", "--to=-1 s"],
            "a duration is not",
        ),
        (&["--precision", "2"], "it must be from"),
    ] {
        let done = radius.run("out", words);
        assert_eq!(done.code, 2, "{done:?}");
        assert!(done.err.contains(expected), "{words:?}: {done:?}");
    }
}

//! Sweeps: rows that commands repeat, stores that survive their process, verdicts.

mod engines;
mod errors;
mod rows;
#[cfg(unix)]
mod stores;
mod verdicts;

use serde_json::Value;
use twinrig::{BuildKey, Registry};

use crate::common::{Done, Folder, json, registry, twin_of};

/// Scenario whose timing, and with it the fingerprint, depends on the seed.
const STAND: &str = r#"
robot = "cheetah-cub"
duration = "100 ms"
plant = { model = "massless" }
[controller]
kind = "stand"
period = "2 ms"
compute_time = { min = "200 us", max = "900 us" }
[[expect]]
name = "stands"
body = { height = { min = "1 cm" } }
[[expect]]
name = "still stands"
body = { height = { min = "1 cm" } }
after = "60 ms"
"#;

/// Twelve seeds.
const SEEDS: &str = "[[dimension]]\nkey = 'seed'\nfrom = 1\nto = 12\n";

/// The registry of the tests under a build key of their own, as the test program is large.
fn built(build: &str) -> Registry {
    registry().with_build(BuildKey::of_bytes(build.as_bytes()))
}

/// A folder with a scenario and a specification.
struct Sweep {
    folder: Folder,
    scenario: String,
    spec: String,
}

impl Sweep {
    fn new(test: &str, scenario: &str, spec: &str) -> Self {
        let folder = Folder::new(&format!("sweep-{test}"));
        Self {
            scenario: folder.file("stand.toml", scenario),
            spec: folder.file("spec.toml", spec),
            folder,
        }
    }

    /// Sweeps with results in the folder `out`.
    fn run_of(&self, registry: &Registry, out: &str, more: &[&str]) -> Done {
        let out = self.folder.join(out);
        let words = ["sweep", &self.scenario, &self.spec, "--out", &out];
        twin_of(registry, &[&words, more].concat())
    }

    fn run(&self, out: &str, more: &[&str]) -> Done {
        self.run_of(&built("one"), out, more)
    }

    /// Sweeps with the exit code `code`; returns the JSON object.
    fn json(&self, code: u8, out: &str, more: &[&str]) -> Value {
        let done = self.run(out, &[more, &["--json"]].concat());
        assert_eq!(done.code, code, "{:.600} {}", done.out, done.err);
        json(&done.out).remove(0)
    }

    /// Returns the files of the results.
    fn files(&self, out: &str) -> Vec<String> {
        let names = ["rows.csv", "sweep.json", "report.html"];
        let read = |name: &str| {
            let path = self.folder.join(&format!("{out}/{name}"));
            std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
        };
        names.map(read).into()
    }
}

fn texts<'v>(values: &'v Value, key: &str) -> Vec<&'v str> {
    let values = values.as_array().unwrap().iter();
    values.map(|value| value[key].as_str().unwrap()).collect()
}

//! Optimisations: the same answer after interruptions and for any workers, and scenarios that have
//! it.

mod answers;
mod best;
mod cases;
mod errors;
mod falls;
#[cfg(unix)]
mod resumption;

use serde_json::Value;
use twinrig::{BuildKey, Registry};

use crate::common::{Done, Folder, json, registry, twin_of};

/// A gait of which some settings fall.
const WALK: &str = r#"# A walk.
robot = "cheetah-cub"
duration = "1200 ms"
plant = { model = "massless", ground = { friction = 0.6 } }
[actuator]
lag = "5 ms"
speed = "20 rad/s"
[controller]
kind = "cpg"
period = "2 ms"
frequency = "3 Hz"             # of all legs
step_length = "6 cm"
hip_height = { fore = "125 mm", hind = "125 mm" }
phase_output = true
ramp = "300 ms"
[[expect]]
name = "speed"
body = { speed = { min = "5 cm/s" } }
after = "400 ms"
[[expect]]
name = "stays up"
body = { fall = false }
[[expect]]
name = "level"
body = { pitch_range = { max = "12 deg" } }
before = "700 ms"
[[expect]]
name = "fitness"
gait = { fitness = { min = 3.5 } }
"#;

/// Two dimensions; many of their points fall.
const SPACE: &str = "maximize = 'speed'\nparticles = 6\niterations = 4\n\
                     [[dimension]]\nkey = 'hip_height/fore'\nfrom = '8 cm'\nto = '14 cm'\n\
                     [[dimension]]\nkey = 'step_length'\nfrom = '4 cm'\nto = '2 m'\n\
                     scale = 'logarithmic'\n";

/// The registry of the tests under a build key of its own, as the test program is large.
fn built() -> Registry {
    registry().with_build(BuildKey::of_bytes(b"one"))
}

/// A folder with a scenario and a search space.
struct Optimization {
    folder: Folder,
    scenario: String,
    space: String,
}

impl Optimization {
    fn new(test: &str, scenario: &str, space: &str) -> Self {
        let folder = Folder::new(&format!("optimize-{test}"));
        Self {
            scenario: folder.file("walk.toml", scenario),
            space: folder.file("space.toml", space),
            folder,
        }
    }

    /// Optimises with results in the folder `out`.
    fn run_of(&self, registry: &Registry, out: &str, more: &[&str]) -> Done {
        let out = self.folder.join(out);
        let words = [
            "optimize",
            &self.scenario,
            "--space",
            &self.space,
            "--out",
            &out,
        ];
        twin_of(registry, &[&words, more].concat())
    }

    fn run(&self, out: &str, more: &[&str]) -> Done {
        self.run_of(&built(), out, more)
    }

    /// Optimises with the exit code `code`; returns the JSON object.
    fn json(&self, code: u8, out: &str, more: &[&str]) -> Value {
        let done = self.run(out, &[more, &["--json"]].concat());
        assert_eq!(done.code, code, "{:.600} {}", done.out, done.err);
        json(&done.out).remove(0)
    }

    fn read(&self, out: &str, name: &str) -> String {
        let path = self.folder.join(&format!("{out}/{name}"));
        std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
    }

    /// Returns the files of the results.
    fn files(&self, out: &str) -> Vec<String> {
        let names = [
            "best.toml",
            "history.csv",
            "points.csv",
            "optimization.json",
            "report.html",
        ];
        names.map(|name| self.read(out, name)).into()
    }
}

//! Toy plants with configurable faults, and functions that execute commands.

use serde::{Deserialize, Serialize};
use twinrig::kernel::{Port, SimDuration, SimTime, Snapshot, SnapshotError, Unit};
use twinrig::runtime::{EnergyBalance, Plant, PlantFault, Process};
use twinrig::{BuildError, ControllerKind, PlantContext, PlantKind, Registry, run_with};
pub use twinrig_testing::folder::Folder;

/// Trunk that oscillates around a height of 12 cm and moves forward at 0.5 m/s; it fails from
/// `fails_at` on and panics at `panics_at`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Toy {
    now: SimTime,
    height: f64,
    rate: f64,
    forward: f64,
    fails_at: Option<SimTime>,
    panics_at: Option<SimTime>,
}

impl Toy {
    /// Returns a plant that neither fails nor panics.
    pub fn sound() -> Self {
        Self {
            now: SimTime::ZERO,
            height: 0.13,
            rate: 0.0,
            forward: 0.0,
            fails_at: None,
            panics_at: None,
        }
    }
}

impl Plant for Toy {
    fn name(&self) -> &'static str {
        "toy"
    }

    fn ports(&self) -> Vec<Port> {
        toy_ports()
    }

    fn advance(&mut self, to: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        assert!(self.panics_at.is_none_or(|at| to < at), "out of cheese");
        let seconds = (to - self.now).as_secs_f64();
        if self.fails_at.is_some_and(|at| to >= at) {
            return Err(PlantFault {
                time: self.now,
                part: "toy/spring".to_owned(),
                energy: 1.5,
                why: "it snapped".to_owned(),
            });
        }
        self.rate -= seconds * 400.0 * (self.height - 0.12);
        self.height += seconds * self.rate;
        self.forward += seconds * 0.5;
        self.now = to;
        Ok(())
    }

    fn observe(&mut self, outputs: &mut [f64]) {
        outputs.copy_from_slice(&[self.forward, 0.0, self.height, 0.0, 0.01, 0.0]);
    }

    fn energy(&self) -> EnergyBalance {
        EnergyBalance {
            exchanged: 2.0,
            residual: 1e-9,
            ..EnergyBalance::default()
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(self)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        *self = snapshot.read()?;
        Ok(())
    }
}

pub fn toy_ports() -> Vec<Port> {
    vec![
        Port::output("body/position", Unit::Meter, 3),
        Port::output("body/rpy", Unit::Radian, 3),
    ]
}

/// Returns the registry with parts that panic: the plant `panicking` at 0.5 s, the plant
/// `unbuildable` when it is built, and the controller `clumsy` at its third step.
pub fn panicking() -> Registry {
    let half = SimTime::from_nanos(500_000_000);
    let toy = move |_: &PlantContext<'_>| {
        Ok(Toy {
            panics_at: Some(half),
            ..Toy::sound()
        })
    };
    let unbuildable = |_: &PlantContext<'_>| -> Result<Toy, BuildError> {
        panic!("no blueprint");
    };
    registry()
        .with_plant(toy_kind("panicking", "bobs, then panics", toy))
        .with_plant(toy_kind("unbuildable", "is never there", unbuildable))
        .with_controller(ControllerKind::new("clumsy", "stumbles", |_| {
            Ok(Clumsy { steps: 0 })
        }))
}

/// Controller without outputs that panics at its third step.
pub struct Clumsy {
    pub steps: u64,
}

impl Process for Clumsy {
    fn name(&self) -> &'static str {
        "clumsy"
    }

    fn ports(&self) -> Vec<Port> {
        vec![Port::input("body/rpy", Unit::Radian, 3)]
    }

    fn step(&mut self, _: SimDuration, inputs: &[f64], _: &mut [f64]) {
        self.steps += 1;
        // Index 3 of three inputs at the third step.
        let _ = inputs[usize::try_from(self.steps).unwrap()];
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&self.steps)
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        self.steps = snapshot.read()?;
        Ok(())
    }
}

fn toy_kind(
    name: &str,
    about: &str,
    build: impl Fn(&PlantContext<'_>) -> Result<Toy, BuildError> + Send + Sync + 'static,
) -> PlantKind {
    PlantKind::new(name, about, build).with_ports(|_| Ok(toy_ports()))
}

/// Returns the standard registry with the plants `toy` and `snapping`, which fails at 0.5 s.
pub fn registry() -> Registry {
    let toy = |fails_at, panics_at| {
        move |_: &PlantContext<'_>| {
            Ok(Toy {
                fails_at,
                panics_at,
                ..Toy::sound()
            })
        }
    };
    let half = SimTime::from_nanos(500_000_000);
    Registry::standard()
        .with_plant(toy_kind("toy", "bobs", toy(None, None)))
        .with_plant(toy_kind(
            "snapping",
            "bobs, then snaps",
            toy(Some(half), None),
        ))
}

/// Scenario that passes.
pub const SOUND: &str = r#"
name = "bobbing <& fast>"
robot = "cheetah-cub"
duration = "1 s"
seed = 7
plant = { model = "toy" }

[[expect]]
name = "speed"
body = { speed = { near = "0.5 m/s", within = "1 %" } }

[[expect]]
name = "height"
body = { height = { min = "109 mm" } }
"#;

/// Output and exit code of a command.
#[derive(Debug)]
pub struct Done {
    pub code: u8,
    pub out: String,
    pub err: String,
}

/// Executes a command in this process.
pub fn twin(words: &[&str]) -> Done {
    twin_of(&registry(), words)
}

/// Executes a command with the given registry.
pub fn twin_of(registry: &Registry, words: &[&str]) -> Done {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let code = run_with(registry, words.iter().copied(), &mut out, &mut err);
    Done {
        code,
        out: String::from_utf8(out).unwrap(),
        err: String::from_utf8(err).unwrap(),
    }
}

/// Parses each line of `text` as a JSON object.
pub fn json(text: &str) -> Vec<serde_json::Value> {
    let lines = text.lines();
    lines
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// Returns the result that a study printed as JSON, without what differs from one call of it to
/// the next: the machine and its load at each start.
pub fn study_result(done: &Done) -> serde_json::Value {
    assert_eq!((done.code, done.err.as_str()), (0, ""), "{}", done.out);
    let mut result = json(&done.out).remove(0);
    result.as_object_mut().unwrap().remove("machine");
    let starts = result.get_mut("starts").and_then(|it| it.as_array_mut());
    for start in starts.into_iter().flatten() {
        start.as_object_mut().unwrap().remove("load");
    }
    result
}

/// Splits a command as a POSIX shell does, as far as apostrophes and backslashes go.
pub fn shell_words(command: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quoted = false;
    let mut letters = command.chars();
    while let Some(letter) = letters.next() {
        let literal = match letter {
            '\'' => {
                quoted = !quoted;
                continue;
            }
            ' ' if !quoted => {
                words.push(String::new());
                continue;
            }
            '\\' if !quoted => letters.next().unwrap(),
            letter => letter,
        };
        words.last_mut().unwrap().push(literal);
    }
    words
}

/// Returns a scenario of the massless-leg plant with a fixed trunk; `plant` contains further keys
/// of the plant.
pub fn hanging(plant: &str) -> String {
    format!(
        r#"
robot = "cheetah-cub"
duration = "10 ms"
plant = {{ model = "massless", base = "fixed", {plant} }}
controller = {{ kind = "stand", period = "2 ms" }}
"#
    )
}

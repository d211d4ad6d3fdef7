//! A custom controller, in a program with all commands: `cargo run --release -p squat -- run
//! examples/squat/squat.toml`

use std::f64::consts::TAU;
use std::process::ExitCode;

use twinrig::Registry;
use twinrig::controller::{
    ControllerKind, LegCommand, Pantograph, Planar, Port, Process, ProcessVariable, SimDuration,
    Snapshot, SnapshotError, Unit,
};

/// Bends and stretches the legs, with the feet below the hips.
struct Squat {
    legs: Vec<(String, Pantograph)>,
    variables: [ProcessVariable; 3],
    /// Phase of the cycle, in [0, 1).
    cycle: f64,
}

const FREQUENCY: usize = 0;
const HIGHEST: usize = 1;
const LOWEST: usize = 2;

impl Process for Squat {
    fn name(&self) -> &'static str {
        "squat"
    }

    fn ports(&self) -> Vec<Port> {
        let command =
            |leg: &str, joint| Port::output(format!("leg/{leg}/{joint}/command"), Unit::Radian, 1);
        self.legs
            .iter()
            .flat_map(|(leg, _)| [command(leg, "hip"), command(leg, "knee")])
            .collect()
    }

    fn variables(&self) -> &[ProcessVariable] {
        &self.variables
    }

    fn variables_mut(&mut self) -> &mut [ProcessVariable] {
        &mut self.variables
    }

    fn step(&mut self, elapsed: SimDuration, _inputs: &[f64], outputs: &mut [f64]) {
        let [frequency, highest, lowest] =
            [FREQUENCY, HIGHEST, LOWEST].map(|index| self.variables[index].value());
        self.cycle = (self.cycle + frequency * elapsed.as_secs_f64()).fract();
        let depth = 0.5 - 0.5 * libm::cos(TAU * self.cycle); // 0 stretched, 1 bent
        let foot = Planar::new(0.0, -(highest + depth * (lowest - highest)));
        for ((_, leg), output) in self.legs.iter().zip(outputs.chunks_exact_mut(2)) {
            if let Ok(LegCommand { hip, knee }) = leg.inverse_closed(leg.nearest_reachable(foot)) {
                output.copy_from_slice(&[hip, knee]);
            }
        }
    }

    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.variables, self.cycle))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.variables, self.cycle) = snapshot.read()?;
        Ok(())
    }
}

fn variables() -> [ProcessVariable; 3] {
    [
        ProcessVariable::new("frequency", Unit::Hertz, 0.0..=10.0, 1.0),
        ProcessVariable::new("highest", Unit::Meter, 0.0.., 0.14),
        ProcessVariable::new("lowest", Unit::Meter, 0.0.., 0.11),
    ]
}

fn main() -> ExitCode {
    twinrig::run(Registry::standard().with_controller(squat()))
}

/// Controller kind `squat` of scenarios.
fn squat() -> ControllerKind {
    ControllerKind::new(
        "squat",
        "bends and stretches all legs together",
        |context| {
            let mut legs = Vec::new();
            for mount in context
                .robot
                .legs
                .iter()
                .filter(|mount| context.legs.contains(&mount.name.as_str()))
            {
                legs.push((mount.name.clone(), Pantograph::new(&mount.leg)?));
            }
            Ok(Squat {
                legs,
                variables: variables(),
                cycle: 0.0,
            })
        },
    )
    .with_variables(|_| Ok(variables().to_vec()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_restored_controller_continues_with_the_same_bits() {
        let build = || Squat {
            legs: Vec::new(),
            variables: variables(),
            cycle: 0.0,
        };
        let (mut one, mut other) = (build(), build());
        let step = SimDuration::from_millis(2);
        for _ in 0..123 {
            one.step(step, &[], &mut []);
        }
        other.restore(&one.save()).unwrap();
        one.step(step, &[], &mut []);
        other.step(step, &[], &mut []);
        assert_eq!(one.cycle.to_bits(), other.cycle.to_bits());
    }

    /// Regenerate with `UPDATE_SCHEMA=1 cargo test -p squat schema`.
    #[test]
    fn schema_matches_this_program() {
        let registry = Registry::standard().with_controller(squat());
        let mut schema = Vec::new();
        let code = twinrig::run_with(&registry, ["schema"], &mut schema, &mut Vec::new());
        assert_eq!(code, 0);
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenario.schema.json");
        if std::env::var_os("UPDATE_SCHEMA").is_some() {
            std::fs::write(path, &schema).unwrap();
        }
        assert!(
            std::fs::read(path).unwrap() == schema,
            "run UPDATE_SCHEMA=1 cargo test -p squat schema"
        );
    }
}

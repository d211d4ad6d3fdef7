//! A controller, in a program with all commands of `twin`. It bends and stretches the legs: replace
//! `step` by your own gait, and `variables` by what scenarios may set.

use std::f64::consts::TAU;
use std::process::ExitCode;

use twinrig::Registry;
use twinrig::controller::{
    BuildError, ControllerContext, ControllerKind, LegCommand, Pantograph, Planar, Port, Process,
    ProcessVariable, SimDuration, Snapshot, SnapshotError, Unit,
};

/// Name of the controller in scenarios.
const NAME: &str = "template_name";

/// Bends and stretches the legs, with the feet below the hips.
struct Gait {
    legs: Vec<(String, Pantograph)>,
    variables: [ProcessVariable; 3],
    /// Phase of the cycle, in [0, 1).
    cycle: f64,
}

const FREQUENCY: usize = 0;
const HIGHEST: usize = 1;
const LOWEST: usize = 2;

impl Process for Gait {
    fn name(&self) -> &'static str {
        NAME
    }

    /// The signals that it writes (`Port::output`) and reads (`Port::input`); see `twin plan`.
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

    /// Called once in every period, in SI units; `outputs` are in the order of `ports`.
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

    /// All that changes from step to step, so that a run can be saved and continued bit for bit.
    fn save(&self) -> Snapshot {
        Snapshot::of(&(&self.variables, self.cycle))
    }

    fn restore(&mut self, snapshot: &Snapshot) -> Result<(), SnapshotError> {
        (self.variables, self.cycle) = snapshot.read()?;
        Ok(())
    }
}

/// Keys of the scenario's `[controller]` table: name, unit, range, default.
fn variables() -> [ProcessVariable; 3] {
    [
        ProcessVariable::new("frequency", Unit::Hertz, 0.0..=10.0, 1.0),
        ProcessVariable::new("highest", Unit::Meter, 0.0.., 0.14),
        ProcessVariable::new("lowest", Unit::Meter, 0.0.., 0.11),
    ]
}

fn main() -> ExitCode {
    twinrig::run(registry())
}

/// All parts of `twin`, and this controller.
fn registry() -> Registry {
    let kind = ControllerKind::new(NAME, "bends and stretches all legs together", build);
    twinrig::registry().with_controller(kind.with_variables(|_| Ok(variables().to_vec())))
}

/// Builds the controller for the legs that the scenario selects.
fn build(context: &ControllerContext<'_>) -> Result<Gait, BuildError> {
    let mut legs = Vec::new();
    for mount in &context.robot.legs {
        if context.legs.contains(&mount.name.as_str()) {
            legs.push((mount.name.clone(), Pantograph::new(&mount.leg)?));
        }
    }
    Ok(Gait {
        legs,
        variables: variables(),
        cycle: 0.0,
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use proptest::prelude::*;
    use twinrig::{Assembly, Execution, Report, execute};

    use super::*;

    fn run() -> Report {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("{NAME}.toml"));
        let registry = registry();
        let assembly = Assembly::builder(&registry).file(&path);
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
        execute(&assembly, &Execution::default()).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn scenario_meets_its_expectations_and_repeats() {
        let (first, second) = (run(), run());
        for line in &first.expectations {
            assert!(line.holds(), "{:?}", line.outcome);
        }
        assert_eq!(first.fingerprint, second.fingerprint);
    }

    proptest! {
        /// A law: a controller that is saved and restored goes on as the other one does.
        #[test]
        fn restored_controller_continues(
            frequency in 0.0..10.0_f64, before in 0..500_u32, after in 1..500_u32,
        ) {
            let fresh = || Gait {
                legs: Vec::new(),
                variables: variables(),
                cycle: 0.0,
            };
            let period = SimDuration::from_millis(2);
            let mut one = fresh();
            one.variables[FREQUENCY].set(frequency).unwrap();
            (0..before).for_each(|_| one.step(period, &[], &mut []));
            let mut other = fresh();
            other.restore(&one.save()).unwrap();
            for controller in [&mut one, &mut other] {
                (0..after).for_each(|_| controller.step(period, &[], &mut []));
            }
            prop_assert_eq!(one.save(), other.save());
        }
    }
}

//! Coupling of the plant to the parts that sample and actuate, from scenario options.

use twinrig_kernel::Port;
use twinrig_runtime::{Coupling, FixedStepCoupling, GridInputs, Plant};

use crate::error::BuildError;

/// Returns whether a coupled plant must compute `output` if the outputs for which
/// `requested` holds are requested.
pub(crate) fn needs(coupling: Coupling, output: &Port, requested: &dyn Fn(&str) -> bool) -> bool {
    match coupling {
        Coupling::Exact => requested(&output.name),
        Coupling::Grid { .. } => FixedStepCoupling::needs(output, requested),
    }
}

/// Couples `plant`; the result computes the `requested` outputs.
pub(crate) fn coupled(
    coupling: Coupling,
    plant: Box<dyn Plant>,
    requested: &dyn Fn(&str) -> bool,
) -> Result<Box<dyn Plant>, BuildError> {
    let Coupling::Grid { step, inputs } = coupling else {
        return Ok(plant);
    };
    Ok(Box::new(FixedStepCoupling::new(
        plant, step, inputs, requested,
    )?))
}

/// Describes the coupling for `twin plan`.
pub fn describe(coupling: Coupling) -> String {
    match coupling {
        Coupling::Exact => {
            "exact: the plant advances to every sampling and actuation instant".to_owned()
        }
        Coupling::Grid { step, inputs } => {
            let rule = match inputs {
                GridInputs::Mean => {
                    "the mean of the commands acts over each step, samples are extrapolated"
                }
                GridInputs::Held => {
                    "commands act from the next grid point on, samples are interpolated"
                }
            };
            format!("fixed grid of {} ms: {rule}", step.as_nanos() as f64 / 1e6)
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use twinrig_kernel::{Direction, Layout, SignalKind, SimDuration, SimTime};
    use twinrig_scenario::Setting;

    use crate::assembly::Assembly;
    use crate::registry::Registry;

    /// Between grid points a position is extrapolated along the rate of the same name: it must be
    /// the time derivative of the position, in the same axes and of the same point.
    #[test]
    fn rate_signal_is_derivative_of_position_signal() {
        let registry = Registry::standard();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/oncilla-trot.toml");
        for model in ["massless", "lcp"] {
            let setting = |key: &str, value: &str| Setting {
                origin: "the test".to_owned(),
                key: key.to_owned(),
                value: value.to_owned(),
            };
            let settings = [
                setting("plant.model", model),
                setting("plant.step", "\"0.1 ms\""),
                setting("record.signals", "[\"**\"]"),
            ];
            let assembly = Assembly::builder(&registry)
                .settings(&settings)
                .file(&path)
                .unwrap();
            let mut plant = assembly.parts().unwrap().plant;
            let layout = Layout::of(&plant.ports(), Direction::Output);
            let pairs: Vec<(usize, usize)> = layout
                .fields()
                .filter_map(|field| {
                    let SignalKind::RateOf(of) = &field.port.kind else {
                        return None;
                    };
                    Some((layout.find(of)?, field.range()))
                })
                .flat_map(|(values, rates)| values.zip(rates))
                .collect();
            // Trunk and four feet in space, and two motors per leg.
            assert_eq!(pairs.len(), 3 * 5 + 2 * 4, "{model}");
            let mut inputs = vec![0.0; Layout::of(&plant.ports(), Direction::Input).len()];
            plant.initial_inputs(&mut inputs);
            // With coasting motors the robot sinks onto its feet.
            let mut rows = [0; 3].map(|_| vec![0.0; layout.len()]);
            let (step, mut now) = (SimDuration::from_micros(100), SimTime::ZERO);
            let (mut compared, mut wrong) = (0, 0);
            for n in 0..900 {
                rows.rotate_left(1);
                plant.observe(&mut rows[2]);
                now += step;
                plant.advance(now, &inputs).unwrap();
                for &(value, rate) in pairs.iter().filter(|_| n > 2) {
                    let slope = (rows[2][value] - rows[0][value]) / (2.0 * step.as_secs_f64());
                    let off = (slope - rows[1][rate]).abs();
                    compared += 1;
                    // Error h²/6 times the third derivative, which is large at contacts and stops.
                    wrong += u32::from(off > 2e-3 + 0.02 * slope.abs());
                }
            }
            let moved = pairs.iter().any(|&(value, _)| rows[2][value].abs() > 1e-3);
            assert!(
                moved && wrong < compared / 50,
                "{model}: {wrong} of {compared}"
            );
        }
    }
}

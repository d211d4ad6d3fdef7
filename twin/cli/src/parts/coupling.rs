//! How a plant meets those who sample and actuate, out of a scenario's words.

use twinrig_runtime::Coupling;
use twinrig_runtime::{FixedStepCoupling, GridInputs, Plant};

use crate::error::BuildError;

/// Whether a plant that is coupled so has to tell `name`, where somebody wants what is `wanted`.
pub(crate) fn needs(coupling: Coupling, name: &str, wanted: &dyn Fn(&str) -> bool) -> bool {
    match coupling {
        Coupling::Exact => wanted(name),
        Coupling::Grid { .. } => FixedStepCoupling::needs(name, wanted),
    }
}

/// The plant, coupled so, telling what is `wanted`.
pub(crate) fn coupled(
    coupling: Coupling,
    plant: Box<dyn Plant>,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<Box<dyn Plant>, BuildError> {
    let Coupling::Grid { step, inputs } = coupling else {
        return Ok(plant);
    };
    Ok(Box::new(FixedStepCoupling::new(
        plant, step, inputs, wanted,
    )?))
}

/// The same in words.
pub(crate) fn told(coupling: Coupling) -> String {
    match coupling {
        Coupling::Exact => {
            "exact: the plant is moved to every instant at which somebody samples or actuates"
                .to_owned()
        }
        Coupling::Grid { step, inputs } => {
            let between = match inputs {
                GridInputs::Mean => {
                    "commands act by their mean over a step, samples in it are extrapolated"
                }
                GridInputs::Held => {
                    "commands act from its next instant on, samples before it are interpolated"
                }
            };
            format!(
                "on a grid of {} ms: {between}",
                step.as_nanos() as f64 / 1e6
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
    use twinrig_scenario::Setting;

    use crate::assembly::Assembly;
    use crate::assembly::registry::Registry;

    /// Between two instants of a grid a position goes along the rate of its name: that has to be its derivative, in the same
    /// axes and of the same point.
    #[test]
    fn what_is_called_the_rate_of_a_position_is() {
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
            let assembly = Assembly::of_file(&registry, &path, &settings).unwrap();
            let mut plant = assembly.parts().unwrap().plant;
            let layout = Layout::of(&plant.ports(), Direction::Output);
            let pairs: Vec<(usize, usize)> = layout
                .fields()
                .filter_map(|field| {
                    let stem = field.port.name.strip_suffix("/position")?;
                    let rates = ["rate", "velocity"];
                    let mut rates = rates
                        .iter()
                        .filter_map(|rate| layout.find(&format!("{stem}/{rate}")));
                    Some((field.range(), rates.next()?))
                })
                .flat_map(|(values, rates)| values.zip(rates))
                .collect();
            // Trunk and four feet in space, and two motors a leg.
            assert_eq!(pairs.len(), 3 * 5 + 2 * 4, "{model}");
            let mut inputs = vec![0.0; Layout::of(&plant.ports(), Direction::Input).len()];
            plant.first_inputs(&mut inputs);
            // A robot whose motors coast sinks onto its feet.
            let mut rows = [0; 3].map(|_| vec![0.0; layout.len()]);
            let (step, mut now) = (SimDuration::from_micros(100), SimTime::ZERO);
            let (mut seen, mut wrong) = (0, 0);
            for n in 0..900 {
                rows.rotate_left(1);
                plant.observe(&mut rows[2]);
                now += step;
                plant.advance(now, &inputs).unwrap();
                for &(value, rate) in pairs.iter().filter(|_| n > 2) {
                    let slope = (rows[2][value] - rows[0][value]) / (2.0 * step.as_secs_f64());
                    let off = (slope - rows[1][rate]).abs();
                    seen += 1;
                    // h²/6 of a third derivative, which is what contacts and stops make of it.
                    wrong += u32::from(off > 2e-3 + 0.02 * slope.abs());
                }
            }
            let moved = pairs.iter().any(|&(value, _)| rows[2][value].abs() > 1e-3);
            assert!(moved && wrong < seen / 50, "{model}: {wrong} of {seen}");
        }
    }
}

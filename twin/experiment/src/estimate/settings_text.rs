//! Settings of a filter as they stand in a scenario.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use twinrig_estimate::{ForceResponse, Model, Settings, Sigmoid};

use super::data::LOW_PASS;
use super::tune::TunedFilter;

/// Returns the table `[bus.filter.NAME]` of a filter. `frequency` is the signal of the measured
/// frequency.
pub(crate) fn table(filter: &TunedFilter, frequency: &str) -> String {
    let settings = &filter.settings;
    let mut text = String::new();
    // Writing to a `String` cannot fail.
    let _ = writeln!(text, "[bus.filter.{}]", filter.kind.name());
    let _ = writeln!(text, "model = \"{}\"", model_name(&settings.model));
    let _ = writeln!(text, "low_pass = \"{} Hz\"", LOW_PASS.1);
    if let Some(variance) = settings.frequency {
        let noise = quantity(variance.sqrt() / TAU, "Hz");
        let _ = writeln!(
            text,
            "frequency = {{ signal = \"{frequency}\", noise = {noise} }}"
        );
    }
    text += &piezoresistive(settings);
    text += &piezoelectric(settings);
    text += &process(&settings.model);
    text
}

fn model_name(model: &Model) -> &'static str {
    match model {
        Model::F1 { .. } => "F1",
        Model::F2 { .. } => "F2",
        Model::F3 { .. } => "F3",
        Model::F4 { .. } => "F4",
    }
}

/// Six digits: less than the uncertainty of a fit.
pub(super) fn number(value: f64) -> String {
    if value == 0.0 {
        return "0.0".to_owned();
    }
    if (1e-3..1e5).contains(&value.abs()) {
        return format!("{value:.6}");
    }
    format!("{value:.5e}")
}

pub(super) fn quantity(value: f64, unit: &str) -> String {
    format!("\"{} {unit}\"", number(value))
}

fn piezoresistive(settings: &Settings) -> String {
    let Some(cell) = &settings.piezoresistive else {
        return String::new();
    };
    let mut text = format!(
        "piezoresistive.noise = {}\n",
        quantity(cell.variance.sqrt(), "V")
    );
    match &cell.response {
        ForceResponse::Linear { gain, offset } => {
            let offset = quantity(*offset, "V");
            let gain = quantity(*gain, "V");
            let _ = writeln!(
                text,
                "piezoresistive.linear = {{ offset = {offset}, per_newton = {gain} }}"
            );
        }
        ForceResponse::Hysteresis(hysteresis) => {
            for (name, branch) in [
                ("loading", &hysteresis.loading),
                ("unloading", &hysteresis.unloading),
            ] {
                let _ = writeln!(text, "piezoresistive.{name} = {}", sigmoid(branch));
            }
            let switch = quantity(1.0 / hysteresis.switch, "N/s");
            let _ = writeln!(text, "piezoresistive.switch = {switch}");
        }
    }
    text
}

pub(super) fn sigmoid(branch: &Sigmoid) -> String {
    // a/(1 + e^z) + d = −a/(1 + e^−z) + a + d: of the two forms the one with a positive width.
    let (rise, steepness, base) = if branch.b < 0.0 {
        (branch.a, branch.b, branch.d)
    } else {
        (-branch.a, -branch.b, branch.d + branch.a)
    };
    format!(
        "{{ base = {}, rise = {}, mid = {}, width = {} }}",
        quantity(base, "V"),
        quantity(rise, "V"),
        quantity(-branch.c, "N"),
        quantity(-1.0 / steepness, "N"),
    )
}

fn piezoelectric(settings: &Settings) -> String {
    let mut keys = Vec::new();
    let noise = settings.piezoelectric;
    keys.extend(noise.map(|variance| format!("noise = {}", quantity(variance.sqrt(), "V"))));
    match &settings.model {
        Model::F1 { gain, .. } => keys.push(format!("gain = {}", quantity(*gain, "V·s/N"))),
        Model::F2 {
            rate, acceleration, ..
        } => {
            for (name, decay) in [("rate", rate), ("acceleration", acceleration)] {
                keys.push(format!(
                    "{name} = {{ value = {}, scale = {} }}",
                    number(decay.value),
                    quantity(decay.scale_hz, "Hz")
                ));
            }
        }
        Model::F3 { amplifier, .. } | Model::F4 { amplifier, .. } => {
            keys.push(format!(
                "gain = {}",
                quantity(-amplifier.sensitivity, "V·s/N")
            ));
            for (name, seconds) in [
                ("amplifier_time", amplifier.feedback_s),
                ("silicone_time", amplifier.lag_s),
            ] {
                keys.push(format!("{name} = \"{:.6} ms\"", 1e3 * seconds));
            }
        }
    }
    format!("piezoelectric = {{ {} }}\n", keys.join(", "))
}

fn process(model: &Model) -> String {
    let key = |(name, state): (&&str, &twinrig_estimate::StateSettings)| {
        let deviation = state.noise.sqrt();
        let text = match *name {
            "force" => quantity(deviation, "N"),
            "rate" | "crystal rate" => quantity(deviation, "N/s"),
            "acceleration" | "gain" | "creep" => number(deviation),
            "frequency" => quantity(deviation / TAU, "Hz"),
            _ => quantity(deviation, "V"),
        };
        (state.noise > 0.0).then(|| format!("{} = {text}", name.replace(' ', "_")))
    };
    let keys = model.names().iter().zip(model.states()).filter_map(key);
    format!("process = {{ {} }}\n", keys.collect::<Vec<_>>().join(", "))
}

//! A model of one's own, out of a scenario's words.

use twinrig_scenario::{Accepts, Kind, OptionSpec};

use crate::option::option;
use crate::standard::MJCF;

const NAME: &str = "mjcf";
const FILE: &str = "file";
const KEYFRAME: &str = "keyframe";
const INPUTS: &str = "inputs";
const OUTPUTS: &str = "outputs";
const ACTUATOR: &str = "actuator";
const AS: &str = "as";
const UNIT: &str = "unit";

/// The kind as a build lists it that cannot simulate it.
#[cfg(not(feature = "mujoco"))]
pub(crate) fn offer() -> Kind {
    Kind {
        options: options(),
        stands_alone: true,
        ..Kind::new(NAME, MJCF)
    }
}

fn options() -> Vec<OptionSpec> {
    let name = |key: &str, about: &str| option(key, about, Accepts::Name);
    let unit = name(UNIT, "its unit, where the model does not say (1)");
    let input = vec![
        name(ACTUATOR, "the actuator that it controls"),
        unit.clone(),
    ];
    let things = [
        ("joint", "a joint of the model"),
        (ACTUATOR, "an actuator of the model"),
        ("body", "a body of the model"),
        ("site", "a site of the model"),
        ("geom", "a geom of the model"),
        ("sensor", "a sensor of the model"),
    ];
    let mut output: Vec<_> = things.map(|(key, about)| name(key, about)).into();
    output.push(name(
        AS,
        "what of it: position, rate, load … (the last part of the signal's name)",
    ));
    output.push(unit);
    let each = |keys| Accepts::Table(Box::new(Accepts::Group(keys)));
    vec![
        name(FILE, "the MJCF file, seen from the scenario's folder"),
        name(
            KEYFRAME,
            "the keyframe to start in (the model's reference pose)",
        ),
        option(INPUTS, "what of the model each signal drives", each(input)),
        option(OUTPUTS, "what of the model each signal is", each(output)),
    ]
}

//! A model of one's own, out of a scenario's words.

#[cfg(not(feature = "mujoco"))]
use twinrig_scenario::Kind;
use twinrig_scenario::{Accepts, OptionSpec};

#[cfg(not(feature = "mujoco"))]
use crate::parts::engines::MJCF;
use crate::parts::option::option;

pub(crate) const NAME: &str = "mjcf";
pub(crate) const FILE: &str = "file";
pub(crate) const KEYFRAME: &str = "keyframe";
pub(crate) const INPUTS: &str = "inputs";
pub(crate) const OUTPUTS: &str = "outputs";
pub(crate) const ACTUATOR: &str = "actuator";
pub(crate) const AS: &str = "as";
pub(crate) const UNIT: &str = "unit";

/// The kind as a build lists it that cannot simulate it.
#[cfg(not(feature = "mujoco"))]
pub(crate) fn offer() -> Kind {
    Kind {
        options: options(),
        is_standalone: true,
        ..Kind::new(NAME, MJCF)
    }
}

/// The keys of its table.
pub(crate) fn options() -> Vec<OptionSpec> {
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

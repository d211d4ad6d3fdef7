//! Scenario options of custom MJCF models.

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

/// Returns the kind for builds that cannot simulate it.
#[cfg(not(feature = "mujoco"))]
pub(crate) fn offer() -> Kind {
    Kind {
        options: options(),
        standalone: Some(twinrig_scenario::Standalone::default()),
        ..Kind::new(NAME, MJCF)
    }
}

/// Returns the keys of the plant table.
pub(crate) fn options() -> Vec<OptionSpec> {
    let name = |key: &str, about: &str| option(key, about, Accepts::Name);
    let unit = name(UNIT, "unit, if the model does not define it (1)");
    let input = vec![
        name(ACTUATOR, "actuator that the signal controls"),
        unit.clone(),
    ];
    let elements = [
        ("joint", "joint of the model"),
        (ACTUATOR, "actuator of the model"),
        ("body", "body of the model"),
        ("site", "site of the model"),
        ("geom", "geom of the model"),
        ("sensor", "sensor of the model"),
    ];
    let mut output: Vec<_> = elements.map(|(key, about)| name(key, about)).into();
    output.push(name(
        AS,
        "quantity of the element: position, rate, load … (the last part of the signal's name)",
    ));
    output.push(unit);
    let each = |keys| Accepts::Table(Box::new(Accepts::Group(keys)));
    vec![
        name(FILE, "MJCF file, relative to the scenario's folder"),
        name(
            KEYFRAME,
            "keyframe of the start state (the model's reference pose)",
        ),
        option(
            INPUTS,
            "actuators of the model, by input signal",
            each(input),
        ),
        option(
            OUTPUTS,
            "elements of the model, by output signal",
            each(output),
        ),
    ]
}

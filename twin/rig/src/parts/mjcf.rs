//! Scenario options of custom MJCF models.

use twinrig_scenario::{Accepts, OptionSpec};

use crate::parts::option::option;

/// Name of the plant.
pub const NAME: &str = "mjcf";
/// Key of the model's file.
pub const FILE: &str = "file";
/// Key of the start state.
pub const KEYFRAME: &str = "keyframe";
/// Key of the table of inputs.
pub const INPUTS: &str = "inputs";
/// Key of the table of outputs.
pub const OUTPUTS: &str = "outputs";
/// Key of an input's or output's actuator.
pub const ACTUATOR: &str = "actuator";
/// Key of an output's quantity.
pub const AS: &str = "as";
/// Key of the unit of a signal.
pub const UNIT: &str = "unit";

/// Returns the keys of the plant table.
pub fn options() -> Vec<OptionSpec> {
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

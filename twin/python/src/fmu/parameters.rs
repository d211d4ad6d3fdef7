//! Start values that a scenario gives to variables of an FMU.

use twinrig::fmu_plant::PARAMETERS;
use twinrig::scenario::{OptionValue, Options};
use twinrig_document::{Placed, Problem, suggestion};

use crate::fmu::description::{Description, Variable};

/// Largest magnitude up to which doubles are exact whole numbers: 2⁵³.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Returns the start values that a scenario sets, with the name of their variable.
pub(super) fn parameters(
    description: &Description,
    options: &Options,
    problems: &mut Vec<Problem>,
) -> Vec<(String, Vec<f64>)> {
    let mut parameters = Vec::new();
    for (name, value) in options.named(PARAMETERS) {
        match parameter(description, name, value) {
            Ok(values) => parameters.push((name.value.clone(), values)),
            Err(problem) => problems.push(*problem),
        }
    }
    parameters
}

fn parameter(
    description: &Description,
    name: &Placed<String>,
    value: &OptionValue,
) -> Result<Vec<f64>, Box<Problem>> {
    let wrong = |message: String, help: String| Box::new(Problem::at(&name.place, message, help));
    let found = description.variable(&name.value);
    if let Some(variable) = found.filter(|it| it.is_parameter()) {
        return match start_value(variable, value) {
            Ok(value) => Ok(vec![value; variable.size]),
            Err((message, help)) => Err(wrong(message, help)),
        };
    }
    let mut unmapped = description.unmapped.iter();
    if let Some(unmapped) = unmapped.find(|it| it.name == name.value) {
        let message = format!("`{}` is of type {}", name.value, unmapped.kind);
        let help = match unmapped.kind.as_str() {
            "String" => "strings cannot be set",
            _ => "parameters are numbers, or true or false",
        };
        return Err(wrong(message, help.to_owned()));
    }
    let why = match found {
        Some(_) => "no start value can be given to",
        None => "the FMU has no variable",
    };
    let known = description.variables.iter().filter(|it| it.is_parameter());
    let known = known.map(|variable| variable.name.as_str());
    let message = format!("{why} `{}`", name.value);
    let help = suggestion(&name.value, "parameters of the FMU", known);
    Err(wrong(message, help))
}

/// Returns a start value as a number; else message and help.
fn start_value(variable: &Variable, value: &OptionValue) -> Result<f64, (String, String)> {
    let shown = match value {
        OptionValue::Number(number) => number.to_string(),
        OptionValue::Boolean(flag) => flag.to_string(),
        OptionValue::Text(text) => format!("{text:?}"),
        _ => "a table".to_owned(),
    };
    let (accepted, expected) = match accepted(&variable.kind) {
        Accepted::Boolean => {
            let number = match value {
                OptionValue::Boolean(flag) => Some(f64::from(*flag)),
                OptionValue::Number(number) if [0.0, 1.0].contains(number) => Some(*number),
                _ => None,
            };
            (number, "true or false".to_owned())
        }
        Accepted::Whole(least, most) => {
            let number = number(value).filter(|it| it.fract() == 0.0);
            let number = number.filter(|it| (least..=most).contains(it));
            (number, format!("a whole number from {least} to {most}"))
        }
        Accepted::Number(most) => {
            let number = number(value).filter(|it| it.abs() <= most);
            let expected = match value {
                OptionValue::Text(_) => "a number without a unit, in the unit of the variable",
                _ => "a number in the range of its type",
            };
            (number, expected.to_owned())
        }
    };
    let refused = |expected: String| {
        let message = format!("`{}` of type {} is {shown}", variable.name, variable.kind);
        (message, format!("it must be {expected}"))
    };
    let number = accepted.ok_or_else(|| refused(expected))?;
    let (least, most) = (variable.min, variable.max);
    if least.is_none_or(|least| number >= least) && most.is_none_or(|most| number <= most) {
        return Ok(number);
    }
    let range = match (least, most) {
        (Some(least), Some(most)) => format!("from {least} to {most}"),
        (Some(least), None) => format!("at least {least}"),
        (None, most) => format!("at most {}", most.unwrap_or(f64::MAX)),
    };
    Err(refused(format!("{range}, as the FMU declares it")))
}

fn number(value: &OptionValue) -> Option<f64> {
    match value {
        OptionValue::Number(number) => Some(*number),
        _ => None,
    }
}

/// Values of a type.
enum Accepted {
    Boolean,
    /// Whole numbers from the first to the second.
    Whole(f64, f64),
    /// Numbers up to this magnitude.
    Number(f64),
}

fn accepted(kind: &str) -> Accepted {
    match kind {
        "Boolean" => Accepted::Boolean,
        "Int8" => Accepted::Whole(i8::MIN.into(), i8::MAX.into()),
        "UInt8" => Accepted::Whole(0.0, u8::MAX.into()),
        "Int16" => Accepted::Whole(i16::MIN.into(), i16::MAX.into()),
        "UInt16" => Accepted::Whole(0.0, u16::MAX.into()),
        "Integer" | "Int32" | "Enumeration" => Accepted::Whole(i32::MIN.into(), i32::MAX.into()),
        "UInt32" => Accepted::Whole(0.0, u32::MAX.into()),
        // Values are doubles on their way.
        "Int64" => Accepted::Whole(-EXACT, EXACT),
        "UInt64" => Accepted::Whole(0.0, EXACT),
        "Float32" => Accepted::Number(f32::MAX.into()),
        _ => Accepted::Number(f64::MAX),
    }
}

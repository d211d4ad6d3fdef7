//! Signals of an FMU: variables under the names of signals.

use std::collections::{BTreeMap, BTreeSet};

use twinrig::fmu_plant::{INPUTS, OUTPUTS, UNIT, VARIABLE, VARIABLES};
use twinrig::kernel::signal::{self, Standard};
use twinrig::kernel::{Direction, Port, SignalKind, Unit};
use twinrig::scenario::Options;
use twinrig_document::{Placed, Problem, suggestion};

use crate::fmu::description::{Description, Variable};
use crate::fmu::units::{Scale, unit_of};

/// Usual prefixes of units, with the factor to or from the unit.
const PREFIXES: [(&str, u32); 8] = [
    ("m", 1_000),
    ("k", 1_000),
    ("c", 100),
    ("u", 1_000_000),
    ("µ", 1_000_000),
    ("M", 1_000_000),
    ("n", 1_000_000_000),
    ("d", 10),
];

/// A signal with its variables.
#[derive(Clone, Debug)]
pub(super) struct Signal {
    /// Port of the plant.
    pub port: Port,
    /// Names of the variables, which together have as many elements as the port.
    pub variables: Vec<String>,
    /// Conversion of each element.
    pub scales: Vec<Scale>,
}

/// Returns the signals of an FMU: its inputs and outputs under their own names, unless `options`
/// give them another, and those that `options` add.
pub(super) fn signals(
    description: &Description,
    options: &Options,
    file: &Placed<String>,
    problems: &mut Vec<Problem>,
) -> Vec<Signal> {
    let mut of_tables = Vec::new();
    for (table, direction) in [(INPUTS, Direction::Input), (OUTPUTS, Direction::Output)] {
        for (name, entry) in options.tables(table) {
            match of_table(description, name, entry, direction) {
                Ok(signal) => of_tables.push(signal),
                Err(problem) => problems.push(*problem),
            }
        }
    }
    let renamed = of_tables.iter().flat_map(|signal| &signal.variables);
    let mut taken: BTreeSet<&str> = renamed.map(String::as_str).collect();
    taken.extend(of_tables.iter().map(|signal| signal.port.name.as_str()));
    let mut seen = BTreeSet::new();
    let mut signals = Vec::new();
    for (name, direction, variables) in named(description) {
        let is_taken = variables.iter().any(|it| taken.contains(&*it.name));
        if is_taken || taken.contains(name) || !seen.insert((name, direction)) {
            continue;
        }
        match signal(name, direction, &variables, None) {
            Ok(signal) => signals.push(signal),
            Err(why) => problems.push(Problem::at(&file.place, why.message, why.help)),
        }
    }
    signals.extend(of_tables);
    declare_rates(description, &mut signals);
    signals
}

/// Returns the inputs and outputs whose names are names of signals, in the order of the FMU. A
/// vector is one variable, or a variable for each element: `name[0]`, `name[1]` ….
fn named(description: &Description) -> Vec<(&str, Direction, Vec<&Variable>)> {
    let mut found: Vec<(&str, Direction, Vec<&Variable>)> = Vec::new();
    // Place and first index of each vector.
    let mut vectors: BTreeMap<(&str, Direction), (usize, usize)> = BTreeMap::new();
    for variable in &description.variables {
        let direction = match variable.causality.as_str() {
            "input" => Direction::Input,
            "output" => Direction::Output,
            _ => continue,
        };
        let Some((name, index)) = element(&variable.name) else {
            if is_name(&variable.name) {
                found.push((&variable.name, direction, vec![variable]));
            }
            continue;
        };
        match vectors.get(&(name, direction)) {
            None if is_name(name) && index <= 1 => {
                vectors.insert((name, direction), (found.len(), index));
                found.push((name, direction, vec![variable]));
            }
            Some(&(place, first)) => {
                let (_, _, elements) = &mut found[place];
                let follows = first + elements.len() == index;
                if follows && elements[0].unit_name() == variable.unit_name() {
                    elements.push(variable);
                }
            }
            None => {}
        }
    }
    found
}

impl Variable {
    fn unit_name(&self) -> Option<&str> {
        self.unit.as_ref().map(|unit| unit.name.as_str())
    }
}

/// Splits the name of an element of a vector: `name[2]`.
fn element(name: &str) -> Option<(&str, usize)> {
    let (name, index) = name.strip_suffix(']')?.rsplit_once('[')?;
    Some((name, index.parse().ok()?))
}

fn is_name(name: &str) -> bool {
    let valid = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    let word = |word: &str| !word.is_empty() && word.chars().all(valid);
    name.split('/').all(word)
}

/// Reason against a signal, with the remedy.
struct Objection {
    message: String,
    help: String,
}

fn of_table(
    description: &Description,
    name: &Placed<String>,
    entry: &Options,
    direction: Direction,
) -> Result<Signal, Box<Problem>> {
    let at_name = |message: String, help: &str| Box::new(Problem::at(&name.place, message, help));
    if !is_name(&name.value) {
        let message = format!("`{}` is not the name of a signal", name.value);
        let help = "names consist of letters, digits, `_`, `-` and `.`, separated by slashes";
        return Err(at_name(message, help));
    }
    let one = entry.name(VARIABLE).map(std::slice::from_ref);
    let names = match (one, entry.names(VARIABLES)) {
        (Some(one), []) => one,
        (None, several @ [_, ..]) => several,
        (None, []) => {
            let message = format!("`{}` names no variable", name.value);
            return Err(at_name(message, "add `variable = …` or `variables = […]`"));
        }
        (Some(_), _) => {
            let message = format!("`{}` has both `variable` and `variables`", name.value);
            return Err(at_name(message, "leave one of them out"));
        }
    };
    let found = names.iter().map(|it| find(description, it, direction));
    let variables = found.collect::<Result<Vec<_>, _>>()?;
    let unit = entry.name(UNIT).map(unit).transpose()?;
    signal(&name.value, direction, &variables, unit).map_err(|why| {
        let place = entry.name(UNIT).map_or(&name.place, |unit| &unit.place);
        Box::new(Problem::at(place, why.message, why.help))
    })
}

/// Returns the variable that a signal names.
fn find<'d>(
    description: &'d Description,
    name: &Placed<String>,
    direction: Direction,
) -> Result<&'d Variable, Box<Problem>> {
    let wrong = |message: String, help: String| Box::new(Problem::at(&name.place, message, help));
    let can_be_set = |variable: &&Variable| {
        let is_tunable = variable.variability.as_deref() == Some("tunable");
        variable.causality == "input" || (variable.causality == "parameter" && is_tunable)
    };
    let usable = |variable: &&Variable| direction == Direction::Output || can_be_set(variable);
    let usable_names = || {
        let usable = description.variables.iter().filter(usable);
        usable.map(|variable| variable.name.as_str())
    };
    if let Some(variable) = description.variable(&name.value) {
        if usable(&variable) {
            return Ok(variable);
        }
        let causality = with_article(&variable.causality);
        let message = format!("`{}` is no input of the FMU: it is {causality}", name.value);
        let help = match variable.causality.as_str() {
            "output" => "map it in [plant.outputs]".to_owned(),
            _ => suggestion(&name.value, "inputs of the FMU", usable_names()),
        };
        return Err(wrong(message, help));
    }
    let mut unmapped = description.unmapped.iter();
    if let Some(unmapped) = unmapped.find(|it| it.name == name.value) {
        let message = format!("`{}` is of type {}", name.value, unmapped.kind);
        return Err(wrong(message, "signals are numbers".to_owned()));
    }
    let message = format!("the FMU has no variable `{}`", name.value);
    Err(wrong(
        message,
        suggestion(&name.value, "variables of the FMU", usable_names()),
    ))
}

/// Returns the name of a causality in a sentence.
fn with_article(causality: &str) -> &str {
    match causality {
        "output" => "an output",
        "parameter" => "a parameter that is not tunable",
        "calculatedParameter" => "a calculated parameter",
        "structuralParameter" => "a structural parameter",
        "local" => "a local variable",
        "independent" => "the independent variable",
        other => other,
    }
}

fn unit(symbol: &Placed<String>) -> Result<Unit, Box<Problem>> {
    unit_named(&symbol.value).ok_or_else(|| {
        let message = format!("`{}` is not a unit of a signal", symbol.value);
        let help = prefixed(&symbol.value).unwrap_or_else(|| {
            let symbols = Unit::ALL.iter().map(|unit| unit.symbol());
            suggestion(&symbol.value, "units are SI without prefixes", symbols)
        });
        Box::new(Problem::at(&symbol.place, message, help))
    })
}

fn unit_named(symbol: &str) -> Option<Unit> {
    let mut units = Unit::ALL.iter().copied();
    units.find(|unit| unit.symbol() == symbol)
}

/// Returns the help for a unit with a prefix; the nearest unit would have values of another size.
fn prefixed(symbol: &str) -> Option<String> {
    let mut found = PREFIXES.iter().filter_map(|(prefix, factor)| {
        let unit = unit_named(symbol.strip_prefix(prefix)?)?;
        (unit != Unit::One).then_some((unit, factor))
    });
    let (unit, factor) = found.next()?;
    Some(format!(
        "signals are SI without prefixes: in {unit}, values of this variable would be wrong by a \
         factor of {factor}; declare its unit in the FMU, or scale it there"
    ))
}

/// Returns the signal of these variables, in the unit `wanted` or in their own.
fn signal(
    name: &str,
    direction: Direction,
    variables: &[&Variable],
    wanted: Option<Unit>,
) -> Result<Signal, Objection> {
    let standard = standard(name);
    let size = variables.iter().map(|variable| variable.size).sum();
    let expected = wanted.or(standard.map(|standard| standard.unit));
    let mut scales = Vec::with_capacity(size);
    let mut common: Option<Unit> = None;
    for variable in variables {
        // A standard signal has its unit also where the FMU declares none.
        let declared = variable.unit.as_ref();
        let (unit, scale) = unit_of(declared, expected).map_err(|contradiction| {
            let (declared, variable) = (contradiction.declared, &variable.name);
            let wanted = expected.unwrap_or(Unit::One);
            let help = match standard {
                Some(_) if wanted_by_name(standard, wanted) => {
                    "give the variable another signal in [plant.inputs] or [plant.outputs]"
                }
                _ => "leave `unit` out",
            };
            Objection {
                message: format!(
                    "`{name}` is in {wanted}, and the variable `{variable}` in {declared}"
                ),
                help: help.to_owned(),
            }
        })?;
        if common.is_some_and(|common| common != unit) {
            return Err(Objection {
                message: format!("the variables of `{name}` have different units"),
                help: "give each of them a signal".to_owned(),
            });
        }
        common = Some(unit);
        scales.extend(std::iter::repeat_n(scale, variable.size));
    }
    let unit = common.unwrap_or(Unit::One);
    let port = port(name, unit, size, direction, standard)?;
    let variables = variables.iter().map(|variable| variable.name.clone());
    Ok(Signal {
        port,
        variables: variables.collect(),
        scales,
    })
}

fn wanted_by_name(standard: Option<&Standard>, wanted: Unit) -> bool {
    standard.is_some_and(|standard| standard.unit == wanted)
}

/// Returns the declaration of a standard signal.
fn standard(name: &str) -> Option<&'static Standard> {
    let of_plant = || signal::BODY.iter().chain(&signal::ENERGY);
    match signal::parse_leg(name) {
        Some((_, rest)) => signal::LEG.iter().find(|standard| standard.name == rest),
        None => of_plant().find(|standard| standard.name == name),
    }
}

fn port(
    name: &str,
    unit: Unit,
    size: usize,
    direction: Direction,
    standard: Option<&Standard>,
) -> Result<Port, Objection> {
    if let Some(standard) = standard
        && direction == Direction::Output
    {
        let port = match signal::parse_leg(name) {
            Some((leg, _)) => standard.output_of_leg(leg),
            None => standard.output(),
        };
        if (port.unit, port.size) == (unit, size) {
            return Ok(port);
        }
        return Err(Objection {
            message: format!("the standard signal {port} has {size} elements here, in {unit}"),
            help: "give the variables another signal in [plant.outputs]".to_owned(),
        });
    }
    Ok(match direction {
        Direction::Input => Port::input(name, unit, size),
        Direction::Output => Port::output(name, unit, size),
    })
}

/// Declares outputs to be rates of others, as the FMU does, for their interpolation.
fn declare_rates(description: &Description, signals: &mut [Signal]) {
    let rates = description.variables.iter();
    let rates = rates.filter_map(|it| Some((it.name.as_str(), it.rate_of.as_ref()?)));
    let rates: BTreeMap<&str, &String> = rates.collect();
    let output = |signal: &&Signal| signal.port.direction == Direction::Output;
    let names: BTreeMap<Vec<String>, String> = signals
        .iter()
        .filter(output)
        .map(|signal| (signal.variables.clone(), signal.port.name.clone()))
        .collect();
    for signal in signals.iter_mut() {
        let of = signal.variables.iter();
        let of = of.map(|name| Some((*rates.get(name.as_str())?).clone()));
        let Some(of) = of.collect::<Option<Vec<String>>>() else {
            continue;
        };
        if let (SignalKind::Linear, Some(position)) = (&signal.port.kind, names.get(&of)) {
            signal.port.kind = SignalKind::RateOf(position.clone());
        }
    }
}

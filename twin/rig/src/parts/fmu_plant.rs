//! Scenario options of functional mock-up units, which programs started from the Python package
//! simulate.

use twinrig_document::Range;
use twinrig_kernel::Unit;
use twinrig_scenario::{Accepts, Kind, OptionSpec, OptionValue, Standalone};

use crate::parts::option::option;

/// Name of the kind.
pub const NAME: &str = "fmu";
/// Description of the kind.
pub const ABOUT: &str =
    "any FMU of FMI 2.0 or 3.0 for co-simulation, with its variables as signals";
/// Remedy for a program without this kind.
pub const REMEDY: &str =
    "start the program from the Python package: `pip install \"twinrig[fmu]\"`, then `twin`";

/// Remedy for the program of the Python package without the package that reads FMUs.
pub const REMEDY_IN_PACKAGE: &str = "FMPy is not installed: `pip install fmpy`";

/// Key: path of the FMU.
pub const FILE: &str = "file";
/// Key: whether the FMU has a process of its own.
pub const ISOLATED: &str = "isolated";
/// Key: limit of one call in wall time.
pub const TIME_LIMIT: &str = "time_limit";
/// Key: whether the FMU may end the simulation.
pub const MAY_TERMINATE: &str = "may_terminate";
/// Key: tolerance of the FMU's solver.
pub const TOLERANCE: &str = "relative_tolerance";
/// Key: table of inputs.
pub const INPUTS: &str = "inputs";
/// Key: table of outputs.
pub const OUTPUTS: &str = "outputs";
/// Key: table of parameters.
pub const PARAMETERS: &str = "parameters";
/// Key: variable of a signal.
pub const VARIABLE: &str = "variable";
/// Key: variables of a signal that is a vector.
pub const VARIABLES: &str = "variables";
/// Key: unit of a signal.
pub const UNIT: &str = "unit";

/// Returns the kind for programs that cannot simulate it.
#[must_use]
pub fn offer() -> Kind {
    Kind {
        options: options(),
        standalone: Some(Standalone {
            takes_robot_keys: true,
            ..Standalone::default()
        }),
        ..Kind::new(NAME, ABOUT)
    }
}

/// Returns the keys of the plant table.
pub fn options() -> Vec<OptionSpec> {
    let signal = || {
        Accepts::Table(Box::new(Accepts::Group(vec![
            option(VARIABLE, "variable of the signal", Accepts::Name),
            option(
                VARIABLES,
                "variables of the signal, one for each element",
                Accepts::Names,
            ),
            option(
                UNIT,
                "unit, if the FMU does not declare it (1)",
                Accepts::Name,
            ),
        ])))
    };
    let tolerance = Accepts::Quantity {
        unit: Unit::One,
        range: Range::POSITIVE,
    };
    let isolated = OptionSpec {
        default: Some(OptionValue::Boolean(true)),
        ..option(
            ISOLATED,
            "whether the FMU has a process of its own, so that its crash is a fault of the plant",
            Accepts::Boolean,
        )
    };
    let may_terminate = OptionSpec {
        default: Some(OptionValue::Boolean(false)),
        ..option(
            MAY_TERMINATE,
            "whether an end by the FMU itself ends the run regularly, not as a fault",
            Accepts::Boolean,
        )
    };
    vec![
        option(
            FILE,
            "FMU, relative to the scenario's folder",
            Accepts::Name,
        ),
        isolated,
        may_terminate,
        option(
            TIME_LIMIT,
            "limit of one call in wall time (10 s)",
            Accepts::PositiveDuration,
        ),
        option(
            TOLERANCE,
            "relative tolerance of the FMU's solver (the FMU's)",
            tolerance,
        ),
        option(INPUTS, "variables of the FMU, by input signal", signal()),
        option(OUTPUTS, "variables of the FMU, by output signal", signal()),
        option(
            PARAMETERS,
            "start values of the FMU, by variable, in the unit of the variable",
            Accepts::Table(Box::new(Accepts::Scalar)),
        ),
    ]
}

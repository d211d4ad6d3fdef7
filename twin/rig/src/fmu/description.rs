//! Model descriptions of FMI 2.0 and 3.0.

use std::collections::BTreeSet;

use twinrig_kernel::{SimDuration, Unit};

use crate::fmu::unit_type::{BASE, quantity};
use crate::fmu::variables::{FINGERPRINT, FmuVariable, TIME, TIME_REFERENCE, Variables};
use crate::fmu::xml::{Xml, number};
use crate::fmu::{FmiVersion, MODEL_IDENTIFIER};

/// Categories of log messages; their names are those of the standard.
pub(crate) const LOG_CATEGORIES: [(&str, &str); 3] = [
    ("logStatusDiscard", "values of inputs that are refused"),
    ("logStatusError", "calls that are refused, and failed steps"),
    ("logStatusFatal", "panics, after which the instance is lost"),
];

/// Contents of a model description besides the variables.
pub(crate) struct Description<'a> {
    pub(crate) name: &'a str,
    pub(crate) about: String,
    pub(crate) token: &'a str,
    pub(crate) variables: &'a Variables,
    pub(crate) duration: SimDuration,
    pub(crate) period: SimDuration,
}

/// Attributes of both versions.
const CAPABILITIES: [(&str, &str); 4] = [
    ("modelIdentifier", MODEL_IDENTIFIER),
    ("canHandleVariableCommunicationStepSize", "true"),
    ("canBeInstantiatedOnlyOncePerProcess", "false"),
    ("providesIntermediateUpdate", "false"),
];

impl Description<'_> {
    /// Returns the document.
    pub(crate) fn document(&self, fmi: FmiVersion) -> String {
        let mut xml = Xml::new();
        let tool = concat!("Twinrig ", env!("CARGO_PKG_VERSION"));
        let common = [
            ("modelName", self.name),
            ("description", &self.about),
            ("generationTool", tool),
            ("variableNamingConvention", "flat"),
        ];
        let own: [(&str, &str); 2] = match fmi {
            FmiVersion::Fmi2 => [("fmiVersion", "2.0"), ("guid", self.token)],
            FmiVersion::Fmi3 => [("fmiVersion", "3.0"), ("instantiationToken", self.token)],
        };
        xml.begin("fmiModelDescription", &[&own[..], &common].concat());
        xml.leaf("CoSimulation", &capabilities(fmi));
        self.units(&mut xml, fmi);
        xml.begin("LogCategories", &[]);
        for (name, description) in LOG_CATEGORIES {
            xml.leaf("Category", &[("name", name), ("description", description)]);
        }
        xml.end();
        // Decimals, which a product by 1e-9 would not be.
        let [stop, step] =
            [self.duration, self.period].map(|it| number(it.as_nanos() as f64 / 1e9));
        let experiment = [
            ("startTime", "0.0"),
            ("stopTime", &*stop),
            ("stepSize", &*step),
        ];
        xml.leaf("DefaultExperiment", &experiment);
        xml.begin("ModelVariables", &[]);
        match fmi {
            FmiVersion::Fmi2 => self.scalar_variables(&mut xml),
            FmiVersion::Fmi3 => self.array_variables(&mut xml),
        }
        xml.end();
        self.structure(&mut xml, fmi);
        xml.finish()
    }

    /// Adds the units and a declared type for each of them.
    fn units(&self, xml: &mut Xml, fmi: FmiVersion) {
        let units: BTreeSet<Unit> = self.variables.iter().map(|it| it.unit).collect();
        // Of time, which FMI 3.0 has as a variable.
        let units: BTreeSet<Unit> = units.into_iter().chain([Unit::Second]).collect();
        xml.begin("UnitDefinitions", &[]);
        for unit in &units {
            xml.begin("Unit", &[("name", unit.symbol())]);
            let exponents = BASE.into_iter().zip(unit.base_exponents());
            let exponents = exponents.filter(|(_, exponent)| *exponent != 0);
            let exponents: Vec<(&str, String)> = exponents
                .map(|(base, exponent)| (base, exponent.to_string()))
                .collect();
            leaf(xml, "BaseUnit", &exponents);
            xml.end();
        }
        xml.end();
        xml.begin("TypeDefinitions", &[]);
        for unit in &units {
            let attributes = [("quantity", quantity(*unit)), ("unit", unit.symbol())];
            let name = ("name", quantity(*unit));
            match fmi {
                FmiVersion::Fmi2 => {
                    xml.begin("SimpleType", &[name]);
                    xml.leaf("Real", &attributes);
                    xml.end();
                }
                FmiVersion::Fmi3 => {
                    xml.leaf("Float64Type", &[&[name][..], &attributes].concat());
                }
            }
        }
        xml.end();
    }

    /// Adds a variable an element, for FMI 2.0.
    fn scalar_variables(&self, xml: &mut Xml) {
        for variable in self.variables.iter() {
            let names = variable.element_names().zip(variable.references());
            for (n, (name, reference)) in names.enumerate() {
                let reference = reference.to_string();
                xml.begin("ScalarVariable", &attributes(variable, &name, &reference));
                let start = variable.start.as_ref().map(|start| number(start[n]));
                let mut real = typed(variable);
                real.extend(start.map(|start| ("start", start)));
                leaf(xml, "Real", &real);
                xml.end();
            }
        }
        if let Some(reference) = self.variables.fingerprint() {
            let reference = reference.to_string();
            let mut attributes = fingerprint_attributes(&reference);
            attributes.push(("initial", "calculated"));
            xml.begin("ScalarVariable", &attributes);
            xml.leaf("String", &[]);
            xml.end();
        }
    }

    /// Adds a variable a signal, for FMI 3.0.
    fn array_variables(&self, xml: &mut Xml) {
        let reference = TIME_REFERENCE.to_string();
        let time = [
            ("name", TIME),
            ("valueReference", &*reference),
            ("description", "simulated time"),
            ("causality", "independent"),
            ("variability", "continuous"),
            ("declaredType", quantity(Unit::Second)),
            ("unit", Unit::Second.symbol()),
        ];
        xml.leaf("Float64", &time);
        for variable in self.variables.iter() {
            let reference = variable.reference.to_string();
            let own = attributes(variable, &variable.name, &reference);
            let mut all: Vec<(&str, String)> = own
                .iter()
                .map(|(key, value)| (*key, (*value).to_owned()))
                .collect();
            all.extend(typed(variable));
            let start = variable.start.as_ref();
            let start = start.map(|start| start.iter().map(|value| number(*value)).collect());
            all.extend(start.map(|start: Vec<String>| ("start", start.join(" "))));
            if variable.size == 1 {
                leaf(xml, "Float64", &all);
                continue;
            }
            let all: Vec<(&str, &str)> = all.iter().map(|(key, value)| (*key, &**value)).collect();
            xml.begin("Float64", &all);
            xml.leaf("Dimension", &[("start", &*variable.size.to_string())]);
            xml.end();
        }
        if let Some(reference) = self.variables.fingerprint() {
            let reference = reference.to_string();
            let mut attributes = fingerprint_attributes(&reference);
            attributes.push(("initial", "calculated"));
            xml.leaf("String", &attributes);
        }
    }

    /// Adds the structure. No output depends on an input at the same instant: commands act on the
    /// motion that follows, process variables from the next control step on. The first control
    /// step is at the start.
    fn structure(&self, xml: &mut Xml, fmi: FmiVersion) {
        let mut outputs: Vec<(u32, bool)> = Vec::new();
        for output in self.variables.outputs() {
            let references = output.references();
            // In FMI 2.0 also the positions in the list of scalar variables, from 1.
            let listed = references.take(match fmi {
                FmiVersion::Fmi2 => output.size,
                FmiVersion::Fmi3 => 1,
            });
            outputs.extend(listed.map(|it| (it, output.depends_at_start)));
        }
        outputs.extend(self.variables.fingerprint().map(|it| (it, false)));
        xml.begin("ModelStructure", &[]);
        for (group, name) in [("Outputs", "Output"), ("InitialUnknowns", "InitialUnknown")] {
            let (name, key) = match fmi {
                FmiVersion::Fmi2 if outputs.is_empty() => continue,
                FmiVersion::Fmi2 => ("Unknown", "index"),
                FmiVersion::Fmi3 => (name, "valueReference"),
            };
            if fmi == FmiVersion::Fmi2 {
                xml.begin(group, &[]);
            }
            for (output, depends_at_start) in &outputs {
                let mut attributes = vec![(key, output.to_string())];
                // Without the attribute an unknown depends on all inputs.
                if group == "Outputs" || !depends_at_start {
                    attributes.push(("dependencies", String::new()));
                }
                leaf(xml, name, &attributes);
            }
            if fmi == FmiVersion::Fmi2 {
                xml.end();
            }
        }
        xml.end();
    }
}

fn capabilities(fmi: FmiVersion) -> Vec<(&'static str, &'static str)> {
    let mut all = CAPABILITIES.to_vec();
    match fmi {
        FmiVersion::Fmi2 => {
            all.pop();
            all.extend([
                ("canNotUseMemoryManagementFunctions", "true"),
                ("canGetAndSetFMUstate", "true"),
                ("canSerializeFMUstate", "true"),
            ]);
        }
        FmiVersion::Fmi3 => all.extend([
            ("canGetAndSetFMUState", "true"),
            ("canSerializeFMUState", "true"),
            ("canReturnEarlyAfterIntermediateUpdate", "false"),
            ("hasEventMode", "false"),
        ]),
    }
    all
}

/// Returns the attributes of a variable that both versions have.
fn attributes<'a>(
    variable: &'a FmuVariable,
    name: &'a str,
    reference: &'a str,
) -> Vec<(&'static str, &'a str)> {
    let causality = if variable.is_input() {
        "input"
    } else {
        "output"
    };
    let variability = if variable.is_discrete {
        "discrete"
    } else {
        "continuous"
    };
    let mut all = vec![
        ("name", name),
        ("valueReference", reference),
        ("description", &variable.description),
        ("causality", causality),
        ("variability", variability),
    ];
    if !variable.is_input() {
        all.push(("initial", "calculated"));
    }
    all
}

fn fingerprint_attributes(reference: &str) -> Vec<(&'static str, &str)> {
    vec![
        ("name", FINGERPRINT),
        ("valueReference", reference),
        (
            "description",
            "hash of all samples, bytes and events so far, as `twin run` reports it",
        ),
        ("causality", "output"),
        ("variability", "discrete"),
    ]
}

/// Returns type, unit and bounds of a variable.
fn typed(variable: &FmuVariable) -> Vec<(&'static str, String)> {
    let mut all = vec![
        ("declaredType", quantity(variable.unit).to_owned()),
        ("unit", variable.unit.symbol().to_owned()),
    ];
    let (min, max) = variable.range;
    all.extend(min.map(|min| ("min", number(min))));
    all.extend(max.map(|max| ("max", number(max))));
    all
}

fn leaf(xml: &mut Xml, name: &str, attributes: &[(&str, String)]) {
    let attributes: Vec<(&str, &str)> = attributes
        .iter()
        .map(|(key, value)| (*key, &**value))
        .collect();
    xml.leaf(name, &attributes);
}

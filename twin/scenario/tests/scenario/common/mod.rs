//! Test catalogue with all features of kinds, and a scene.

#![allow(dead_code, reason = "each test file uses its part")]

pub mod run;

use std::path::Path;

use serde_json::{Value, json};
use twinrig_document::{DocumentError, Range};
use twinrig_kernel::{Port, Unit, signal};
use twinrig_scenario::{
    Accepts, Catalogue, Facts, GroundBelow, Kind, LegFact, OptionSpec, OptionValue, Scenario,
    Scene, Standalone, VariableSpec, schema,
};
use twinrig_testing::python;

/// Returns a catalogue with all declarations of kinds, and with keys whose meaning differs between
/// kinds.
pub fn catalogue() -> Catalogue {
    let option = |name: &str, accepts, default| OptionSpec {
        name: name.into(),
        about: format!("the {name}"),
        accepts,
        default,
    };
    let mut massless = Kind::new("massless", "legs without mass");
    massless.takes_pushes = true;
    massless.options = vec![
        option(
            "force",
            Accepts::Choice(vec!["solve".into(), "lookup".into()]),
            Some(OptionValue::Text("solve".into())),
        ),
        option(
            "crouch",
            Accepts::Quantity {
                unit: Unit::Meter,
                range: Range::NOT_NEGATIVE,
            },
            None,
        ),
        option("cells", Accepts::Natural(16..=512), None),
    ];
    let mut mujoco = Kind::new("mujoco", "external physics engine");
    mujoco.remedy = Some("build with `--features mujoco`".into());
    let mut cpg = Kind::new("cpg", "oscillators");
    cpg.options = vec![option(
        "gait",
        Accepts::Choice(["trot", "pace", "walk", "bound"].map(String::from).into()),
        Some(OptionValue::Text("trot".into())),
    )];
    let variable = |name: &str, unit, range, default| VariableSpec {
        name: name.into(),
        unit,
        range,
        default,
        about: format!("the {name}"),
        of_leg: name.ends_with("/LF"),
    };
    let height = Range::between(0.05, 0.148);
    cpg.variables = vec![
        variable("frequency", Unit::Hertz, Range::NOT_NEGATIVE, 3.0),
        variable("step_length", Unit::Meter, Range::NOT_NEGATIVE, 0.08),
        variable("hip_height/fore", Unit::Meter, height, 0.138),
        variable("hip_height/hind", Unit::Meter, height, 0.138),
        variable("phase/LF", Unit::Radian, Range::between(-3.2, 3.2), 0.0),
    ];
    let mut script = Kind::new("script", "shapes");
    script.options = vec![option("gait", Accepts::Boolean, None)];
    let turn = variable("frequency", Unit::RadianPerSecond, Range::ANY, 0.0);
    script.variables = vec![turn];
    let mut sbcp = Kind::new("sbcp", "packets");
    let ppm = Accepts::Quantity {
        unit: Unit::One,
        range: Range::between(-0.1, 0.1),
    };
    sbcp.options = vec![
        option("clock", Accepts::Each(Box::new(ppm)), None),
        option(
            "usb",
            Accepts::Group(vec![
                option("latency_timer", Accepts::Duration, None),
                option("jitter", Accepts::Time, None),
            ]),
            None,
        ),
    ];
    let mut rb110 = Kind::new("rb110", "pulses");
    rb110.options = vec![option("clock", Accepts::Duration, None)];
    Catalogue {
        plants: vec![massless, mujoco, standalone(option)],
        controllers: vec![cpg, script],
        buses: vec![sbcp, rb110],
    }
}

/// Returns a standalone plant.
fn standalone(option: impl Fn(&str, Accepts, Option<OptionValue>) -> OptionSpec) -> Kind {
    let joint = vec![option("joint", Accepts::Name, None)];
    let joints = Accepts::Table(Box::new(Accepts::Group(joint)));
    Kind {
        standalone: Some(Standalone::default()),
        options: vec![
            option("file", Accepts::Name, None),
            option("outputs", joints, None),
        ],
        ..Kind::new("own", "standalone model")
    }
}

/// Returns the minimal scenario with `more` appended.
pub fn text(more: &str) -> String {
    format!(
        "robot = \"cheetah-cub\"\nduration = \"10 s\"\n\n[plant]\nmodel = \"massless\"\nground = {{}}\n\n\
         [controller]\nkind = \"cpg\"\nperiod = \"2 ms\"\n\n{more}"
    )
}

pub fn parse(text: &str) -> Result<Scenario, DocumentError> {
    Scenario::parse("run.toml", text, Path::new("."), &[], &catalogue())
}

/// Returns the legs of a quadruped.
pub fn legs() -> Vec<LegFact> {
    ["LF", "RF", "LH", "RH"]
        .into_iter()
        .map(|name| LegFact {
            name: name.into(),
            fore: name.ends_with('F'),
            left: name.starts_with('L'),
        })
        .collect()
}

pub fn facts(legs: Vec<LegFact>) -> Facts {
    let mut outputs = vec![
        Port::output("body/position", Unit::Meter, 3),
        Port::output("body/rpy", Unit::Radian, 3),
    ];
    let mut process = Vec::new();
    for leg in &legs {
        let name = |what: &str| format!("leg/{}/{what}", leg.name);
        outputs.push(Port::output(name("foot/position"), Unit::Meter, 3));
        outputs.push(Port::output(name("foot/load"), Unit::Newton, 1));
        outputs.push(Port::output(name("cable/tension"), Unit::Newton, 1));
        process.push(Port::output(name("hip/command"), Unit::Radian, 1));
        process.push(Port::output(name("phase"), Unit::Radian, 1));
        for (angle, torque) in signal::DRIVES {
            outputs.push(Port::output(name(angle), Unit::Radian, 1));
            outputs.push(Port::output(name(torque), Unit::NewtonMeter, 1));
        }
    }
    Facts {
        legs,
        weight: 10.8,
        plant_outputs: outputs,
        process_ports: process,
        frame_signals: vec!["body/position".into()],
        ground: GroundBelow::Level,
        ..Facts::default()
    }
}

/// Returns the scene of a scenario.
pub fn scene(text: &str) -> Result<Scene, DocumentError> {
    let scenario = parse(text)?;
    let legs = scenario.legs(&legs())?;
    scenario.scene(&facts(legs))
}

/// Returns the errors of an independent validator in documents and in mutants of the valid ones;
/// none without Python.
pub fn validated(catalogue: &Catalogue, documents: &[String], mutants: usize) -> Option<Value> {
    let python = python::python("jsonschema, tomllib")?;
    let input = json!({ "schema": schema(catalogue), "documents": documents, "mutants": mutants });
    let script = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/validate.py"));
    Some(python::run(&python, script, &[], &input))
}

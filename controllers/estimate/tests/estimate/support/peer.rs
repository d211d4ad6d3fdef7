//! Python scripts as peers.

use std::path::{Path, PathBuf};

use serde_json::Value;
use twinrig_testing::python;

pub fn script(interpreter: &Path, name: &str, input: &Value) -> Value {
    let script = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/reference")
        .join(name);
    python::run(interpreter, &script, &[], input)
}

pub fn interpreter() -> Option<PathBuf> {
    python::python_of_peers("filterpy.kalman, scipy.signal, scipy.optimize")
}

pub fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|it| it.as_f64().unwrap()).collect()
}

pub fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

//! Properties of instances, and of what they are made from.

mod instances;
mod rigs;
mod stepped_plant;

use std::path::{Path, PathBuf};

use twinrig_scenario::Setting;

use super::instance::FmuInstance;
use super::part::FmuPart;
use super::resources::Resources;
use crate::assembly::Assembly;
use crate::registry::Registry;
use crate::run::execute::execute_observed;
use crate::run::execution::Execution;

fn path(scenario: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    root.join("scenarios").join(scenario)
}

/// Calls `body` with a scenario under settings, without its expectations.
fn with_scenario<R>(
    scenario: &str,
    settings: &[(&str, &str)],
    body: impl FnOnce(&Assembly<'_>) -> R,
) -> R {
    let registry = Registry::standard();
    let all = [
        &[("expect", "[]"), ("record.signals", "[\"**\"]")],
        settings,
    ]
    .concat();
    let setting = |(key, value): &(&str, &str)| Setting {
        origin: "test".to_owned(),
        key: (*key).to_owned(),
        value: (*value).to_owned(),
    };
    let settings: Vec<Setting> = all.iter().map(setting).collect();
    let assembly = Assembly::builder(&registry)
        .settings(&settings)
        .file(&path(scenario));
    body(&assembly.unwrap_or_else(|error| panic!("{error}")))
}

fn digest_of(assembly: &Assembly<'_>) -> String {
    let report = execute_observed(assembly, &Execution::default(), &mut ()).unwrap();
    report.fingerprint.unwrap()
}

fn instance_of(assembly: &Assembly<'_>, part: FmuPart) -> FmuInstance {
    FmuInstance::of(Resources::of(assembly, part)).unwrap()
}

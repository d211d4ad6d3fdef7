//! The JSON schema of scenario files, for editors and for programs that write scenarios.
//!
//! It follows from the declarations of the tables, and accepts everything that the reader accepts.
//! It rejects what the reader rejects as far as a schema allows: sums and order of values,
//! properties of a robot or a model, and references between tables are beyond it. Tests compare it
//! with the reader by an independent validator.

mod builders;
mod kinds;
mod share;
mod tables;

use serde_json::{Map, Value, json};

use crate::catalogue::{Catalogue, Kind};
use crate::read::{NO_CONTROLLER, root_table};
use builders::reference;
use kinds::changes;
use tables::Tables;

/// Returns the schema of the scenarios that a build with this catalogue accepts, in JSON Schema
/// draft 2020-12.
///
/// A kind that the build lacks is valid in the schema, and its keys are unrestricted where they are
/// unknown: the scenario is valid, and another build runs it.
pub fn schema(catalogue: &Catalogue) -> Value {
    let defs = Map::new();
    let mut tables = Tables { catalogue, defs };
    let mut schema = tables.table(root_table::TABLE, None);
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["title"] = json!("Twinrig scenario");
    cross_table_rules(&mut schema, catalogue, &mut tables.defs);
    schema["$defs"] = Value::Object(tables.defs);
    share::share(&mut schema);
    schema
}

/// Adds the conditions between tables.
fn cross_table_rules(schema: &mut Value, catalogue: &Catalogue, defs: &mut Map<String, Value>) {
    let plant_of = |is: fn(&Kind) -> bool| {
        let kinds = catalogue.plants.iter().filter(|kind| is(kind));
        let names: Vec<&str> = kinds.map(|kind| kind.name.as_str()).collect();
        let model = json!({ "properties": { "model": { "enum": names } }, "required": ["model"] });
        json!({ "properties": { "plant": model }, "required": ["plant"] })
    };
    schema["if"] = plant_of(|kind| kind.standalone.is_some());
    let without_actuator = plant_of(|kind| !kind.has_robot_keys());
    let none = json!({ "properties": { "actuator": false } });
    schema["then"] = json!({ "if": without_actuator, "then": none });
    schema["else"] = json!({ "required": ["robot"] });
    let none = json!({ "properties": { "change": false } });
    let mut cases = vec![(vec![NO_CONTROLLER.to_owned()], none)];
    for kind in &catalogue.controllers {
        let name = format!("change.{}", kind.name);
        let items = reference(&name);
        defs.insert(name, changes(kind));
        let case = json!({ "properties": { "change": { "items": items } } });
        cases.push((vec![kind.name.clone()], case));
    }
    let without_file = plant_of(|kind| kind.standalone.is_some_and(|it| !it.is_overridable));
    let faults = json!({ "properties": { "fault": { "maxItems": 0 } } });
    schema["dependentSchemas"] = json!({
        "change": of_controller(cases),
        "override": { "if": without_file, "then": { "required": ["robot"] } },
        "fault": { "if": faults, "else": { "required": ["bus"] } },
    });
}

/// Returns the conditions on the kind of the controller; the first case that contains it applies.
fn of_controller(cases: Vec<(Vec<String>, Value)>) -> Value {
    let mut chain = json!({});
    for (names, then) in cases.into_iter().rev() {
        let kind = json!({ "properties": { "kind": { "enum": names } }, "required": ["kind"] });
        let fits = json!({ "properties": { "controller": kind }, "required": ["controller"] });
        chain = json!({ "if": fits, "then": then, "else": chain });
    }
    chain
}

//! The schema of tables, from their declarations.

use serde_json::{Map, Value, json};
use twinrig_document::{Range, percentage_pattern, quantity_name};
use twinrig_kernel::Unit;

use super::builders::{
    any_quantity, boolean, by_value, described, duration, list, natural, object, only_keys,
    open_object, or_table, positive_duration, quantity, reference, table_of, text,
};
use super::kinds::{Common, of_variable, with_kinds};
use crate::catalogue::{Catalogue, Kind};
use crate::language::{Accepts, KeySpec, Part, Presence, Shape, Special, TableSpec};
use crate::options::OptionSpec;
use crate::read::{NO_CONTROLLER, TIME, limits_table, robot_keys};

/// Makes the schemas of tables.
pub(super) struct Tables<'c> {
    pub catalogue: &'c Catalogue,
    /// Definitions to which the schemas refer.
    pub defs: Map<String, Value>,
}

/// Unit of the measure to which a table belongs; none for any unit.
type Measured = Option<Unit>;

impl<'c> Tables<'c> {
    /// Returns the schema of a table.
    pub fn table(&mut self, table: &TableSpec, unit: Measured) -> Value {
        let keys = table.all_keys();
        let part = keys.iter().find_map(|key| match key.shape {
            Shape::Other(Special::Kind(part)) if table.selector == Some(key.name) => Some(part),
            _ => None,
        });
        if let Some(part) = part {
            return self.part(part, &keys);
        }
        let properties = self.properties(&keys, unit);
        let mut schema = match table.selector {
            None => {
                let keys: Vec<_> = keys.iter().collect();
                extended(object(properties, &[]), conditions(&keys))
            }
            Some(selector) => selected(&keys, selector, properties),
        };
        (table.refine)(&mut schema);
        schema
    }

    fn properties(&mut self, keys: &[KeySpec], unit: Measured) -> Value {
        let properties = keys.iter().map(|key| {
            let schema = described(&sentence(key.about), self.shape(&key.shape, unit));
            (key.name.to_owned(), schema)
        });
        Value::Object(properties.collect())
    }

    /// Returns the schema of the table of a part with kinds.
    fn part(&mut self, part: Part, keys: &[KeySpec]) -> Value {
        let (selector, shared): (Vec<_>, Vec<_>) = keys
            .iter()
            .cloned()
            .partition(|key| matches!(key.shape, Shape::Other(Special::Kind(_))));
        let names = |is: fn(&KeySpec) -> bool| -> Vec<&str> {
            shared
                .iter()
                .filter(|key| is(key))
                .map(|key| key.name)
                .collect()
        };
        let common = Common {
            table: part.nouns().0,
            key: selector.first().map_or("", |key| key.name),
            properties: self.properties(&shared, None),
            required: &names(|key| key.presence == Presence::Required),
            not_standalone: &robot_keys(),
        };
        let none = (NO_CONTROLLER, only_keys([common.key]));
        let more = (part == Part::Controller).then_some(none);
        let kinds = self.kinds(part);
        let declared: Vec<_> = kinds.iter().map(declared_keys).collect();
        with_kinds(&common, kinds, &declared, more, &mut self.defs)
    }

    fn kinds(&self, part: Part) -> &'c [Kind] {
        match part {
            Part::Plant => &self.catalogue.plants,
            Part::Controller => &self.catalogue.controllers,
            Part::Bus => &self.catalogue.buses,
        }
    }

    fn shape(&mut self, shape: &Shape, unit: Measured) -> Value {
        let measured = |range: &Range| match unit {
            Some(unit) => quantity(unit, range),
            None => any_quantity(range),
        };
        match shape {
            Shape::Any => json!({}),
            Shape::One(accepts) => accepted(accepts, |_| Value::Null),
            Shape::Measured(range) => measured(range),
            Shape::Tolerance => {
                let plain = measured(&Range::NOT_NEGATIVE);
                if unit.is_none_or(|unit| unit == Unit::One) {
                    return plain;
                }
                let share = json!({ "type": "string", "pattern": percentage_pattern() });
                json!({ "anyOf": [plain, share] })
            }
            Shape::Choice(words) => json!({ "enum": words() }),
            Shape::Pattern(pattern) => {
                let mut schema = text();
                schema["pattern"] = json!(pattern);
                schema
            }
            Shape::False => json!({ "const": false }),
            Shape::List {
                of,
                least,
                distinct,
            } => {
                let mut schema = list(&self.shape(of, unit));
                if *least > 0 {
                    schema["minItems"] = json!(least);
                }
                if *distinct {
                    schema["uniqueItems"] = json!(true);
                }
                schema
            }
            Shape::ByName(of) => table_of(&self.shape(of, unit)),
            Shape::Either(shapes) => self.either(shapes, unit),
            Shape::Table(table) => self.table(table, None),
            Shape::Tables(table) => list(&self.table(table, None)),
            Shape::TableOrTables(table) => self.buses(table),
            Shape::TableIn(unit, table) if table.name == limits_table::TABLE.name => {
                self.limits(*unit)
            }
            Shape::TableIn(unit, table) => self.table(table, *unit),
            Shape::Other(Special::Limits(unit, _)) => self.limits(Some(*unit)),
            Shape::Other(Special::Kind(_)) => text(),
            Shape::Other(Special::Plant) => {
                let plants = self.catalogue.plants.iter().map(|kind| kind.name.as_str());
                json!({ "enum": plants.collect::<Vec<_>>() })
            }
            Shape::Settings => json!({ "type": "object" }),
        }
    }

    fn either(&mut self, shapes: &[Shape], unit: Measured) -> Value {
        let mut schemas: Vec<Value> = shapes.iter().map(|one| self.shape(one, unit)).collect();
        if let [Shape::One(_), Shape::Table(_)] = shapes
            && let (Some(table), Some(plain)) = (schemas.pop(), schemas.pop())
        {
            return or_table(plain, table);
        }
        json!({ "anyOf": schemas })
    }

    /// Returns the schema of one table or a list of them: conditions on tables do not apply to
    /// lists, so one schema covers both.
    fn buses(&mut self, table: &TableSpec) -> Value {
        if self.catalogue.buses.is_empty() {
            return json!(false);
        }
        let mut bus = self.table(table, None);
        bus["type"] = json!(["object", "array"]);
        bus["items"] = json!({ "allOf": [{ "type": "object" }, { "$ref": "#/properties/bus" }] });
        bus
    }

    /// Returns the schema of limits in a unit, which is defined once.
    fn limits(&mut self, unit: Measured) -> Value {
        let name = unit.map_or("quantity", quantity_name);
        let name = name.trim_start_matches("a ").trim_start_matches("an ");
        let name = format!("limits.{}", name.replace(' ', "_"));
        let link = reference(&name);
        if !self.defs.contains_key(&name) {
            let limits = self.table(limits_table::TABLE, unit);
            self.defs.insert(name, limits);
        }
        link
    }
}

/// Returns the schema of the values that an option accepts.
fn accepted<O>(accepts: &Accepts<O>, group: fn(&[O]) -> Value) -> Value {
    match accepts {
        Accepts::Quantity { unit, range } => quantity(*unit, range),
        Accepts::Duration => duration(),
        Accepts::PositiveDuration => positive_duration(),
        Accepts::Natural(range) => natural(range),
        Accepts::Boolean => boolean(),
        Accepts::Scalar => json!({ "type": ["number", "boolean", "string"] }),
        Accepts::Text | Accepts::Name => text(),
        Accepts::Names => json!({ "type": "array", "items": text(), "minItems": 1 }),
        Accepts::Choice(names) => json!({ "enum": names }),
        Accepts::Time => {
            let catalogue = &Catalogue::default();
            let defs = Map::new();
            Tables { catalogue, defs }.shape(&TIME.shape, None)
        }
        Accepts::Group(options) => group(options),
        Accepts::Table(one) => table_of(&accepted(one, group)),
        Accepts::Each(one) => {
            let one = accepted(one, group);
            json!({ "anyOf": [one, table_of(&one)] })
        }
    }
}

/// Returns the schema of a table of options.
fn group(options: &[OptionSpec]) -> Value {
    let keys = options.iter().map(|option| {
        let schema = described(&option.about, accepted(&option.accepts, group));
        (option.name.clone(), schema)
    });
    object(Value::Object(keys.collect()), &[])
}

/// Returns the keys that a kind declares, with the schemas of their values.
fn declared_keys(kind: &Kind) -> Vec<(String, Value)> {
    let mut keys: Vec<(String, Value)> = Vec::new();
    for option in &kind.options {
        let schema = described(&option.about, accepted(&option.accepts, group));
        keys.push((option.name.clone(), schema));
    }
    for variable in &kind.variables {
        if !keys.iter().any(|(key, _)| key == variable.key()) {
            let schema = described(&variable.about, of_variable(kind, variable));
            keys.push((variable.key().to_owned(), schema));
        }
    }
    keys
}

/// Returns a table whose key `selector` defines its further keys.
fn selected(keys: &[KeySpec], selector: &str, properties: Value) -> Value {
    let with_all: Vec<_> = keys.iter().filter(|key| key.only_with.is_empty()).collect();
    let mut schema = extended(open_object(properties, &[]), conditions(&with_all));
    let Some(key) = keys.iter().find(|key| key.name == selector) else {
        return schema;
    };
    let Shape::Choice(words) = key.shape else {
        return schema;
    };
    let mut cases: Vec<(Vec<String>, Value)> = Vec::new();
    for word in words() {
        let has_key = |key: &&KeySpec| key.only_with.is_empty() || key.only_with.contains(&word);
        let only = only_keys(keys.iter().filter(has_key).map(|key| key.name));
        let keys: Vec<_> = keys
            .iter()
            .filter(|key| key.only_with.contains(&word))
            .collect();
        let case = extended(only, conditions(&keys));
        match cases.iter_mut().find(|(_, known)| *known == case) {
            Some((words, _)) => words.push(word.to_owned()),
            None => cases.push((vec![word.to_owned()], case)),
        }
    }
    let default = match key.presence {
        Presence::Default(toml) => Some(toml.trim_matches('\'')),
        _ => None,
    };
    by_value(&mut schema, selector, default, cases.into_iter());
    schema
}

/// Returns the conditions on the presence of keys.
fn conditions(keys: &[&KeySpec]) -> Value {
    let names = |presence| -> Vec<&str> {
        let keys = keys.iter().filter(|key| key.presence == presence);
        keys.map(|key| key.name).collect()
    };
    let mut conditions = json!({});
    let required = names(Presence::Required);
    if !required.is_empty() {
        conditions["required"] = json!(required);
    }
    let one_of = names(Presence::OneOf).into_iter();
    let one_of: Vec<_> = one_of.map(|key| json!({ "required": [key] })).collect();
    if !one_of.is_empty() {
        conditions["oneOf"] = json!(one_of);
    }
    let needs = keys
        .iter()
        .filter_map(|key| Some((key.name.to_owned(), json!([key.needs?]))));
    let needs: Map<String, Value> = needs.collect();
    if !needs.is_empty() {
        conditions["dependentRequired"] = json!(needs);
    }
    conditions
}

fn extended(mut schema: Value, more: Value) -> Value {
    if let (Some(schema), Value::Object(more)) = (schema.as_object_mut(), more) {
        schema.extend(more);
    }
    schema
}

/// Returns a description as a sentence.
fn sentence(about: &str) -> String {
    let mut letters = about.chars();
    let first = letters.next().map(|first| first.to_uppercase().to_string());
    format!("{}{}.", first.unwrap_or_default(), letters.as_str())
}

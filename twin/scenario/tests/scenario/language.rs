//! Reader, schema and documentation of the scenario language agree with its declarations.

use std::path::Path;

use serde_json::{Value, json};
use twinrig_runtime::Change;
use twinrig_scenario::{Catalogue, Kind, Scenario, TableReference, language};
use twinrig_testing::keys::check_keys;

/// Keys and values of a table, in TOML.
type Content = Vec<(String, String)>;

fn catalogue() -> Catalogue {
    let mut catalogue = crate::common::catalogue();
    catalogue.plants.push(Kind {
        takes_pushes: true,
        ..Kind::new("lcp", "legs with mass")
    });
    catalogue
}

/// Returns keys and values of an example, which separates them by commas.
fn content(example: &str) -> Content {
    let (mut depth, mut quoted) = (0_i32, false);
    let separates = |letter: char| {
        match letter {
            '"' => quoted = !quoted,
            '{' | '[' if !quoted => depth += 1,
            '}' | ']' if !quoted => depth -= 1,
            _ => {}
        }
        letter == ',' && depth == 0 && !quoted
    };
    let pairs = example.split(separates).map(|pair| pair.split_once('='));
    let pairs = pairs.map(|pair| pair.unwrap_or_else(|| panic!("{example}")));
    pairs
        .map(|(key, value)| (key.trim().to_owned(), value.trim().to_owned()))
        .collect()
}

fn has(content: &Content, key: &str) -> bool {
    content
        .iter()
        .any(|(known, _)| known.split('.').next() == Some(key))
}

/// Adds the keys of an example that `content` lacks.
fn extend(content: &mut Content, example: &str) {
    for (key, value) in self::content(example) {
        if !has(content, &key) {
            content.push((key, value));
        }
    }
}

/// Adds the keys that the table requires.
fn complete(table: &TableReference, content: &mut Content) {
    let mut keys: Vec<_> = table.keys.iter().collect();
    keys.retain(|key| key.only_with.is_empty());
    for key in keys.iter().filter(|key| key.is_required) {
        if !has(content, key.name) {
            let pairs = self::content(key.example).into_iter();
            content.extend(pairs.filter(|(name, _)| name == key.name));
        }
    }
    keys.retain(|key| key.is_alternative);
    if !keys.iter().any(|key| has(content, key.name)) {
        keys.first()
            .into_iter()
            .for_each(|key| extend(content, key.example));
    }
}

/// Returns a scenario with `content` in `table`, and the required keys of the tables around it.
fn scenario(tables: &[TableReference], table: &TableReference, mut content: Content) -> String {
    let mut path = table.path.clone();
    while let Some(key) = path.pop() {
        let pairs: Vec<_> = content
            .iter()
            .map(|(key, value)| format!("{key} = {value}"))
            .collect();
        let inner = format!("{{ {} }}", pairs.join(", "));
        let outer = tables.iter().find(|table| table.path == path).unwrap();
        let declared = outer
            .keys
            .iter()
            .find(|declared| declared.name == key)
            .unwrap();
        let is_list = self::content(declared.example)
            .iter()
            .any(|(name, value)| name == key && value.starts_with('['));
        let value = if is_list { format!("[{inner}]") } else { inner };
        content = vec![(key.to_owned(), value)];
        if !path.is_empty() {
            complete(outer, &mut content);
        }
    }
    for context in [
        r#"robot = "cheetah-cub""#,
        r#"duration = "20 s""#,
        r#"plant = { model = "lcp", ground = {} }"#,
        r#"controller = { kind = "cpg", period = "2 ms" }"#,
        r#"bus = { kind = "sbcp" }"#,
        r#"change = [{ at = "6 s", set = "frequency", by = "0.1 Hz" }]"#,
    ] {
        // Without `duration` or `plant` in the root table, their absence is the object of a test.
        if !(table.path.is_empty() && context.starts_with(['d', 'p'])) {
            extend(&mut content, context);
        }
    }
    let lines: Vec<_> = content
        .iter()
        .map(|(key, value)| format!("{key} = {value}\n"))
        .collect();
    lines.concat()
}

fn parse(text: &str) -> Result<Scenario, String> {
    let read = Scenario::parse("run.toml", text, Path::new("."), &[], &catalogue());
    read.map_err(|error| error.to_string())
}

/// Returns the errors of an independent validator in each document; none without Python.
fn validated(documents: &[String]) -> Option<Vec<Value>> {
    let found = crate::common::validated(&catalogue(), documents, 0)?;
    found["errors"].as_array().cloned()
}

/// Calls `case` with each table, each of its keys, and the complete content of the key's example.
fn for_each_key(
    mut case: impl FnMut(&[TableReference], &TableReference, &'static str, bool, Content),
) {
    let tables = language();
    for table in &tables {
        for key in &table.keys {
            let mut content = content(key.example);
            assert!(has(&content, key.name), "{}: {}", key.name, key.example);
            complete(table, &mut content);
            case(&tables, table, key.name, key.is_required, content);
        }
    }
}

#[test]
fn reader_and_schema_accept_every_example() {
    let mut documents = Vec::new();
    for_each_key(|tables, table, key, _, content| {
        let text = scenario(tables, table, content);
        let read = parse(&text);
        assert!(
            read.is_ok(),
            "`{key}` of {}\n{text}\n{}",
            table.name,
            read.unwrap_err()
        );
        documents.push(text);
    });
    for (text, errors) in documents
        .iter()
        .zip(validated(&documents).unwrap_or_default())
    {
        assert_eq!(errors, json!([]), "{text}");
    }
}

/// Asserts that the reader refuses all documents, with the given part of a message, and that the
/// schema refuses them too.
fn refused(documents: Vec<(String, String)>) {
    for (text, message) in &documents {
        let error = parse(text).expect_err(text);
        assert!(
            error.contains(message.as_str()),
            "{text}\n{error}\n{message}"
        );
    }
    let texts: Vec<_> = documents.into_iter().map(|(text, _)| text).collect();
    for (text, errors) in texts.iter().zip(validated(&texts).unwrap_or_default()) {
        assert_ne!(errors, json!([]), "the schema accepts\n{text}");
    }
}

#[test]
fn reader_and_schema_refuse_unknown_keys_of_every_table() {
    let tables = language();
    let documents = tables.iter().map(|table| {
        let mut content = vec![("zzzzzzzz".to_owned(), "1".to_owned())];
        complete(table, &mut content);
        let text = scenario(&tables, table, content);
        (text, "unknown key `zzzzzzzz`".to_owned())
    });
    refused(documents.collect());
}

#[test]
fn reader_and_schema_refuse_a_misspelt_key() {
    let mut documents = Vec::new();
    for_each_key(|tables, table, key, _, mut content| {
        for (name, _) in &mut content {
            if name.split('.').next() == Some(key) {
                name.insert(key.len(), 'q');
            }
        }
        // Words of two letters are too short for a suggestion.
        let message = match key.len() {
            0..=2 => String::new(),
            _ => format!("unknown key `{key}q`"),
        };
        documents.push((scenario(tables, table, content), message));
    });
    refused(documents);
}

#[test]
fn reader_and_schema_refuse_a_missing_key() {
    let mut documents = Vec::new();
    for_each_key(|tables, table, key, is_required, mut content| {
        if is_required {
            content.retain(|(name, _)| name != key);
            documents.push((
                scenario(tables, table, content),
                format!("`{key}` is missing"),
            ));
        }
    });
    assert!(documents.len() > 10, "{}", documents.len());
    refused(documents);
}

/// Regenerate with `UPDATE_DOCS=1 cargo test -p twinrig-scenario --test scenario language`.
#[test]
fn documentation_of_tables_is_up_to_date() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/reference.md");
    check_keys(&page, "", &language());
}

/// 0.3 − 3 · 0.1 is −5.6e-17 in floating point; 0 is meant, the least step length.
#[test]
fn repeated_change_meets_a_bound_within_rounding() {
    let changed = |by: &str| {
        let to = "[[change]]\nat = '1 s'\nset = 'step_length'\nto = '0.3 m'\n";
        let by = format!("[[change]]\nat = '2 s'\nset = 'step_length'\nby = '{by}'\n");
        let text = format!("{to}{by}every = '1 s'\ntimes = 3\n");
        crate::common::parse(&crate::common::text(&text))
    };
    let scenario = changed("-0.1 m").unwrap();
    let last = scenario.changes.last().unwrap();
    assert_eq!(last.change, Change::To(0.0));
    let error = changed("-0.10000001 m").unwrap_err().to_string();
    assert!(error.contains("out of its range"), "{error}");
}

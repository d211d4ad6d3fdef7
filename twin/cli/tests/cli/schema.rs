//! `twin schema`: agreement of the scenarios of the repository, the stored schema and the program.

use std::fs;
use std::path::{Path, PathBuf};
use twinrig_testing::python;

use serde_json::{Value, json};
use twinrig::Registry;
use twinrig::robot::RobotFile;
use twinrig_scenario::Scenario;

use crate::common::{Folder, registry, twin, twin_of};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the files below `folder` with the given extension, in order.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path, extension));
        } else if path.extension().is_some_and(|known| known == extension) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Returns the results of an independent validator for documents and mutants of the valid ones;
/// none without Python.
fn validated(schema: &Value, documents: &[String], mutants: usize) -> Option<Value> {
    let python = python::python("jsonschema, tomllib")?;
    let input = json!({ "schema": schema, "documents": documents, "mutants": mutants });
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenario/tests/validate.py");
    Some(python::run(&python, script.as_ref(), &[], &input))
}

fn schema_of(registry: &Registry) -> Value {
    let done = twin_of(registry, &["schema"]);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    serde_json::from_str(&done.out).unwrap()
}

/// Regenerate with `UPDATE_SCHEMA=1 cargo test -p twinrig schema`.
#[test]
fn stored_schema_is_up_to_date() {
    let made = twin_of(&Registry::standard(), &["schema"]).out;
    let path = root().join("scenarios/scenario.schema.json");
    if std::env::var_os("UPDATE_SCHEMA").is_some() {
        fs::write(&path, &made).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap();
    assert!(
        made == kept,
        "run UPDATE_SCHEMA=1 cargo test -p twinrig schema"
    );
    for key in ["massless", "cpg", "hip_height", "phase_difference"] {
        assert!(made.contains(&format!("\"{key}\"")), "{key}");
    }
}

/// Returns the path of the schema that a file references in its first line, relative to its folder.
fn named_schema(file: &Path) -> PathBuf {
    let text = fs::read_to_string(file).unwrap();
    let line = text.lines().next().unwrap();
    let Some(path) = line.strip_prefix("#:schema ") else {
        panic!("{} begins with {line}", file.display());
    };
    assert!(
        path.starts_with("./") || path.starts_with("../"),
        "{path} is not relative to the file"
    );
    file.parent().unwrap().join(path)
}

#[test]
fn scenarios_of_repository_satisfy_their_schemas() {
    let mut all = files(&root().join("scenarios"), "toml");
    // Specifications of sweeps and search spaces are not scenarios.
    all.retain(|file| !fs::read_to_string(file).unwrap().contains("[[dimension]]"));
    assert!(all.len() >= 22, "{all:?}");
    let stored = fs::canonicalize(root().join("scenarios/scenario.schema.json")).unwrap();
    for file in &all {
        let named = named_schema(file);
        let named = fs::canonicalize(&named).unwrap_or_else(|error| panic!("{named:?}: {error}"));
        assert_eq!(named, stored, "{}", file.display());
    }
    let schema = serde_json::from_str(&fs::read_to_string(stored).unwrap()).unwrap();
    let texts = all.iter().map(|file| fs::read_to_string(file).unwrap());
    let Some(found) = validated(&schema, &texts.collect::<Vec<_>>(), 0) else {
        return;
    };
    for (file, errors) in all.iter().zip(found["errors"].as_array().unwrap()) {
        assert_eq!(errors, &json!([]), "{}", file.display());
    }
}

/// Returns the texts in raw strings of tests and in code blocks of the documentation that look like
/// scenarios; includes format strings.
fn scenarios_of_tests_and_documents() -> Vec<String> {
    let mut texts = Vec::new();
    let mut between = |text: &str, open: &str, close: &str| {
        let parts = text.split(open).skip(1);
        let inside = parts.filter_map(|part| Some(part.split_once(close)?.0));
        let scenarios = inside.filter(|text| text.contains("duration = "));
        texts.extend(scenarios.map(str::to_owned));
    };
    for folder in ["twin", "tests", "drivers", "plants"] {
        for file in files(&root().join(folder), "rs") {
            between(&fs::read_to_string(file).unwrap(), "r#\"", "\"#");
        }
    }
    for page in [
        "README.md",
        "scenarios/README.md",
        "scenarios/reference.md",
        "drivers/README.md",
    ] {
        let page = fs::read_to_string(root().join(page)).unwrap();
        between(&page, "```toml\n", "```");
    }
    texts
}

/// Returns the texts that the program accepts as scenarios, without building their parts.
fn accepted<'t>(registry: &Registry, texts: impl Iterator<Item = &'t str>) -> Vec<&'t str> {
    let robot = RobotFile::find("oncilla", Path::new("")).unwrap();
    let catalogue = registry.catalogue(Some(&robot.robot().unwrap()));
    let folder = Path::new("");
    let read = |text: &&str| Scenario::parse("t.toml", text, folder, &[], &catalogue).is_ok();
    texts.filter(read).collect()
}

#[test]
fn schema_accepts_valid_scenarios_of_tests_and_documents() {
    let registry = registry();
    let texts = scenarios_of_tests_and_documents();
    let sound = accepted(&registry, texts.iter().map(String::as_str));
    let sound: Vec<String> = sound.into_iter().map(str::to_owned).collect();
    assert!(sound.len() >= 8, "{}", sound.len());
    let Some(found) = validated(&schema_of(&registry), &sound, 0) else {
        return;
    };
    for (text, errors) in sound.iter().zip(found["errors"].as_array().unwrap()) {
        assert_eq!(errors, &json!([]), "{text}");
    }
}

#[test]
fn schema_accepts_mutants_that_program_accepts() {
    let registry = Registry::standard();
    let shipped = files(&root().join("scenarios"), "toml").into_iter();
    let shipped = shipped.map(|file| fs::read_to_string(file).unwrap());
    let shipped: Vec<String> = shipped.collect();
    let Some(found) = validated(&schema_of(&registry), &shipped, 500) else {
        return;
    };
    let mutants = found["mutants"].as_array().unwrap();
    let texts = mutants
        .iter()
        .map(|mutant| mutant["text"].as_str().unwrap());
    let sound = accepted(&registry, texts);
    for mutant in mutants
        .iter()
        .filter(|mutant| sound.contains(&mutant["text"].as_str().unwrap()))
    {
        assert_eq!(mutant["errors"], json!([]), "{}", mutant["text"]);
    }
    assert!(sound.len() > 50, "{} of 500 mutants are valid", sound.len());
}

#[test]
fn custom_part_is_in_schema_of_its_build() {
    let custom = schema_of(&registry());
    let standard = schema_of(&Registry::standard());
    let models = |schema: &Value| {
        let models = schema["properties"]["plant"]["properties"]["model"]["enum"].clone();
        models.as_array().unwrap().contains(&json!("toy"))
    };
    assert!(models(&custom) && !models(&standard));
}

#[test]
fn schema_contains_variables_of_given_robots() {
    let done = twin(&["schema", "--robot", "oncila"]);
    assert_eq!((done.code, done.out.as_str()), (2, ""));
    assert!(done.err.contains("did you mean `oncilla`"), "{}", done.err);
    // Process variables of legs have the names of the legs.
    let folder = Folder::new("schema");
    let robot = include_str!("../../../../robots/cheetah-cub.toml");
    let robot = folder.file("wolf.toml", &robot.replace("\"LF\"", "\"front\""));
    let done = twin(&["schema", "--robot", &robot]);
    assert_eq!(done.code, 0, "{}", done.err);
    let schema: Value = serde_json::from_str(&done.out).unwrap();
    let phases = "/properties/controller/properties/phase_difference/properties/front";
    assert!(schema.pointer(phases).is_some(), "{}", done.out);
}

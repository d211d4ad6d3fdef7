//! The schema has the keys of the reader. The schema of a complete build is in `scenarios/`.

use serde_json::{Value, json};
use twinrig_scenario::schema;

/// An unknown key in each table of a scenario, and the pointer to that table in the schema.
const TABLES: [(&str, &str); 23] = [
    ("zzzzzzzz = 1\nrobot = 1", ""),
    ("[actuator]\nzzzzzzzz = 1", "/properties/actuator"),
    (
        "[actuator.hip]\nzzzzzzzz = 1",
        "/properties/actuator/properties/hip",
    ),
    (
        "[plant.start]\nzzzzzzzz = 1",
        "/properties/plant/properties/start",
    ),
    (
        "[plant.coupling]\nzzzzzzzz = 1",
        "/properties/plant/properties/coupling/anyOf/1",
    ),
    ("[io]\nzzzzzzzz = 1", "/properties/io"),
    (
        "[io]\ntransfer_time = { zzzzzzzz = 1 }",
        "/properties/io/properties/transfer_time",
    ),
    ("[observe]\nzzzzzzzz = 1", "/properties/observe"),
    ("[fall]\nzzzzzzzz = 1", "/properties/fall"),
    ("[footsteps]\nzzzzzzzz = 1", "/properties/footsteps"),
    ("[record]\nzzzzzzzz = 1", "/properties/record"),
    (
        "[[change]]\nat = '1 s'\nset = 'frequency'\nto = '3 Hz'\nzzzzzzzz = 1",
        "/properties/change/items",
    ),
    ("[bus]\nkind = 'sbcp'\nzzzzzzzz = 1", "/properties/bus"),
    (
        "[[expect]]\nbody = { fall = false }\nzzzzzzzz = 1",
        "/properties/expect/items",
    ),
    (
        "[[expect]]\nbody = { speed = { max = '1 m/s' }, zzzzzzzz = 1 }",
        "/properties/expect/items/properties/body",
    ),
    (
        "[[expect]]\nbody = { fall = { zzzzzzzz = 1 } }",
        "/properties/expect/items/properties/body/properties/fall/anyOf/1",
    ),
    (
        "[[expect]]\nbody = { settles = { zzzzzzzz = 1 } }",
        "/properties/expect/items/properties/body/properties/settles",
    ),
    (
        "[[expect]]\ntiming = { of = 'control', jitter = { max = '1 s' }, zzzzzzzz = 1 }",
        "/properties/expect/items/properties/timing",
    ),
    (
        "[[expect]]\nsignal = { name = 'x', always = { max = 1 }, zzzzzzzz = 1 }",
        "/properties/expect/items/properties/signal",
    ),
    (
        "[[expect]]\nsignal = { name = 'x', always = { max = 1 }, until = { zzzzzzzz = 1 } }",
        "/properties/expect/items/properties/signal/properties/until",
    ),
    (
        "[[expect]]\nsignal = { name = 'x', always = { zzzzzzzz = 1 } }",
        "/properties/expect/items/properties/signal/properties/always",
    ),
    (
        "[[expect]]\nenergy = { zzzzzzzz = 1 }",
        "/properties/expect/items/properties/energy",
    ),
    (
        "[[expect]]\ncost = { steps = { max = 1 }, zzzzzzzz = 1 }",
        "/properties/expect/items/properties/cost",
    ),
];

/// Returns the keys that the reader lists for the unknown key in `more`.
fn keys_of_reader(more: &str) -> Vec<String> {
    keys_of_reader_in(&crate::common::text(more))
}

fn keys_of_reader_in(text: &str) -> Vec<String> {
    let error = crate::common::parse(text).unwrap_err().to_string();
    let unknown = error
        .split("\n\n")
        .find(|problem| problem.contains("unknown key `zzzzzzzz`"))
        .unwrap_or_else(|| panic!("{error}"));
    let (_, keys) = unknown
        .split_once("keys that are known here: ")
        .unwrap_or_else(|| panic!("{unknown}"));
    let mut keys: Vec<String> = keys.split(", ").map(str::to_owned).collect();
    keys.sort();
    keys
}

fn keys_of_schema(schema: &Value, pointer: &str) -> Vec<String> {
    let at = |pointer: &str| {
        let table = schema.pointer(pointer);
        table.unwrap_or_else(|| panic!("{pointer}"))
    };
    let mut table = at(pointer);
    // A shared table is referred to, beside a description in `anyOf`.
    while let Some(name) = table["$ref"]
        .as_str()
        .or(table["anyOf"][0]["$ref"].as_str())
    {
        table = at(name.trim_start_matches('#'));
    }
    let mut keys: Vec<String> = table["properties"]
        .as_object()
        .unwrap()
        .keys()
        .cloned()
        .collect();
    keys.sort();
    keys
}

/// Returns the keys of a table whose key `kind` is `word`.
fn keys_of_case(schema: &Value, pointer: &str, kind: &str, word: &str) -> Vec<String> {
    let mut case = schema.pointer(pointer).unwrap();
    let words = format!("/if/properties/{kind}/enum");
    let fits = |case: &Value| {
        case.pointer(&words)
            .unwrap()
            .as_array()
            .unwrap()
            .contains(&json!(word))
    };
    while !fits(case) {
        case = &case["else"];
    }
    let keys = case["then"]["propertyNames"]["enum"].as_array().unwrap();
    let mut keys: Vec<String> = keys
        .iter()
        .map(|key| key.as_str().unwrap().to_owned())
        .collect();
    keys.sort();
    keys
}

#[test]
fn schema_and_reader_have_the_same_keys() {
    let schema = schema(&crate::common::catalogue());
    for (more, pointer) in TABLES {
        let text_keys = if pointer.is_empty() {
            keys_of_root()
        } else {
            keys_of_reader(more)
        };
        assert_eq!(text_keys, keys_of_schema(&schema, pointer), "{pointer}");
    }
    // The union of keys that depend on another key is that of the schema.
    let fault = |what: &str| {
        keys_of_reader(&format!(
            "[bus]\nkind = 'sbcp'\n[[fault]]\nat = '1 s'\non = 'wire/sbcp'\n{what}\nzzzzzzzz = 1"
        ))
    };
    let mut keys = [
        fault("kind = 'drop'"),
        fault("kind = 'flip'\nrate = 0.1"),
        fault("kind = 'delay'\nby = '1 ms'"),
        fault("kind = 'unplug'"),
        fault("kind = 'babble'"),
        fault("kind = 'brown-out'"),
        fault("kind = 'drift'\nclock = '1 ppm'"),
    ]
    .concat();
    keys.sort();
    keys.dedup();
    assert_eq!(keys, keys_of_schema(&schema, "/properties/fault/items"));
    let footstep = |measure: &str| {
        keys_of_reader(&format!(
            "[[expect]]\nfootstep = {{ {measure}, zzzzzzzz = 1 }}"
        ))
    };
    let mut keys = [
        footstep("position = { max = '1 m' }"),
        footstep("phase = 'trot', tolerance = 0.1"),
        footstep("displacement = { max = '1 m' }, against = 'without changes'"),
    ]
    .concat();
    keys.sort();
    keys.dedup();
    assert_eq!(
        keys,
        keys_of_schema(&schema, "/properties/expect/items/properties/footstep")
    );
}

#[test]
fn schema_and_reader_have_the_same_keys_of_each_kind() {
    let schema = schema(&crate::common::catalogue());
    let unknown =
        |text: &str| keys_of_reader_in(&format!("duration = '1 s'\n{text}\nzzzzzzzz = 1"));
    for model in ["massless", "own"] {
        let reader = unknown(&format!("[plant]\nmodel = '{model}'"));
        assert_eq!(
            reader,
            keys_of_case(&schema, "/properties/plant", "model", model)
        );
    }
    for kind in ["cpg", "script", "none"] {
        let reader = unknown(&format!("[controller]\nkind = '{kind}'\nperiod = '1 ms'"));
        assert_eq!(
            reader,
            keys_of_case(&schema, "/properties/controller", "kind", kind)
        );
    }
    for kind in ["sbcp", "rb110"] {
        let reader = unknown(&format!("[bus]\nkind = '{kind}'"));
        assert_eq!(
            reader,
            keys_of_case(&schema, "/properties/bus", "kind", kind)
        );
    }
    for (profile, keys) in [
        ("flat", ""),
        ("step-down", "at = '1 m'\nheight = '1 m'"),
        ("heights", "spacing = '1 m'\namplitude = '1 m'"),
    ] {
        let reader = unknown(&format!(
            "[plant]\nmodel = 'massless'\n[plant.ground]\nprofile = '{profile}'\n{keys}"
        ));
        let pointer = "/properties/plant/properties/ground";
        assert_eq!(reader, keys_of_case(&schema, pointer, "profile", profile));
    }
    for (kind, keys) in [
        ("drop", ""),
        ("flip", "rate = 0"),
        ("delay", "by = '1 s'"),
        ("stuck", ""),
    ] {
        let reader = unknown(&format!(
            "[[fault]]\nat = '0 s'\non = 'wire/x'\nkind = '{kind}'\n{keys}"
        ));
        assert_eq!(
            reader,
            keys_of_case(&schema, "/properties/fault/items", "kind", kind)
        );
    }
}

fn keys_of_root() -> Vec<String> {
    let text = format!("zzzzzzzz = 1\n{}", crate::common::text(""));
    let error = crate::common::parse(&text).unwrap_err().to_string();
    let (_, keys) = error.split_once("keys that are known here: ").unwrap();
    let mut keys: Vec<String> = keys.split(", ").map(str::to_owned).collect();
    keys.sort();
    keys
}

//! Printed commands of reproduction, executed: they give the result that prints them.

use serde_json::Value;
use twinrig::Registry;

use crate::common::{Folder, registry, shell_words, study_result, twin_of};
use crate::studies::{STILL, spring};

/// A name that a shell would take apart.
const NAME: [&str; 2] = ["--set", r#"name="it's \"a b\"""#];
/// Folder of the scenarios.
const FOLDER: &str = "my scenarios";

/// Runs a study of a scenario in a folder with a blank, then its printed command; returns both
/// results.
fn twice(registry: &Registry, kind: &str, text: &str, more: &[&str]) -> [Value; 2] {
    let folder = Folder::new(&format!("reproduction-{kind}"));
    std::fs::create_dir(folder.join(FOLDER)).unwrap();
    let file = folder.file(&format!("{FOLDER}/it's a scene.toml"), text);
    let out = folder.join("out");
    let result = |words: &[&str]| study_result(&twin_of(registry, words));
    let words = ["study", kind, &file, "--json", "--out", &out];
    let first = result(&[&words, &NAME[..], more].concat());
    let command = shell_words(first["command"].as_str().unwrap());
    assert_eq!(command[0], "twin");
    let repeated: Vec<&str> = command[1..].iter().map(String::as_str).collect();
    let again = format!("--out={}", folder.join("again"));
    let second = result(&[&repeated[..], &["--json", &again]].concat());
    assert_eq!(first["command"], second["command"], "of a repetition");
    [first, second]
}

fn scenario(name: &str) -> String {
    let path = format!("{}/../../scenarios/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

#[test]
fn command_of_a_study_has_its_result() {
    let short = "duration=3 s";
    let upright = "expect=[{body={fall=false}}]";
    let change = r#"change=[{at="1 s",set="step_length",by="-1 cm"}]"#;
    let set = ["--set", short, "--set", upright];
    let steps = [
        "--after=1 s",
        "--points",
        "1",
        "--steps",
        "1",
        "--by=-10 mm",
    ];
    let studies: [(&str, &str, Vec<&str>); 4] = [
        (
            "modulation",
            "step-change.toml",
            [&set[..], &steps].concat(),
        ),
        (
            "loads",
            "tegotae-trot.toml",
            [&set[..], &steps, &["--phases", "1 s"]].concat(),
        ),
        (
            "transition",
            "trot.toml",
            [&set[..], &["--set", change, "--plant=lcp"]].concat(),
        ),
        (
            "robustness",
            "trot.toml",
            [&set[..], &["--ensemble", "2", "--tolerance", "1 mm"]].concat(),
        ),
    ];
    for (kind, file, more) in studies {
        let [first, second] = twice(&registry(), kind, &scenario(file), &more);
        assert_eq!(first, second, "{kind}");
    }
}

/// Their seconds differ: the command runs and has as many rows.
#[test]
fn command_of_a_timed_study_has_its_rows() {
    let springs = registry().with_plant(spring("spring"));
    let studies: [(&str, &[&str]); 2] = [
        (
            "precision",
            &["--plant", "spring", "--duration", "50 ms", "--ensemble=0"],
        ),
        (
            "stability",
            &["--plant=spring", "--factor", "stiffness=0.5,2"],
        ),
    ];
    for (kind, more) in studies {
        let [first, second] = twice(&springs, kind, STILL, more);
        let rows = |result: &Value| result["rows"].as_array().unwrap().len();
        assert!(rows(&first) > 1, "{kind}");
        assert_eq!(rows(&first), rows(&second), "{kind}");
    }
}

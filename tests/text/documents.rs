//! Consistency of README.md, and of pages of `docs`, with the program.

use std::path::{Path, PathBuf};
use std::process::Command;

use twinrig::campaign::identification::FitSpace;
use twinrig::campaign::optimization::SearchSpace;
use twinrig::campaign::sweep::SweepSpec;
use twinrig::{Assembly, BuildKey, Execution, Registry, Status, execute};
use twinrig_bench::BenchFile;
use twinrig_record::LogMapping;
use twinrig_robot::RobotFile;
use twinrig_servo::ServoBenchFile;
use twinrig_testing::keys::check_keys;

fn readme() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    std::fs::read_to_string(path).unwrap()
}

/// Returns the text between the first ```` ```LANGUAGE ```` and the next ```` ``` ````.
fn first_block<'t>(text: &'t str, language: &str) -> &'t str {
    let (_, rest) = text.split_once(&format!("```{language}\n")).unwrap();
    rest.split_once("```").unwrap().0
}

#[test]
fn readme_scenario_passes() {
    let registry = Registry::standard();
    let robot = include_str!("../../robots/cheetah-cub.toml");
    let readme = readme();
    let scenario = first_block(&readme, "toml");
    let assembly = Assembly::builder(&registry)
        .robot(robot)
        .recorded(scenario)
        .unwrap_or_else(|error| panic!("{error}"));
    let report = execute(&assembly, &Execution::default()).unwrap();
    assert_eq!(report.verdict, Status::Pass, "{:?}", report.expectations);
}

/// Blocks of the guide that are whole scenarios.
#[test]
fn scenarios_of_the_guide_pass() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/README.md");
    let guide = std::fs::read_to_string(path).unwrap();
    let registry = Registry::standard();
    let blocks = guide.split("```toml\n").skip(1);
    let blocks = blocks.filter_map(|rest| Some(rest.split_once("```")?.0));
    let mut count = 0;
    for scenario in blocks.filter(|block| block.contains("duration = ")) {
        let assembly = Assembly::builder(&registry)
            .text("guide.toml", scenario, Path::new(""))
            .unwrap_or_else(|error| panic!("{error}"));
        let report = execute(&assembly, &Execution::default()).unwrap();
        assert_eq!(report.verdict, Status::Pass, "{scenario}");
        count += 1;
    }
    assert_eq!(count, 2);
}

#[test]
fn verdict_of_the_page_lists_the_expectations_of_the_scenario() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/trot.toml");
    let registry = Registry::standard();
    let assembly = Assembly::builder(&registry).file(&path).unwrap();
    let page = page("program");
    let shown: Vec<&str> = first_block(&page, "console")
        .lines()
        .filter_map(|line| line.trim_start().strip_prefix(['✓', '✗']))
        .filter_map(|line| line.trim_start().split("  ").next())
        .collect();
    let expectations = assembly.scenario().expectations.iter();
    let expected: Vec<&str> = expectations
        .map(|expectation| expectation.name.as_str())
        .collect();
    assert_eq!(shown, expected);
}

#[test]
fn table_of_commands_lists_all_commands() {
    let mut help = Vec::new();
    let code = twinrig::run_with(
        &Registry::standard(),
        ["--help"],
        &mut help,
        &mut Vec::new(),
    );
    assert_eq!(code, 0);
    let help = String::from_utf8(help).unwrap();
    let (_, commands) = help.split_once("Commands:\n").unwrap();
    let (commands, _) = commands.split_once("\n\n").unwrap();
    let expected: Vec<&str> = commands
        .lines()
        // Further lines of a description are indented more.
        .filter_map(|line| line.strip_prefix("  ")?.split(' ').next())
        .filter(|name| !name.is_empty())
        .collect();
    let commands = page("program");
    let table: Vec<&str> = commands
        .lines()
        .filter_map(|line| line.strip_prefix("| `twin "))
        .filter_map(|row| row.split([' ', '`']).next())
        .collect();
    assert_eq!(table, expected);
}

/// Draws the picture anew, by the commands that its script names.
#[test]
fn picture_of_the_trot_is_that_of_its_recording() {
    let Some(python) = twinrig_testing::python::python("struct") else {
        return;
    };
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = std::env::temp_dir().join(format!("twinrig-picture-{}", std::process::id()));
    let script = root.join("docs/pictures/trot.py");
    let settings = [
        "--until",
        "6 s",
        "--set",
        "expect=[]",
        "--set",
        "record.frames=\"500 Hz\"",
    ];
    let scenario = root.join("scenarios/trot.toml");
    let [scenario, out] = [&scenario, &folder].map(|path| path.to_str().unwrap());
    let words = [&["run", scenario, "--out", out][..], &settings].concat();
    let (mut printed, mut err) = (Vec::new(), Vec::new());
    let code = twinrig::run_with(&Registry::standard(), words, &mut printed, &mut err);
    assert_eq!(code, 0, "{}", String::from_utf8_lossy(&err));
    let recording = std::fs::read_dir(&folder).unwrap().next().unwrap();
    let picture = folder.join("trot.svg");
    let drawing = Command::new(python)
        .args([&script, &recording.unwrap().path(), &picture])
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&drawing.stderr);
    assert!(drawing.status.success(), "{errors}");
    let [drawn, kept] = [picture, root.join("docs/pictures/trot.svg")]
        .map(|path| std::fs::read_to_string(path).unwrap());
    std::fs::remove_dir_all(folder).unwrap();
    assert_eq!(drawn, kept, "docs/pictures/trot.py draws another picture");
}

/// Returns the path of a page of `docs`.
fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../docs/{name}.md"))
}

/// Returns a page of `docs`.
fn page(name: &str) -> String {
    std::fs::read_to_string(path(name)).unwrap()
}

/// Regenerate with `UPDATE_DOCS=1 cargo test -p twinrig-tests --test text keys`.
#[test]
fn keys_of_files_are_those_of_their_declarations() {
    // The tables of servos are with those of their benches.
    let (of_servos, mut of_robots) = (ServoBenchFile::tables(), RobotFile::tables());
    of_robots.retain(|table| of_servos.iter().all(|other| other.name != table.name));
    for (page, heading, tables) in [
        ("campaigns", "### The specification", SweepSpec::tables()),
        ("campaigns", "### The search space", SearchSpace::tables()),
        ("files", "", of_robots),
        ("files", "", BenchFile::tables()),
        ("files", "", LogMapping::tables()),
        ("servos", "", of_servos),
        (
            "servos",
            "### The search space of a fit",
            FitSpace::tables(),
        ),
    ] {
        check_keys(&path(page), heading, &tables);
    }
}

/// Runs a command with the trot and the first file of a section of the page about campaigns, and
/// compares its output with the lines that the page shows, except those with the name of the file
/// and those that begin with one of `skipped`.
fn check_first_example(section: &str, file: &str, words: &[&str], skipped: &[&str]) {
    let folder = std::env::temp_dir().join(format!("twinrig-{file}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let page = page("campaigns");
    let (_, page) = page.split_once(&format!("\n### {section}\n")).unwrap();
    let spec = folder.join(file);
    std::fs::write(&spec, first_block(page, "toml")).unwrap();
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/trot.toml");
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let registry = Registry::standard().with_build(BuildKey::of_bytes(b"documents"));
    let paths = [&scenario, &spec, &folder].map(|path| path.to_str().unwrap());
    let [scenario, spec, folder] = paths;
    let words = [words, &[spec, "--out", folder]].concat();
    let words = [&[words[0], scenario], &words[1..]].concat();
    let code = twinrig::run_with(&registry, words, &mut out, &mut err);
    std::fs::remove_dir_all(folder).unwrap();
    let (out, err) = [out, err]
        .map(|text| String::from_utf8(text).unwrap())
        .into();
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    let shown = first_block(page, "console").lines();
    let shown = shown.filter(|line| !line.contains(file));
    let shown = shown.filter(|line| !skipped.iter().any(|start| line.starts_with(start)));
    for line in shown {
        assert!(out.lines().any(|found| found == line), "{line}\n{out}");
    }
}

/// The first sweep gives the lines that the page shows, except for times and paths.
#[test]
fn first_sweep_has_the_shown_result() {
    let skipped = ["  time", "  report", "    twin run", "…"];
    check_first_example("A first sweep", "friction.toml", &["sweep"], &skipped);
}

#[test]
fn first_optimization_has_the_shown_result() {
    let skipped = ["  time", "  scenario", "  report", "$ twin run"];
    let words = ["optimize", "--space"];
    check_first_example("A first search", "faster.toml", &words, &skipped);
}

/// The list of `twin/experiment/src/studies.rs`.
#[test]
fn every_study_is_in_the_page_of_the_program_and_in_the_page_of_studies() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let read = |file: &str| std::fs::read_to_string(root.join(file)).unwrap();
    let list = read("twin/experiment/src/studies.rs");
    let (_, list) = list.split_once("\nstudies! {").unwrap();
    let names = list.lines().filter_map(|line| line.trim().split_once(": "));
    let names: Vec<String> = names.map(|(name, _)| name.to_lowercase()).collect();
    assert!(names.len() > 9, "{names:?}");
    let commands = read("docs/program.md");
    let (_, commands) = commands.split_once("\n## Studies\n").unwrap();
    let (section, _) = commands.split_once("\n## ").unwrap();
    let (kinds, details) = section.split_once("\n- ").unwrap();
    let page = read("docs/studies.md");
    for name in names {
        let kind = format!("`{name}`");
        assert!(
            kinds.contains(&kind) && details.contains(&kind),
            "{kind} is missing in docs/program.md"
        );
        let row = format!("| [`twin study {name}`]");
        assert!(
            page.contains(&row),
            "`{name}` is missing in docs/studies.md"
        );
    }
}

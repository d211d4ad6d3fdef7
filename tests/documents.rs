//! Consistency of README.md with the program.

use std::path::Path;

use twinrig::{Assembly, Execution, Registry, Status, execute};

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
    let robot = include_str!("../robots/cheetah-cub.toml");
    let readme = readme();
    let scenario = first_block(&readme, "toml");
    let assembly = Assembly::of_texts(&registry, scenario, robot, &[])
        .unwrap_or_else(|error| panic!("{error}"));
    let report = execute(&assembly, &Execution::default()).unwrap();
    assert_eq!(report.verdict, Status::Pass, "{:?}", report.expectations);
}

#[test]
fn readme_verdict_lists_the_expectations_of_the_scenario() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/trot.toml");
    let registry = Registry::standard();
    let assembly = Assembly::of_file(&registry, &path, &[]).unwrap();
    let readme = readme();
    let shown: Vec<&str> = readme
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
fn readme_lists_all_commands() {
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
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    let readme = readme();
    let table: Vec<&str> = readme
        .lines()
        .filter_map(|line| line.strip_prefix("| `twin "))
        .filter_map(|row| row.split([' ', '`']).next())
        .collect();
    assert_eq!(table, expected);
}

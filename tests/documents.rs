//! What README.md shows is so.

use std::path::Path;

use twinrig::{Assembly, Execution, Registry, Status, execute};

fn readme() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
    std::fs::read_to_string(path).unwrap()
}

/// The text between the first ```` ```LANGUAGE ```` and the next ```` ``` ````.
fn first_block<'t>(text: &'t str, language: &str) -> &'t str {
    let (_, rest) = text.split_once(&format!("```{language}\n")).unwrap();
    rest.split_once("```").unwrap().0
}

#[test]
fn the_scenario_of_the_readme_runs_and_holds() {
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
fn the_verdict_that_is_shown_is_about_what_is_expected() {
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
fn the_table_of_commands_has_those_there_are() {
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
    let there_are: Vec<&str> = commands
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    let readme = readme();
    let table: Vec<&str> = readme
        .lines()
        .filter_map(|line| line.strip_prefix("| `twin "))
        .filter_map(|row| row.split([' ', '`']).next())
        .collect();
    assert_eq!(table, there_are);
}

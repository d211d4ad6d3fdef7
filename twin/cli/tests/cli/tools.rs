//! Commands that describe: a robot, the machine, the program itself.

use std::collections::BTreeSet;
use std::process::{Command, Stdio};

use crate::common::{Folder, json, twin};

/// Returns the commands of the program, from the page that `twin --help` prints.
fn commands() -> BTreeSet<String> {
    let help = twin(&["--help"]).out;
    let (_, commands) = help.split_once("Commands:\n").unwrap();
    let (commands, _) = commands.split_once("\n\n").unwrap();
    let names = commands.lines().filter_map(|line| {
        let name = line.strip_prefix("  ")?.split(' ').next()?;
        (!name.is_empty()).then(|| name.to_owned())
    });
    names.collect()
}

/// Runs a program with `input` and returns its success and errors; none if it is not installed.
fn run(program: &str, arguments: &[&str], file: &str) -> Option<(bool, String)> {
    let output = Command::new(program)
        .args(arguments)
        .arg(file)
        .stdin(Stdio::null())
        .output();
    let Ok(output) = output else {
        println!("skipped: {program} is not installed");
        return None;
    };
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    Some((output.status.success(), errors))
}

#[test]
fn completions_offer_every_command_and_are_scripts_of_their_shell() {
    let folder = Folder::new("completions");
    let commands = commands();
    assert!(commands.len() > 15, "{commands:?}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let done = twin(&["completions", shell]);
        assert_eq!((done.code, done.err.as_str()), (0, ""));
        for command in &commands {
            assert!(done.out.contains(command.as_str()), "{shell}: {command}");
        }
        let file = folder.file(shell, &done.out);
        if let Some(checked) = run(shell, &["-n"], &file).filter(|_| shell == "bash") {
            assert_eq!(checked, (true, String::new()));
        }
    }
    assert_eq!(twin(&["completions", "tcsh"]).code, 2);
}

#[test]
fn manual_has_a_page_for_every_command_and_is_free_of_warnings() {
    let folder = Folder::new("man");
    let page = twin(&["man"]).out;
    for command in commands() {
        // A hyphen of a page is `\-`.
        let name = format!("twin\\-{}(1)", command.replace('-', "\\-"));
        assert!(page.contains(&name), "{name}");
    }
    let out = folder.join("pages");
    let done = twin(&["man", "--out", &out]);
    assert_eq!((done.code, done.err.as_str()), (0, ""));
    assert_eq!(
        std::fs::read_to_string(folder.join("pages/twin.1")).unwrap(),
        page
    );
    let names: BTreeSet<_> = std::fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    for command in commands() {
        assert!(names.contains(&format!("twin-{command}.1")), "{command}");
    }
    assert!(names.contains("twin-study-precision.1"), "{names:?}");
    for name in names {
        let page = format!("{out}/{name}");
        let Some(checked) = run("groff", &["-ww", "-man", "-Tutf8", "-z"], &page) else {
            break;
        };
        assert_eq!(checked, (true, String::new()), "{name}");
    }
    // A folder that is a file.
    let file = folder.file("file", "");
    let refused = twin(&["man", "--out", &file]);
    assert_eq!(refused.code, 2);
    assert!(refused.err.contains("file"), "{}", refused.err);
}

#[test]
fn doctor_reports_every_item_with_a_remedy_or_none() {
    let done = twin(&["doctor", "--json"]);
    let found = &json(&done.out)[0];
    assert_eq!(found["version"], env!("CARGO_PKG_VERSION"));
    let items = found["items"].as_array().unwrap();
    let is_broken =
        |item: &&serde_json::Value| item["needed"] == true && item["state"] == "problem";
    assert_eq!(
        done.code,
        u8::from(items.iter().any(|item| is_broken(&item)))
    );
    for item in items {
        let is_ok = item["state"] == "ok";
        assert_eq!(item["remedy"] == "", is_ok, "{item}");
        assert_eq!(item["affects"] == "", is_ok, "{item}");
    }
    let text = twin(&["doctor"]).out;
    for item in items {
        assert!(text.contains(item["name"].as_str().unwrap()), "{item}");
    }
}

#[test]
fn drawing_is_written_where_it_is_wanted() {
    let folder = Folder::new("draw");
    let printed = twin(&["draw", "cheetah-cub", "--out", "-"]);
    assert_eq!((printed.code, printed.err.as_str()), (0, ""));
    let path = folder.join("cub.svg");
    let written = twin(&["draw", "cheetah-cub", "--out", &path]);
    assert_eq!(written.out, format!("written {path}\n"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), printed.out);
    let refused = twin(&["draw", "cheetah-cub", "--out", &folder.join("no/cub.svg")]);
    assert_eq!(refused.code, 2);
    let unknown = twin(&["draw", "cheeta-cub"]);
    assert_eq!(unknown.code, 2);
    assert!(
        unknown.err.contains("did you mean `cheetah-cub`?"),
        "{}",
        unknown.err
    );
}

#[test]
fn listing_of_a_robot_begins_with_what_follows_from_its_file() {
    let without = &json(&twin(&["list", "--json"]).out)[0];
    assert!(without["robot"].is_null());
    let robot = &json(&twin(&["list", "cheetah-cub", "--json"]).out)[0]["robot"];
    assert_eq!(robot["name"], "Cheetah-cub");
    let sections = robot["sections"].as_array().unwrap();
    let parts: Vec<_> = sections.iter().map(|section| &section["part"]).collect();
    assert_eq!(parts, ["body", "leg aslp", "drives"]);
    let facts = sections[1]["facts"].as_array().unwrap();
    let fact = |key: &str| facts.iter().find(|fact| fact["key"] == key).unwrap();
    let stiffness = fact("stiffness_max");
    assert_eq!(stiffness["unit"], "N/m");
    // Thesis, section 2.7.1.
    assert!(
        (stiffness["value"].as_f64().unwrap() - 253.27).abs() < 2.6,
        "{stiffness}"
    );
    assert!(
        stiffness["assumed"]
            .as_array()
            .unwrap()
            .iter()
            .any(|key| key == "leg.aslp.l1")
    );
    let text = twin(&["list", "cheetah-cub"]).out;
    assert!(text.starts_with("Cheetah-cub  "), "{text}");
    assert!(text.find("axial stiffness") < text.find("plants"), "{text}");
    let last = "what follows from robots/cheetah-cub.toml is at the beginning of this list\n";
    assert!(text.ends_with(last), "{text}");
}

//! README.md, and pages of `docs` with one of the first two comments, are followed step by step:
//! their files are written, their commands run, and the output compared with the one shown.
//! README.md is followed beside copies of `scenarios` and `robots`, the others in an empty folder.
//!
//! - `<!-- file: PATH -->` before a block: the block is that file, in the folder of the page.
//! - `<!-- source: PATH -->` before a block: the block is a part of that file of the repository;
//!   of a template as `twin new` fills it, with `PATH as NAME`.
//! - `$ twin …` in a block `console` is run there; the lines up to the next `$` are its output.
//!   `…` stands for any lines. Times of the machine are not compared.
//! - `$ python3 FILE.py …` is run by the Python of `ci/setup`, and must succeed.
//! - `$ cat FILE` shows a file.
//! - `$ echo $?` shows the exit code of the command before. Other commands are not run.
//!
//! `UPDATE_DOCS=1 cargo test -p twinrig-tests --test text tutorials` writes the output into the
//! pages.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use twinrig::{BuildKey, Registry};
use twinrig_testing::folder::Folder;
use twinrig_testing::python;

/// Starts of lines that the machine decides, not the run.
const OF_THE_MACHINE: [&str; 3] = ["  time ", "  report ", "  runs in "];

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn is_followed(page: &str) -> bool {
    ["<!-- file: ", "<!-- source: "]
        .iter()
        .any(|comment| page.lines().any(|line| line.starts_with(comment)))
}

/// Divides a command into words, as a shell does: quotes keep spaces together.
fn words(command: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (Vec::new(), None::<String>, None);
    for letter in command.chars() {
        match (quote, letter) {
            (None, '\'' | '"') => {
                quote = Some(letter);
                word.get_or_insert_default();
            }
            (None, '#') if word.is_none() => break,
            (None, ' ') => words.extend(word.take()),
            (Some(open), close) if open == close => quote = None,
            (_, other) => word.get_or_insert_default().push(other),
        }
    }
    words.extend(word);
    words
}

/// Runs a command of the program or a script, and returns what it prints and its exit code; `None`
/// for other commands, and without Python.
fn run(command: &str) -> Option<(String, u8)> {
    let words = words(command);
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let code = match words.first().map(String::as_str) {
        Some("twin") => {
            let registry = Registry::standard().with_build(BuildKey::of_bytes(b"tutorials"));
            twinrig::run_with(&registry, &words[1..], &mut out, &mut err)
        }
        Some("python3") if words.get(1).is_some_and(|word| !word.starts_with('-')) => {
            let python = python::python("mcap, mcap_ros2, matplotlib, numpy")?;
            let ran = Command::new(python).args(&words[1..]).output().unwrap();
            out = ran.stdout;
            // Of a script that succeeds: notes of its packages, such as of a cache that they build.
            if !ran.status.success() {
                err = ran.stderr;
            }
            u8::from(!ran.status.success())
        }
        Some("cat") => {
            out = fs::read(&words[1]).unwrap();
            0
        }
        _ => return None,
    };
    out.append(&mut err);
    let text = String::from_utf8(out).unwrap();
    let lines = text.lines().map(str::trim_end);
    let kept = lines.skip_while(|line| line.is_empty()).collect::<Vec<_>>();
    Some((kept.join("\n").trim_end().to_owned(), code))
}

/// Returns a line without the value of an attribute `time` of XML.
fn timeless(line: &str) -> String {
    match line.split_once(" time=\"") {
        Some((front, value)) => format!("{front}{}", value.split_once('"').unwrap().1),
        None => line.to_owned(),
    }
}

/// Whether the lines shown are those of the output, with `…` for any number of them.
fn matches(shown: &[&str], found: &[&str]) -> bool {
    let Some((first, rest)) = shown.split_first() else {
        return found.is_empty();
    };
    if first.trim() == "…" {
        return (0..=found.len()).any(|skipped| matches(rest, &found[skipped..]));
    }
    let Some((line, others)) = found.split_first() else {
        return false;
    };
    let of_the_machine = OF_THE_MACHINE
        .iter()
        .any(|start| line.starts_with(start) && first.starts_with(start));
    (of_the_machine || timeless(first) == timeless(line)) && matches(rest, others)
}

/// A page that is followed.
struct Tutorial<'p> {
    folder: &'p Folder,
    /// Page with the output found.
    found: String,
    /// Commands whose output is another one.
    wrong: String,
    commands: usize,
    code: u8,
}

impl Tutorial<'_> {
    fn follow(&mut self, page: &str) {
        let mut lines = page.lines();
        let (mut file, mut source) = (None, None);
        while let Some(line) = lines.next() {
            self.keep(line);
            if let Some(name) = line.strip_prefix("<!-- file: ") {
                file = name.strip_suffix(" -->");
            } else if let Some(name) = line.strip_prefix("<!-- source: ") {
                source = name.strip_suffix(" -->");
            } else if let Some(language) = line.strip_prefix("```") {
                let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
                let text = block.join("\n") + "\n";
                if let Some(name) = file.take() {
                    self.folder.file(name, &text);
                }
                if let Some(name) = source.take() {
                    let (path, name) = name.split_once(" as ").unwrap_or((name, "template_name"));
                    let whole = fs::read_to_string(repository().join(path)).unwrap();
                    let whole = whole.replace("template_name", name);
                    assert!(whole.contains(&text), "{path} does not have:\n{text}");
                }
                if language == "console" {
                    self.console(&block);
                } else {
                    self.keep_all(&block);
                }
                self.keep("```");
            }
        }
    }

    fn console(&mut self, block: &[&str]) {
        let mut rest = block;
        while let Some((command, after)) = rest.split_first() {
            let end = after.iter().position(|line| line.starts_with("$ "));
            let (shown, next) = after.split_at(end.unwrap_or(after.len()));
            self.keep(command);
            let command = command.strip_prefix("$ ");
            self.command(command.expect("a block begins with a command"), shown);
            rest = next;
        }
    }

    fn command(&mut self, command: &str, shown: &[&str]) {
        if command == "echo $?" {
            assert_eq!(shown, [self.code.to_string()], "after {}", self.found);
        } else if let Some((text, code)) = run(command) {
            self.commands += 1;
            self.code = code;
            let found: Vec<&str> = text.lines().collect();
            if !matches(shown, &found) {
                write!(self.wrong, "$ {command}\n{text}\n").unwrap();
                // Output that was cut after some lines is cut there again.
                let cut = shown.last() == Some(&"…") && shown.len() <= found.len();
                let kept = if cut { shown.len() - 1 } else { found.len() };
                self.keep_all(&found[..kept]);
                if cut {
                    self.keep("…");
                }
                return;
            }
        }
        self.keep_all(shown);
    }

    fn keep_all(&mut self, lines: &[&str]) {
        for line in lines {
            self.keep(line);
        }
    }

    fn keep(&mut self, line: &str) {
        self.found.push_str(line);
        self.found.push('\n');
    }
}

/// Copies the files of a folder, and those below it.
fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let source = entry.unwrap().path();
        let target = to.join(source.file_name().unwrap());
        if source.is_dir() {
            copy(&source, &target);
        } else {
            fs::copy(&source, &target).unwrap();
        }
    }
}

/// One test, as the pages take the working folder in turn.
#[test]
fn tutorials_give_the_shown_output() {
    let docs = repository().join("docs").canonicalize().unwrap();
    let mut pages: Vec<PathBuf> = fs::read_dir(&docs)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "md"))
        .filter(|path| is_followed(&fs::read_to_string(path).unwrap()))
        .collect();
    pages.sort();
    let readme = docs.parent().unwrap().join("README.md");
    assert!(is_followed(&fs::read_to_string(&readme).unwrap()));
    pages.push(readme.clone());
    let (mut wrong, mut commands) = (String::new(), 0);
    for path in &pages {
        let text = fs::read_to_string(path).unwrap();
        let folder = Folder::new(&path.file_stem().unwrap().to_string_lossy());
        if *path == readme {
            for part in ["scenarios", "robots"] {
                copy(&repository().join(part), &folder.path().join(part));
            }
        }
        std::env::set_current_dir(folder.path()).unwrap();
        let mut tutorial = Tutorial {
            folder: &folder,
            found: String::new(),
            wrong: String::new(),
            commands: 0,
            code: 0,
        };
        tutorial.follow(&text);
        std::env::set_current_dir(&docs).unwrap();
        commands += tutorial.commands;
        if !tutorial.wrong.is_empty() {
            writeln!(wrong, "{}\n{}", path.display(), tutorial.wrong).unwrap();
            if std::env::var_os("UPDATE_DOCS").is_some() {
                fs::write(path, tutorial.found).unwrap();
            }
        }
    }
    assert!(commands > 0, "no page has a command");
    assert!(
        wrong.is_empty(),
        "UPDATE_DOCS=1 updates the pages:\n{wrong}"
    );
}

//! First contact with boards: the scenario made for it, the page of the protocol and its example.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

use serde_json::Value;
use twinrig::runtime::Device;
use twinrig_wire::SerialPort;

use super::{Running, now, run_on_twin, wait_until};
use crate::common::{Folder, twin};

/// Longest wait for an answer, on a busy machine.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);
/// Attempts of an example that a busy machine may disturb.
const ATTEMPTS: u32 = 10;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn scenario() -> String {
    let file = repository().join("scenarios/first-contact.toml");
    file.display().to_string()
}

/// All of its expectations are observed without a plant, and with the same names as in virtual
/// time.
#[test]
fn first_contact_is_judged_completely_on_hardware() {
    let folder = Folder::new("first-contact");
    let lockstep = twin(&["run", &scenario(), "--json", "--no-record"]);
    assert_eq!(lockstep.code, 0, "{lockstep:?}");
    let [run, served] = run_on_twin(&folder, &scenario(), &folder.join("bus"), &["--json"]);
    assert_eq!(served.code, Some(0), "{served:?}");
    let (lockstep, real) = (&crate::common::json(&lockstep.out)[0], &run.report());
    let names = |report: &Value| {
        let lines = report["expectations"].as_array().unwrap().iter();
        let names = lines.map(|line| line["name"].as_str().unwrap().to_owned());
        names.collect::<Vec<_>>()
    };
    assert_eq!(names(lockstep), names(real));
    for line in real["expectations"].as_array().unwrap() {
        // Whether they hold depends on the machine.
        let observed = line["verdict"] != "unobserved";
        assert!(observed || super::bus_was_late(line), "{line}");
        assert_eq!(line["measured"].is_number(), observed, "{line}");
    }
    let failed = real["verdict"] == "fail";
    let notes = real["real_time"]["notes"].to_string();
    assert!(!failed || notes.contains("twin doctor"), "{real}");
}

#[test]
fn boards_that_do_not_answer_fail_first_contact() {
    let folder = Folder::new("no-contact");
    let fault = r#"fault=[{at="2 s",for="10 s",on="wire/sbcp",kind="drop"}]"#;
    let words = ["--json", "--set", fault, "--set", "duration=\"5 s\""];
    let link = folder.join("bus");
    let served = ["--set", fault];
    let run = super::with_retries(|| {
        let mut served = Running::serve(&folder, &scenario(), &link, &served);
        let run = Running::run(&folder, &scenario(), &link, &words).end();
        served.end();
        run.in_time("")
    });
    // Closing may fail, too: the boards do not confirm that their motors coast.
    assert_ne!(run.code, Some(0), "{run:?}");
    let report = run.report();
    let lines = report["expectations"].as_array().unwrap();
    let verdict = |name: &str| &lines.iter().find(|line| line["name"] == name).unwrap()["verdict"];
    assert_eq!(verdict("boards answer"), "fail", "{report}");
    // The counters of a dead bus count nothing.
    let counted = verdict("commands are in the range of the boards");
    assert_eq!(counted, "unobserved", "{report}");
}

fn bytes(hexadecimal: &str) -> Vec<u8> {
    let bytes = hexadecimal.split_whitespace();
    bytes
        .map(|byte| u8::from_str_radix(byte, 16).unwrap())
        .collect()
}

fn transfer(port: &mut SerialPort, request: &[u8], length: usize) -> Vec<u8> {
    port.write(request).unwrap();
    let (mut answer, begin) = (Vec::new(), now());
    while answer.len() < length && begin.elapsed() < ANSWER_TIMEOUT {
        port.read(Duration::from_millis(20), &mut answer).unwrap();
    }
    answer
}

#[test]
fn boards_answer_as_on_the_page() {
    let folder = Folder::new("page");
    let page = std::fs::read_to_string(repository().join("docs/sbcp.md")).unwrap();
    let sent =
        |direction: &'static str| page.lines().filter_map(move |l| l.strip_prefix(direction));
    let examples: Vec<_> = sent("> FF").zip(sent("< FF")).collect();
    assert!(examples.len() >= 5);
    let link = folder.join("bus");
    let _served = Running::serve(&folder, &scenario(), &link, &["--keep"]);
    let mut port = SerialPort::open(Path::new(&link), 3_333_333).unwrap();
    for (request, answer) in examples {
        let [request, answer] = [request, answer].map(|rest| bytes(&format!("FF{rest}")));
        // A busy machine may tear a request apart; a repeated one has the same answer.
        let right = (0..ATTEMPTS).any(|_| transfer(&mut port, &request, answer.len()) == answer);
        assert!(right, "{request:02X?} is not answered by {answer:02X?}");
    }
}

#[test]
fn example_of_the_page_pings_all_boards() {
    let folder = Folder::new("ping");
    let link = folder.join("bus");
    let _served = Running::serve(&folder, &scenario(), &link, &["--keep"]);
    let page = std::fs::read_to_string(repository().join("docs/sbcp.md")).unwrap();
    let shown: Vec<&str> = page
        .lines()
        .skip_while(|line| !line.starts_with("$ python3 docs/examples/sbcp_ping.py"))
        .skip(1)
        .take_while(|line| !line.starts_with("```"))
        .collect();
    let ping = || -> Output {
        let script = repository().join("docs/examples/sbcp_ping.py");
        let mut python = Command::new("python3");
        python.arg(script).arg(&link).output().unwrap()
    };
    let mut output = ping();
    wait_until("all boards are pinged", || {
        let done = output.status.success();
        if !done {
            output = ping();
        }
        done
    });
    let printed = String::from_utf8_lossy(&output.stdout);
    assert_eq!(printed.lines().collect::<Vec<_>>(), shown);
}

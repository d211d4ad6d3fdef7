//! What is asked for wrongly is refused, with the remedy.

use std::os::unix::fs::symlink;

use twinrig_wire::{Pty, SerialPort};

use super::BENCH;
use crate::common::{Done, Folder, SOUND, json, twin};

fn run_at(scenario: &str, ports: &[&str]) -> Done {
    let ports = ports.iter().flat_map(|port| ["--port", port]);
    let words: Vec<&str> = ["run", scenario, "--no-record"]
        .into_iter()
        .chain(ports)
        .collect();
    twin(&words)
}

fn says(done: &Done, words: &[&str]) {
    assert_eq!(done.code, 2, "{done:?}");
    for word in words {
        assert!(done.err.contains(word), "`{word}` is not in {}", done.err);
    }
}

#[test]
fn a_port_for_a_bus_that_is_not_there_is_refused() {
    let folder = Folder::new("no-bus");
    let bench = folder.file("bench.toml", BENCH);
    let words = ["there is no bus `sbpc`", "did you mean `sbcp`?"];
    says(&run_at(&bench, &["sbpc=/dev/ttyUSB0"]), &words);
    let link = format!("sbpc={}", folder.join("bus"));
    says(&twin(&["serve", &bench, "--pty", &link]), &words);
    let sound = folder.file("sound.toml", SOUND);
    says(
        &run_at(&sound, &["sbcp=/dev/ttyUSB0"]),
        &["there is no bus `sbcp`", "no [bus] at all"],
    );
}

#[test]
fn a_bus_without_a_port_is_refused_if_another_has_one() {
    let folder = Folder::new("no-port");
    let two = BENCH.replace(
        "bus = { kind = \"sbcp\", error_threshold = -1 }",
        "bus = [{ kind = \"sbcp\" }, { kind = \"rb110\" }]",
    );
    let two = two.replace("[controller]", "[controller]\nabduction = true");
    let scenario = folder.file("two.toml", &two);
    let pty = Pty::open().unwrap();
    let port = format!("sbcp={}", pty.path().display());
    let remedy = "add `--port rb110=DEVICE`";
    says(
        &run_at(&scenario, &[&port]),
        &["`rb110` has no device", remedy],
    );
}

#[test]
fn a_bus_with_two_devices_is_refused() {
    let folder = Folder::new("two-ports");
    let bench = folder.file("bench.toml", BENCH);
    let ports = ["sbcp=/dev/ttyUSB0", "sbcp=/dev/ttyUSB1"];
    says(
        &run_at(&bench, &ports),
        &["bus `sbcp`: /dev/ttyUSB1: ", "/dev/ttyUSB0 already"],
    );
    let (a, b) = (
        format!("sbcp={}", folder.join("a")),
        format!("sbcp={}", folder.join("b")),
    );
    let done = twin(&["serve", &bench, "--pty", &a, "--pty", &b]);
    says(&done, &["bus `sbcp`: ", "already"]);
}

#[test]
fn a_device_that_cannot_be_used_is_named_with_its_bus() {
    let folder = Folder::new("device");
    let bench = folder.file("bench.toml", BENCH);
    let missing = folder.join("ttyUSB7");
    let words = format!("bus `sbcp`: {missing}: there is no such device");
    says(
        &run_at(&bench, &[&format!("sbcp={missing}")]),
        &[&words, "plugged in"],
    );
    for no_port in ["/dev/null", &bench] {
        let words = format!("bus `sbcp`: {no_port}: ");
        says(&run_at(&bench, &[&format!("sbcp={no_port}")]), &[&words]);
    }
    let pty = Pty::open().unwrap();
    let taken = SerialPort::open(pty.path(), 3_333_333).unwrap();
    let port = format!("sbcp={}", pty.path().display());
    says(&run_at(&bench, &[&port]), &["in use"]);
    drop(taken);
}

#[test]
fn a_program_learns_of_it_from_the_report() {
    let folder = Folder::new("device-json");
    let bench = folder.file("bench.toml", BENCH);
    let port = format!("sbcp={}", folder.join("ttyUSB7"));
    let done = twin(&["run", &bench, "--no-record", "--json", "--port", &port]);
    let report = &json(&done.out)[0];
    assert_eq!((done.code, &report["verdict"]), (2, &"error".into()));
    let error = report["error"].as_str().unwrap();
    assert!(error.contains("there is no such device"), "{error}");
    assert!(done.err.is_empty(), "{}", done.err);
}

#[test]
fn what_has_no_bus_cannot_be_served() {
    let folder = Folder::new("nothing");
    let sound = folder.file("sound.toml", SOUND);
    let pty = format!("sbcp={}", folder.join("bus"));
    for words in [&["serve", &sound][..], &["serve", &sound, "--pty", &pty]] {
        says(&twin(words), &["nothing to serve", &sound]);
    }
}

#[test]
fn a_link_takes_the_place_of_no_other_file() {
    let folder = Folder::new("link");
    let bench = folder.file("bench.toml", BENCH);
    let other = folder.join("other");
    symlink(&bench, &other).unwrap();
    for place in [&bench, &other] {
        let pty = format!("sbcp={place}");
        let done = twin(&["serve", &bench, "--pty", &pty]);
        says(&done, &["bus `sbcp`", place, "take another name"]);
    }
    assert_eq!(std::fs::read_to_string(&other).unwrap(), BENCH);
    let nowhere = format!("sbcp={}", folder.join("no/where"));
    let done = twin(&["serve", &bench, "--pty", &nowhere]);
    says(&done, &["bus `sbcp`", "no/where"]);
}

#[test]
fn devices_are_listed_for_persons_and_programs() {
    let (told, listed) = (twin(&["devices"]), twin(&["devices", "--json"]));
    assert_eq!((told.code, listed.code), (0, 0), "{told:?} {listed:?}");
    let ports = json(&listed.out)[0]["ports"].as_array().unwrap().clone();
    for port in &ports {
        assert!(told.out.contains(port["path"].as_str().unwrap()), "{port}");
        assert!(port["usb"].is_null() || port["usb"]["vendor"].is_u64());
        assert!(port["latency_timer_s"].is_null() || port["latency_timer_s"].is_f64());
    }
    if ports.is_empty() {
        assert!(told.out.contains("no serial ports"), "{}", told.out);
    }
}

//! Errors of the hardware commands, with their remedies.

use std::net::TcpListener;
use std::os::unix::fs::symlink;

use twinrig_wire::{Pty, SerialPort};

use super::STAND;
use crate::common::{Done, Folder, SOUND, json, twin};

fn run_at(scenario: &str, ports: &[&str]) -> Done {
    let ports = ports.iter().flat_map(|port| ["--port", port]);
    let words: Vec<&str> = ["run", scenario, "--no-record"]
        .into_iter()
        .chain(ports)
        .collect();
    twin(&words)
}

fn fails_with(done: &Done, words: &[&str]) {
    assert_eq!(done.code, 2, "{done:?}");
    for word in words {
        assert!(done.err.contains(word), "`{word}` is not in {}", done.err);
    }
}

#[test]
fn port_of_unknown_bus_is_refused() {
    let folder = Folder::new("no-bus");
    let bench = folder.file("bench.toml", STAND);
    let words = ["there is no bus `sbpc`", "did you mean `sbcp`?"];
    fails_with(&run_at(&bench, &["sbpc=/dev/ttyUSB0"]), &words);
    let link = format!("sbpc={}", folder.join("bus"));
    fails_with(&twin(&["serve", &bench, "--pty", &link]), &words);
    let sound = folder.file("sound.toml", SOUND);
    fails_with(
        &run_at(&sound, &["sbcp=/dev/ttyUSB0"]),
        &["there is no bus `sbcp`", "the scenario has no [bus]"],
    );
}

#[test]
fn bus_without_port_is_refused_if_another_has_one() {
    let folder = Folder::new("no-port");
    let two = STAND.replace(
        "bus = { kind = \"sbcp\", error_threshold = -1 }",
        "bus = [{ kind = \"sbcp\" }, { kind = \"rb110\" }]",
    );
    let two = two.replace("[controller]", "[controller]\nabduction = true");
    let scenario = folder.file("two.toml", &two);
    let pty = Pty::open().unwrap();
    let port = format!("sbcp={}", pty.path().display());
    let remedy = "add `--port rb110=DEVICE`";
    fails_with(
        &run_at(&scenario, &[&port]),
        &["`rb110` has no device", remedy],
    );
}

#[test]
fn bus_with_two_devices_is_refused() {
    let folder = Folder::new("two-ports");
    let bench = folder.file("bench.toml", STAND);
    let ports = ["sbcp=/dev/ttyUSB0", "sbcp=/dev/ttyUSB1"];
    fails_with(
        &run_at(&bench, &ports),
        &["bus `sbcp`: /dev/ttyUSB1: ", "/dev/ttyUSB0 already"],
    );
    let (a, b) = (
        format!("sbcp={}", folder.join("a")),
        format!("sbcp={}", folder.join("b")),
    );
    let done = twin(&["serve", &bench, "--pty", &a, "--pty", &b]);
    fails_with(&done, &["bus `sbcp`: ", "already"]);
}

#[test]
fn device_error_names_device_and_bus() {
    let folder = Folder::new("device");
    let bench = folder.file("bench.toml", STAND);
    let missing = folder.join("ttyUSB7");
    let words = format!("bus `sbcp`: {missing}: there is no such device");
    fails_with(
        &run_at(&bench, &[&format!("sbcp={missing}")]),
        &[&words, "plugged in"],
    );
    for no_port in ["/dev/null", &bench] {
        let words = format!("bus `sbcp`: {no_port}: ");
        fails_with(&run_at(&bench, &[&format!("sbcp={no_port}")]), &[&words]);
    }
    let pty = Pty::open().unwrap();
    let taken = SerialPort::open(pty.path(), 3_333_333).unwrap();
    let port = format!("sbcp={}", pty.path().display());
    fails_with(&run_at(&bench, &[&port]), &["in use"]);
    drop(taken);
}

#[test]
fn address_error_names_address_and_bus() {
    let folder = Folder::new("address");
    let bench = folder.file("bench.toml", STAND);
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let taken = format!("tcp://127.0.0.1:{port}");
    let serve = |words: &[&str]| twin(&[&["serve", &bench, "--listen"], words].concat());
    let done = serve(&[&format!("sbcp={taken}")]);
    fails_with(&done, &[&format!("bus `sbcp`: {taken}: in use")]);
    drop(listener);
    for scheme in ["tcp", "rfc2217"] {
        let port = format!("{scheme}://127.0.0.1:{port}");
        let words = format!("bus `sbcp`: {port}: the connection was refused");
        fails_with(&run_at(&bench, &[&format!("sbcp={port}")]), &[&words]);
    }
    let words = [
        "bus `sbcp`: tcp://robot: the port is missing",
        "tcp://HOST:PORT",
    ];
    fails_with(&run_at(&bench, &["sbcp=tcp://robot"]), &words);
    let words = [
        "bus `sbcp`: udp://4000: unknown scheme",
        "rfc2217://HOST:PORT",
    ];
    fails_with(&serve(&["sbcp=udp://4000"]), &words);
    let words = ["there is no bus `sbpc`", "did you mean `sbcp`?"];
    fails_with(&serve(&["sbpc=tcp://4000"]), &words);
    let done = serve(&["sbcp=tcp://0", "--pty", "sbcp=link"]);
    fails_with(
        &done,
        &["bus `sbcp`: tcp://0: ", "assigned to link already"],
    );
}

#[test]
fn device_error_is_in_json_report() {
    let folder = Folder::new("device-json");
    let bench = folder.file("bench.toml", STAND);
    let port = format!("sbcp={}", folder.join("ttyUSB7"));
    let done = twin(&["run", &bench, "--no-record", "--json", "--port", &port]);
    let report = &json(&done.out)[0];
    assert_eq!((done.code, &report["verdict"]), (2, &"error".into()));
    let error = report["error"].as_str().unwrap();
    assert!(error.contains("there is no such device"), "{error}");
    assert!(done.err.is_empty(), "{}", done.err);
}

#[test]
fn scenario_without_bus_cannot_be_served() {
    let folder = Folder::new("nothing");
    let sound = folder.file("sound.toml", SOUND);
    let pty = format!("sbcp={}", folder.join("bus"));
    for words in [&["serve", &sound][..], &["serve", &sound, "--pty", &pty]] {
        fails_with(&twin(words), &["nothing to serve", &sound]);
    }
}

#[test]
fn link_replaces_no_existing_file() {
    let folder = Folder::new("link");
    let bench = folder.file("bench.toml", STAND);
    let other = folder.join("other");
    symlink(&bench, &other).unwrap();
    for place in [&bench, &other] {
        let pty = format!("sbcp={place}");
        let done = twin(&["serve", &bench, "--pty", &pty]);
        fails_with(&done, &["bus `sbcp`", place, "choose another name"]);
    }
    assert_eq!(std::fs::read_to_string(&other).unwrap(), STAND);
    let nowhere = format!("sbcp={}", folder.join("no/where"));
    let done = twin(&["serve", &bench, "--pty", &nowhere]);
    fails_with(&done, &["bus `sbcp`", "no/where"]);
}

#[test]
fn devices_are_listed_as_text_and_json() {
    let (text, listed) = (twin(&["devices"]), twin(&["devices", "--json"]));
    assert_eq!((text.code, listed.code), (0, 0), "{text:?} {listed:?}");
    let ports = json(&listed.out)[0]["ports"].as_array().unwrap().clone();
    for port in &ports {
        assert!(text.out.contains(port["path"].as_str().unwrap()), "{port}");
        assert!(port["usb"].is_null() || port["usb"]["vendor"].is_u64());
        assert!(port["latency_timer_s"].is_null() || port["latency_timer_s"].is_f64());
    }
    if ports.is_empty() {
        assert!(text.out.contains("no serial ports"), "{}", text.out);
    }
}

//! Export of FMUs: refusals, and the archive. The library is a file with its marker only.

use twinrig::fmu::MARKER;
use twinrig::{BusKind, PlantKind};
use twinrig_devices::FramedDevice;
use twinrig_devices::rb110::{PulseMap, Rb110};

use crate::common::{Done, Folder, SOUND, panicking, registry, toy_ports, twin, twin_of};

/// A complete scenario of standard parts.
const HANGING: &str = r#"
robot = "cheetah-cub"
duration = "1 s"
plant = { model = "massless", base = "fixed" }
controller = { kind = "stand", period = "2 ms" }
"#;

fn library(folder: &Folder, marker: &str) -> String {
    let marker: String = marker.chars().rev().collect();
    folder.file("library.so", &format!("\x7fELF…{marker}…"))
}

/// Exports a scenario of this text.
fn export(folder: &Folder, text: &str, words: &[&str]) -> Done {
    let scenario = folder.file("scene.toml", text);
    let (library, out) = (library(folder, MARKER), folder.join("scene.fmu"));
    let all = ["export", "fmu", &scenario, "--library", &library];
    twin_of(&panicking(), &[&all[..], &["--out", &out], words].concat())
}

fn refused(done: &Done, expected: &[&str]) {
    assert_eq!((done.code, done.out.as_str()), (2, ""), "{}", done.err);
    for expected in expected {
        assert!(done.err.contains(expected), "{expected}: {}", done.err);
    }
}

#[test]
fn export_names_the_file_and_the_numbers_of_variables() {
    let folder = Folder::new("fmu");
    let done = export(&folder, HANGING, &[]);
    assert_eq!(done.code, 0, "{}", done.err);
    assert!(done.out.contains("scene.fmu: FMI 2.0, plant with 8 inputs"));
    let bytes = std::fs::read(folder.join("scene.fmu")).unwrap();
    assert!(bytes.starts_with(b"PK"));
    let done = export(&folder, HANGING, &["--part", "rig", "--fmi", "3"]);
    assert!(
        done.out.contains("scene.fmu: FMI 3.0, rig with"),
        "{}",
        done.out
    );
    assert_ne!(std::fs::read(folder.join("scene.fmu")).unwrap(), bytes);
}

#[test]
fn parts_that_the_library_lacks_are_refused_with_the_reason() {
    let folder = Folder::new("fmu-parts");
    let own = "standard parts only";
    let toy = export(&folder, SOUND, &[]);
    refused(
        &toy,
        &["the plant `toy`", own, "scene.toml", "--plant MODEL"],
    );
    let clumsy = HANGING.replace("stand", "clumsy");
    for part in ["rig", "plant"] {
        let done = export(&folder, &clumsy, &["--part", part]);
        refused(
            &done,
            &["the controller `clumsy`", own, "with standard parts"],
        );
    }
    assert!(!std::path::Path::new(&folder.join("scene.fmu")).exists());
}

#[test]
fn plant_always_has_its_energy_balance() {
    let folder = Folder::new("fmu-empty");
    let text = r#"
robot = "cheetah-cub"
duration = "1 s"
plant = { model = "massless", base = "fixed" }
actuator = { kind = "none" }
record = { signals = [], frames = "0 Hz" }
"#;
    let done = export(&folder, text, &[]);
    assert!(
        done.out.contains("plant with 0 inputs and 8 outputs"),
        "{}{}",
        done.out,
        done.err
    );
}

#[test]
fn part_that_replaces_a_standard_one_is_refused() {
    let folder = Folder::new("fmu-replaced");
    let scenario = folder.file("scene.toml", HANGING);
    let library = library(&folder, MARKER);
    let own = PlantKind::new("massless", "another one", |_| {
        Ok(crate::common::Toy::sound())
    });
    let registry = registry().with_plant(own.with_ports(|_| Ok(toy_ports())));
    let words = ["export", "fmu", &scenario, "--library", &library];
    let done = twin_of(&registry, &words);
    refused(&done, &["the plant `massless`", "part of this program"]);
}

#[test]
fn custom_bus_is_refused() {
    let folder = Folder::new("fmu-bus");
    let text = format!("{HANGING}bus = {{ kind = \"own\" }}\n");
    let scenario = folder.file("scene.toml", &text);
    let (library, out) = (library(&folder, MARKER), folder.join("scene.fmu"));
    let board = |name: &str| Rb110::with_servos(name, PulseMap::ONCILLA, &[]);
    let own = BusKind::new(
        "own",
        "a servo board",
        move |context| Ok(board(context.name).driver()?),
        move |context| Ok(board(context.name).wire(&context.fault_schedule())?),
    );
    let registry = registry().with_bus(own);
    let words = [
        "export",
        "fmu",
        &scenario,
        "--library",
        &library,
        "--out",
        &out,
    ];
    let done = twin_of(&registry, &words);
    refused(&done, &["the bus `own`", "part of this program"]);
}

#[test]
fn file_that_is_no_library_of_this_version_is_refused() {
    let folder = Folder::new("fmu-library");
    let scenario = folder.file("scene.toml", HANGING);
    let out = folder.join("scene.fmu");
    let with = |library: &str| {
        twin(&[
            "export",
            "fmu",
            &scenario,
            "--library",
            library,
            "--out",
            &out,
        ])
    };
    let other = library(&folder, &MARKER.replace("0.1", "0.0"));
    let remedy = "cargo build --release -p twinrig-fmu";
    refused(&with(&other), &["library.so", "of version", remedy]);
    let text = folder.file("library.so", "a text");
    refused(&with(&text), &["library.so", remedy]);
    let missing = folder.join("missing.so");
    refused(&with(&missing), &["cannot be read", "missing.so"]);
    assert!(!std::path::Path::new(&out).exists());
}

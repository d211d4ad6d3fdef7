//! Robot descriptions of arbitrary text: no panic, and what is accepted is a valid robot file.

#![no_main]

use libfuzzer_sys::fuzz_target;
use twinrig_description::{Language, import};
use twinrig_robot::RobotFile;

fuzz_target!(|text: &str| {
    for language in [Language::Urdf, Language::Mjcf] {
        if let Ok(made) = import(language, "fuzz.xml", text, None) {
            let robot = RobotFile::parse("fuzz.toml", &made.text).and_then(|file| file.robot());
            assert!(robot.is_ok(), "{}", made.text);
        }
    }
});

//! Scenarios that every build contains.

/// A scenario of the folder `scenarios` and its text.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Example {
    /// Name of the file without its extension.
    pub(crate) name: &'static str,
    /// Text of the file.
    pub(crate) text: &'static str,
}

macro_rules! examples {
    ($($name:literal)*) => {
        /// All examples, sorted by name.
        pub(crate) const EXAMPLES: &[Example] = &[$(Example {
            name: $name,
            text: include_str!(concat!("../files/scenarios/", $name, ".toml")),
        }),*];
    };
}

examples! {
    "bench"
    "bench-faults"
    "bench-stall"
    "fall"
    "first-contact"
    "gets-up"
    "hard-stop"
    "ice"
    "leg-drop"
    "obstacle"
    "oncilla-clocks"
    "oncilla-push"
    "oncilla-sidestep"
    "oncilla-trot"
    "oncilla-turn"
    "passive-legs"
    "passive-legs-free"
    "payload"
    "push"
    "servo"
    "stand"
    "step-change"
    "step-down"
    "tegotae"
    "tegotae-force"
    "tegotae-noisy"
    "tegotae-start"
    "tegotae-tactile"
    "tegotae-trot"
    "trot"
    "trot-damped"
    "trot-dynamixel"
    "trot-fast"
    "trot-foot-load"
    "trot-grip"
    "trot-serial"
    "trot-slow-servo"
    "walk"
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fs;
    use std::path::Path;

    use super::*;

    /// The files are links into the folder of the repository; where links are not supported, their
    /// targets would be compiled in place of the scenarios.
    #[test]
    fn examples_are_the_scenarios_of_the_repository() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
        let paths = fs::read_dir(folder).unwrap();
        let paths = paths.map(|entry| entry.unwrap().path());
        let stored = paths.filter(|path| path.extension().is_some_and(|known| known == "toml"));
        let stored: BTreeMap<_, _> = stored
            .map(|path| {
                let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
                (name, fs::read_to_string(path).unwrap())
            })
            .collect();
        let pair = |example: &Example| (example.name.to_owned(), example.text.to_owned());
        let embedded: Vec<_> = EXAMPLES.iter().map(pair).collect();
        assert_eq!(embedded, stored.into_iter().collect::<Vec<_>>());
    }
}

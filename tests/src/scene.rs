//! Short scenes on the real robot.

use twinrig::kernel::SimTime;
use twinrig::runtime::Rig;
use twinrig::{Assembly, Execution, Registry, Report, execute};
use twinrig_record::{Digest, Fingerprint};

const ROBOT: &str = include_str!("../../robots/cheetah-cub.toml");

/// A trot of which some things can be left out.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Length of the run.
    pub duration_ms: u64,
    /// Seed of the run.
    pub seed: u64,
    /// `free`, `planar` or `fixed`.
    pub base: &'static str,
    /// The legs that are there.
    pub legs: &'static [&'static str],
    /// Whether there is ground.
    pub ground: bool,
    /// Lines of the `[io]` table: nothing takes any time without.
    pub io: &'static str,
    /// Lines of the `[record]` table: everything is recorded without.
    pub record: &'static str,
    /// The plant.
    pub model: &'static str,
    /// Lines of the `[plant]` table.
    pub plant: &'static str,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            duration_ms: 600,
            seed: 1,
            base: "free",
            legs: &["LF", "RF", "LH", "RH"],
            ground: true,
            io: "",
            record: "",
            model: "massless",
            plant: "",
        }
    }
}

impl Scene {
    /// The same with all the inertia of the legs.
    #[must_use]
    pub fn of_full_legs(self) -> Self {
        Self {
            model: "lcp",
            ..self
        }
    }

    /// As a scenario file has it.
    pub fn text(&self) -> String {
        let ground = if self.ground {
            "ground = { friction = 0.6 }"
        } else {
            ""
        };
        format!(
            r#"
            name = "short trot"
            robot = "cheetah-cub"
            duration = "{} ms"
            seed = {}
            [plant]
            model = "{}"
            base = "{}"
            legs = {:?}
            {ground}
            {}
            [controller]
            kind = "cpg"
            gait = "trot"
            period = "2 ms"
            frequency = "3 Hz"
            ramp = "0.2 s"
            [io]
            {}
            [record]
            {}
            "#,
            self.duration_ms,
            self.seed,
            self.model,
            self.base,
            self.legs,
            self.plant,
            self.io,
            self.record
        )
    }

    /// The scene, of the parts of `registry`.
    ///
    /// # Panics
    /// If it cannot be: then the test is wrong.
    pub fn assembly<'r>(&self, registry: &'r Registry) -> Assembly<'r> {
        match Assembly::of_texts(registry, &self.text(), ROBOT, &[]) {
            Ok(assembly) => assembly,
            Err(error) => panic!("{error}"),
        }
    }
}

/// The fingerprint of a run to its end.
///
/// # Panics
/// If it does not come to its end.
pub fn run(assembly: &Assembly<'_>) -> Digest {
    match assembly.rig() {
        Ok(mut rig) => run_from(&mut rig, assembly.end()),
        Err(error) => panic!("{error}"),
    }
}

/// The fingerprint of everything that happens from now to `end`.
///
/// # Panics
/// If the run does not come to its end.
pub fn run_from(rig: &mut Rig, end: SimTime) -> Digest {
    let mut fingerprint = Fingerprint::new();
    if let Err(error) = rig.run_until(end, &mut fingerprint) {
        panic!("{error}");
    }
    fingerprint.digest()
}

/// Runs and records; the file is gone when the recording has been read.
///
/// # Panics
/// If that cannot be done.
pub fn record(assembly: &Assembly<'_>, name: &str) -> (Report, Vec<u8>) {
    let path = std::env::temp_dir().join(format!("twinrig-{}-{name}.mcap", std::process::id()));
    let execution = Execution {
        recording: Some(path.clone()),
        progress: false,
        ports: Vec::new(),
    };
    let report = match execute(assembly, &execution) {
        Ok(report) => report,
        Err(error) => panic!("{error}"),
    };
    let bytes = std::fs::read(&path);
    let _ = std::fs::remove_file(&path);
    match bytes {
        Ok(bytes) => (report, bytes),
        Err(error) => panic!("{}: {error}", path.display()),
    }
}

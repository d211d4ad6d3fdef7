//! Short trots of the real robot.

use twinrig::kernel::SimTime;
use twinrig::runtime::Rig;
use twinrig::{Assembly, Execution, Registry, Report, execute};
use twinrig_record::{Digest, Fingerprint};

const ROBOT: &str = include_str!("../../robots/cheetah-cub.toml");

/// A configurable short trot.
#[derive(Clone, Debug)]
pub struct TrotFixture {
    /// Duration of the run \[ms\].
    pub duration_ms: u64,
    /// Seed of the run.
    pub seed: u64,
    /// `free`, `planar` or `fixed`.
    pub base: &'static str,
    /// Names of the legs.
    pub legs: &'static [&'static str],
    /// Whether there is ground.
    pub ground: bool,
    /// Lines of the `[io]` table; by default nothing takes time.
    pub io: &'static str,
    /// Lines of the `[record]` table; by default everything is recorded.
    pub record: &'static str,
    /// Model of the plant.
    pub model: &'static str,
    /// Lines of the `[plant]` table.
    pub plant: &'static str,
    /// Lines of the `[actuator]` table.
    pub actuator: &'static str,
}

impl Default for TrotFixture {
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
            actuator: "",
        }
    }
}

impl TrotFixture {
    /// The same trot with the inertia of the legs.
    #[must_use]
    pub fn with_leg_inertia(self) -> Self {
        Self {
            model: "lcp",
            ..self
        }
    }

    /// Formats the fixture as a scenario file.
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
            [actuator]
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
            self.actuator,
            self.io,
            self.record
        )
    }

    /// Assembles the fixture with the parts of `registry`.
    ///
    /// # Panics
    /// If the scenario is invalid.
    pub fn assembly<'r>(&self, registry: &'r Registry) -> Assembly<'r> {
        match Assembly::builder(registry)
            .robot(ROBOT)
            .recorded(&self.text())
        {
            Ok(assembly) => assembly,
            Err(error) => panic!("{error}"),
        }
    }
}

/// Returns the fingerprint of a complete run.
///
/// # Panics
/// If the run does not complete.
pub fn run(assembly: &Assembly<'_>) -> Digest {
    match assembly.rig() {
        Ok(mut rig) => run_from(&mut rig, assembly.end()),
        Err(error) => panic!("{error}"),
    }
}

/// Returns the fingerprint of the run from now to `end`.
///
/// # Panics
/// If the run does not complete.
pub fn run_from(rig: &mut Rig, end: SimTime) -> Digest {
    let mut fingerprint = Fingerprint::new();
    if let Err(error) = rig.run_until(end, &mut fingerprint) {
        panic!("{error}");
    }
    fingerprint.digest()
}

/// Runs and records; returns the report and the contents of the temporary recording.
///
/// # Panics
/// If the run or the recording fails.
pub fn record(assembly: &Assembly<'_>, name: &str) -> (Report, Vec<u8>) {
    let path = std::env::temp_dir().join(format!("twinrig-{}-{name}.mcap", std::process::id()));
    let execution = Execution {
        recording: Some(path.clone()),
        ..Execution::default()
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

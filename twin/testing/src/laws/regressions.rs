use std::any::Any;
use std::fmt::Debug;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use proptest::test_runner::{Config, FailurePersistence, PersistedSeed};

/// Number of cases of each law.
const CASES: u32 = 24;

/// Returns the configuration of a `proptest!` of laws: 24 cases, or `PROPTEST_CASES`, and failures
/// kept in the folder `regressions/` beside the source file of the test, from which they are
/// replayed first.
pub fn config() -> Config {
    let mut config = Config {
        failure_persistence: Some(Box::new(Regressions)),
        ..Config::default()
    };
    if std::env::var_os("PROPTEST_CASES").is_none() {
        config.cases = CASES;
    }
    config
}

/// Failures of the properties of a source file, in the file of its name in `regressions/` beside
/// it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Regressions;

/// Returns the file of the failures of a source file. Its path is relative to a folder above the
/// present one: that of the workspace.
fn file(source: Option<&'static str>) -> Option<PathBuf> {
    let source = Path::new(source?);
    let present = std::env::current_dir().ok()?;
    let source = present
        .ancestors()
        .map(|folder| folder.join(source))
        .find(|path| path.is_file())?;
    let name = Path::new(source.file_name()?).with_extension("txt");
    Some(source.with_file_name("regressions").join(name))
}

impl FailurePersistence for Regressions {
    fn load_persisted_failures2(&self, source: Option<&'static str>) -> Vec<PersistedSeed> {
        let text = file(source).and_then(|path| fs::read_to_string(path).ok());
        let text = text.unwrap_or_default();
        let seeds = text.lines().filter_map(|line| line.split('#').next());
        seeds.filter_map(|seed| seed.trim().parse().ok()).collect()
    }

    fn save_persisted_failure2(
        &mut self,
        source: Option<&'static str>,
        seed: PersistedSeed,
        shrunken: &dyn Debug,
    ) {
        let Some(path) = file(source) else {
            eprintln!("seed {seed}: no source file, so it is not kept");
            return;
        };
        let line = format!("{seed} # {shrunken:?}").replace(['\n', '\r'], " ");
        let folder = path.parent().map_or(Ok(()), fs::create_dir_all);
        let kept = folder.and_then(|()| {
            let mut file = OpenOptions::new().create(true).append(true).open(&path)?;
            writeln!(file, "{line}")
        });
        match kept {
            Ok(()) => eprintln!("seed {seed}: kept in {}, replayed first", path.display()),
            Err(error) => eprintln!("seed {seed}: not kept in {}: {error}", path.display()),
        }
    }

    fn box_clone(&self) -> Box<dyn FailurePersistence> {
        Box::new(*self)
    }

    fn eq(&self, other: &dyn FailurePersistence) -> bool {
        other.as_any().is::<Self>()
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

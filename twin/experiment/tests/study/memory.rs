//! Memory of campaigns of many runs, whose rows are on disk.

use twinrig_campaign::engine::{
    Engine, EngineError, EngineEvent, EngineOptions, EngineStatus, Job,
};
use twinrig_campaign::sweep::{
    ExpectationVerdict, Partition, RowExpectation, RowVerdict, SweepRow, SweepVerdict,
};
use twinrig_experiment::options::run::EngineArgs;
use twinrig_experiment::{SweepOutcome, SweepRequest, sweep};
use twinrig_rig::registry::Registry;
use twinrig_testing::folder::Folder;

const POINTS: usize = 100_000;
/// Greatest number of bytes in memory for a point. With one expectation, its values, key, place and
/// summary take some 370, and the plots of the page 170 for a while. A complete row takes 350 more.
const BYTES_OF_POINT: usize = 700;

const SCENARIO: &str = "duration = '1 s'\n[plant]\nmodel = 'bench'\nfile = 'tactile'\n";
const SPEC: &str = "[[dimension]]\nkey = 'seed'\nfrom = 1\nto = 100000\n\
    [[share]]\nof = 'verdict'\nmin = 0.5\n";

/// Has a result for every task without a run.
struct Stub;

impl Engine for Stub {
    fn name(&self) -> &'static str {
        "stub"
    }

    fn run(
        &self,
        _: &dyn Job,
        tasks: &[usize],
        _: &EngineOptions,
        observer: &mut dyn FnMut(EngineEvent) -> bool,
    ) -> Result<EngineStatus, EngineError> {
        // The same row for all, without a recording.
        let bytes = postcard::to_stdvec(&(row(), None::<()>)).unwrap();
        for &task in tasks {
            observer(EngineEvent::Done {
                task,
                result: Ok(bytes.clone()),
            });
        }
        Ok(EngineStatus::default())
    }
}

fn row() -> SweepRow {
    SweepRow {
        verdict: RowVerdict::Pass,
        error: None,
        seed: Some(1),
        simulated_s: Some(1.0),
        fell_at_s: None,
        fingerprint: Some("0".repeat(64)),
        expectations: vec![RowExpectation {
            name: "loads are known".to_owned(),
            verdict: ExpectationVerdict::Pass,
            holds: true,
            measured: Some(0.5),
            bound: Some(0.75),
            margin: Some(0.25),
            unit: "N".to_owned(),
            detail: "at 0.5 s".to_owned(),
        }],
    }
}

/// Returns the outcome of a part of a sweep, and the most bytes that it needs for each point.
fn measured(folder: &Folder, part: usize) -> (SweepOutcome, usize) {
    let request = SweepRequest {
        scenario: folder.file("scenario.toml", SCENARIO).into(),
        spec: folder.file("spec.toml", SPEC).into(),
        settings: Vec::new(),
        engine: EngineArgs {
            engine: Stub.name().to_owned(),
            ..EngineArgs::default()
        },
        partition: Partition { part, of: 2 },
        out: folder.path().to_owned(),
        record: None,
    };
    let registry = Registry::standard().with_engine(Stub);
    let mut outcome = None;
    let memory = allocation_counter::measure(|| {
        outcome = Some(sweep(&registry, &request, &mut |_| {}).unwrap());
    });
    let bytes = usize::try_from(memory.bytes_max).unwrap();
    (outcome.unwrap(), bytes / POINTS)
}

/// One half of the rows is of this call, the other one is read from the disk.
#[test]
fn sweep_keeps_a_bounded_number_of_bytes_for_each_point() {
    let folder = Folder::new("memory-sweep");
    let (half, bytes_of_half) = measured(&folder, 1);
    assert_eq!(half.progress.ran, POINTS / 2);
    assert_eq!(half.result.counts.missing, POINTS / 2);
    let (outcome, bytes) = measured(&folder, 2);
    assert_eq!(outcome.progress.ran, POINTS / 2);
    assert_eq!(outcome.result.verdict, SweepVerdict::Pass);
    let table = std::fs::read_to_string(folder.path().join("rows.csv")).unwrap();
    assert!(
        table
            .lines()
            .next_back()
            .unwrap()
            .starts_with("99999,100000,")
    );
    assert!(bytes_of_half < BYTES_OF_POINT, "{bytes_of_half}");
    assert!(bytes < BYTES_OF_POINT, "{bytes}");
}

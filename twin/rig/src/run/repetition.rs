//! Repetition of a run in memory, with more detail than its recording: every computed signal, all
//! bytes, finer frames, and what the expectations and the energy balance were on the way.

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_record::{RecordError, Recording};
use twinrig_runtime::EnergyBalance;
use twinrig_scenario::{Outcome, RunEnd};

use crate::assembly::Assembly;
use crate::error::Error;
use crate::report::Report;
use crate::run::course::{Course, Stopped, run};
use crate::run::execution::Execution;
use crate::run::judging::{closed, observers, reference};
use crate::run::observers::{PolledOnly, RunObserver, RunProgress};
use crate::run::recording::{Contents, recorder_of};
use crate::run::stopwatch::Stopwatch;

/// Detail of a repetition.
#[derive(Clone, Copy, Debug)]
pub struct Detail {
    /// Time between two sets of coordinate frames; none without `[record] frames`.
    pub frames: SimDuration,
    /// Number of instants at which expectations and energy balance are evaluated.
    pub instants: u64,
}

/// A repeated run.
pub struct Repetition {
    /// All computed signals and all bytes.
    pub recording: Recording,
    /// Report, without the path of a recording.
    pub report: Report,
    /// Evaluations on the way, by time.
    pub course: Vec<Evaluation>,
}

/// Expectations and energy balance at an instant of a run.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// Instant.
    pub at: SimTime,
    /// Outcomes of the expectations as if the scenario ended here.
    pub outcomes: Vec<Outcome>,
    /// Energy balance since the start of the run.
    pub energy: EnergyBalance,
}

/// Repeats the run of `assembly` up to `end` at most; `caller` is polled.
///
/// # Errors
/// The run cannot start. One that starts and fails is in the report.
pub fn repeat(
    assembly: &Assembly<'_>,
    detail: Detail,
    end: SimTime,
    mut caller: Option<&mut dyn RunObserver>,
) -> Result<Repetition, Error> {
    let end = end.min(assembly.end());
    let polled = caller.as_mut().map(|caller| PolledOnly(&mut **caller));
    let reference = reference(assembly, end, polled)?;
    let mut rig = assembly.rig()?;
    let contents = Contents {
        keep: &|_| true,
        bytes: true,
        frames: assembly.frame_period().map(|_| detail.frames),
    };
    let unreadable = |source: RecordError| Error::Record {
        path: assembly.scenario().file.clone().into(),
        source,
    };
    let recorder = recorder_of(assembly, &rig, contents, Vec::new()).map_err(unreadable)?;
    let mut observers = observers(assembly, &rig, reference, Some(recorder), caller);
    let progress = RunProgress {
        title: &assembly.scenario().name,
        now: SimTime::ZERO,
        end,
    };
    let stopwatch = Stopwatch::start();
    let mut course = Vec::new();
    let mut ran = Ok(SimTime::ZERO);
    for instant in 1..=detail.instants.max(1) {
        let at = share(end, instant, detail.instants.max(1));
        ran = run(assembly, &mut rig, &mut observers, &progress, at);
        let reached = match &ran {
            // The devices may open later.
            Err(Stopped::NotOpen(_)) if at < end => continue,
            Err(_) => break,
            Ok(reached) => *reached,
        };
        let (energy, buses) = (rig.plant().energy(), rig.buses());
        let outcomes = observers.judged_now(&RunEnd {
            at: reached,
            energy: Some(energy),
            work: Some(rig.plant().work()),
            real_time_factor: None,
            buses: &buses,
        });
        course.push(Evaluation {
            at: reached,
            outcomes,
            energy,
        });
        // A fall, or the plant, may have ended the run.
        if reached < at {
            break;
        }
    }
    let wall_s = stopwatch.elapsed_s();
    let ended = Course::of(&rig, wall_s, ran);
    let (report, bytes) = closed(assembly, &Execution::default(), observers, ended);
    let bytes = bytes.map_err(unreadable)?.unwrap_or_default();
    Ok(Repetition {
        recording: Recording::from_bytes(bytes).map_err(unreadable)?,
        report,
        course,
    })
}

/// Returns `part` of `parts` equal parts of the time from the start to `end`.
fn share(end: SimTime, part: u64, parts: u64) -> SimTime {
    let nanos = u128::from(end.as_nanos()) * u128::from(part) / u128::from(parts);
    // Not greater than the end.
    SimTime::from_nanos(u64::try_from(nanos).unwrap_or(end.as_nanos()))
}

#[cfg(test)]
mod tests {
    use twinrig_scenario::Verdict;

    use super::*;
    use crate::registry::Registry;
    use crate::run::recorded::assembly_of;

    const SCENARIO: &str = "
        robot = 'cheetah-cub'
        duration = '800 ms'
        plant = { model = 'massless', ground = {} }
        controller = { kind = 'stand', period = '2 ms' }
        record = { signals = ['body/position'], frames = '50 Hz' }
        [[expect]]
        name = 'height'
        signal = { name = 'body/position', component = 'z', always = { min = '1 m' } }
        [[expect]]
        name = 'count'
        footstep = { count = { max = 1 } }
        [[expect]]
        name = 'energy'
        energy = { residual = { max = 1e-3 } }
    ";

    fn assembly<'r>(registry: &'r Registry, text: &str) -> Assembly<'r> {
        let builder = Assembly::builder(registry);
        builder.text("stand.toml", text, "".as_ref()).unwrap()
    }

    fn repetition(assembly: &Assembly<'_>, end: SimTime) -> Repetition {
        let detail = Detail {
            frames: SimDuration::from_millis(4),
            instants: 8,
        };
        repeat(assembly, detail, end, None).unwrap()
    }

    #[test]
    fn repetition_has_the_fingerprint_and_more_detail() {
        let registry = Registry::standard();
        let assembly = assembly(&registry, SCENARIO);
        let report = crate::execute_observed(&assembly, &Execution::default(), &mut ()).unwrap();
        let repeated = repetition(&assembly, SimTime::MAX);
        let recording = &repeated.recording;
        assert_eq!(recording.fingerprint(), report.fingerprint.as_deref());
        assert_eq!(repeated.report.fingerprint, report.fingerprint);
        assert!(recording.series("leg/LF/foot/load").is_ok());
        let frames = recording.frames().unwrap().times;
        assert_eq!(frames[1] - frames[0], SimDuration::from_millis(4));
        // It repeats itself from its own attachments, too.
        let again = assembly_of(&registry, recording).unwrap();
        let again = repetition(&again, SimTime::MAX);
        assert_eq!(again.recording.fingerprint(), recording.fingerprint());
    }

    #[test]
    fn evaluation_is_that_of_a_scenario_that_ends_there() {
        let registry = Registry::standard();
        let whole = repetition(&assembly(&registry, SCENARIO), SimTime::MAX);
        assert_eq!(whole.course.len(), 8);
        let of_report = whole.report.expectations.iter().map(|line| &line.outcome);
        assert!(of_report.eq(&whole.course[7].outcomes));
        for (evaluation, end) in [(&whole.course[1], "200 ms"), (&whole.course[4], "500 ms")] {
            let shorter = SCENARIO.replace("800 ms", end);
            let short = repetition(&assembly(&registry, &shorter), SimTime::MAX);
            assert_eq!(short.report.expectations.len(), evaluation.outcomes.len());
            for (line, outcome) in short.report.expectations.iter().zip(&evaluation.outcomes) {
                assert_ne!(
                    line.outcome.verdict,
                    Verdict::Unobserved,
                    "{}",
                    outcome.name
                );
                assert_eq!(line.outcome.measured, outcome.measured, "{}", outcome.name);
                assert_eq!(line.outcome.verdict, outcome.verdict, "{}", outcome.name);
            }
            let balance = short.report.energy.unwrap();
            assert_eq!(balance.exchanged_j, evaluation.energy.exchanged);
        }
        let exchanged = whole.course.iter().map(|it| it.energy.exchanged);
        assert!(exchanged.is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn repetition_of_a_recording_that_was_interrupted_ends_where_it_does() {
        let registry = Registry::standard();
        let end = SimTime::from_nanos(300_000_000);
        let repeated = repetition(&assembly(&registry, SCENARIO), end);
        assert_eq!(repeated.recording.reached(), Some(end));
        assert_eq!(repeated.course.len(), 8);
        assert_eq!(repeated.course[7].at, end);
    }
}

//! The real-time scheduler under a manual clock, compared with the lockstep rig.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use proptest::prelude::*;
use twinrig_kernel::{HostTime, Port, SimDuration, SimTime, Unit};

use super::clock::Clock;
use super::scheduler::{RealTimeScheduler, Report, ReportKind, TaskInterface, Tasks};
use super::steering::{Steering, steering};
use crate::{
    Change, Group, IoTask, Observer, Part, Plant, PlantAccess, PlantFault, Process,
    ProcessVariable, Progress, Rig, RunEvent, Schedule, TaskError, TimeSource, Timing,
};

/// Manual clock: sleeping sets it.
#[derive(Clone, Default)]
struct ManualClock(Arc<AtomicU64>);

impl Clock for ManualClock {
    fn now(&self) -> HostTime {
        HostTime::from_nanos(self.0.load(Ordering::Relaxed))
    }
    fn sleep_until(&self, at: HostTime) {
        self.0.fetch_max(at.as_nanos(), Ordering::Relaxed);
    }
}

/// Process that advances the clock by its compute time, if it has one.
struct TimedProcess {
    tasks: usize,
    offset: [ProcessVariable; 1],
    compute: Option<(TimeSource, ManualClock)>,
}

fn ports(task: usize) -> [Port; 2] {
    [
        Port::input(format!("{task}/command"), Unit::Volt, 1),
        Port::output(format!("{task}/sample"), Unit::Radian, 2),
    ]
}

impl TimedProcess {
    fn new(tasks: usize, compute: Option<(TimeSource, ManualClock)>) -> Box<Self> {
        Box::new(Self {
            tasks,
            offset: [ProcessVariable::new("offset", Unit::Volt, .., 0.0)],
            compute,
        })
    }
}

impl Process for TimedProcess {
    fn name(&self) -> &'static str {
        "timed process"
    }
    fn ports(&self) -> Vec<Port> {
        let ports = (0..self.tasks).flat_map(ports);
        ports.map(|port| port.mirrored()).collect()
    }
    fn variables(&self) -> &[ProcessVariable] {
        &self.offset
    }
    fn variables_mut(&mut self) -> &mut [ProcessVariable] {
        &mut self.offset
    }
    fn step(&mut self, elapsed: SimDuration, inputs: &[f64], outputs: &mut [f64]) {
        for (output, sample) in outputs.iter_mut().zip(inputs.chunks_exact(2)) {
            *output += elapsed.as_secs_f64() + sample[0] - 0.1 * sample[1] + self.offset[0].value();
        }
        if let Some((compute, clock)) = &mut self.compute {
            clock
                .0
                .fetch_add(compute.draw().as_nanos(), Ordering::Relaxed);
        }
    }
}

/// Task with a cyclic list of transfer times; its results are the number of the transfer and the
/// command.
struct FixedTask {
    name: String,
    number: usize,
    lengths: Vec<SimDuration>,
    ends: Option<SimTime>,
    results: [f64; 2],
}

impl FixedTask {
    fn new(number: usize, lengths: &[SimDuration]) -> Self {
        Self {
            name: number.to_string(),
            number,
            lengths: lengths.to_vec(),
            ends: None,
            results: [0.0; 2],
        }
    }

    fn start(&mut self, now: SimTime, command: f64) -> SimTime {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small count"
        )]
        let nth = self.results[0] as usize;
        self.results = [self.results[0] + 1.0, command];
        let ends = now + self.lengths[nth % self.lengths.len()];
        self.ends = Some(ends);
        ends
    }
}

impl Part for FixedTask {}

impl IoTask for FixedTask {
    fn name(&self) -> &str {
        &self.name
    }

    fn ports(&self) -> Vec<Port> {
        ports(self.number).into()
    }

    fn begin(
        &mut self,
        now: SimTime,
        from_process: &[f64],
        _: &mut dyn PlantAccess,
    ) -> Result<Progress, TaskError> {
        Ok(Progress::WakeAt(self.start(now, from_process[0])))
    }

    fn wake(&mut self, _: SimTime, _: &mut dyn PlantAccess) -> Result<Progress, TaskError> {
        Ok(Progress::Done)
    }

    fn to_process(&self) -> &[f64] {
        &self.results
    }
}

/// The same transfers for the real-time scheduler.
struct FixedTasks(Vec<FixedTask>);

impl Tasks for FixedTasks {
    fn next_report(&mut self, limit: HostTime) -> Option<Report<'_>> {
        let due = self
            .0
            .iter_mut()
            .filter_map(|task| Some((task.ends?, task)));
        let (ends, task) = due.min_by_key(|(ends, _)| *ends)?;
        let at = HostTime::from_nanos(ends.as_nanos());
        if at > limit {
            return None;
        }
        task.ends = None;
        Some(Report {
            task: task.number,
            at,
            kind: ReportKind::Ended,
        })
    }
    fn results(&mut self, task: usize) -> (&[f64], &[f64]) {
        (&self.0[task].results, &[])
    }
    fn begin(&mut self, task: usize, now: HostTime, from_process: &[f64]) {
        self.0[task].start(SimTime::from_nanos(now.as_nanos()), from_process[0]);
    }
}

/// Plant without state and ports.
pub(super) struct EmptyPlant;

impl Plant for EmptyPlant {
    fn name(&self) -> &'static str {
        "empty"
    }
    fn ports(&self) -> Vec<Port> {
        Vec::new()
    }
    fn advance(&mut self, _: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        Ok(())
    }
    fn observe(&mut self, _: &mut [f64]) {}
}

#[derive(Clone, Debug, PartialEq)]
enum Record {
    Event(RunEvent),
    Samples(Group, Vec<u64>),
}

/// Events and samples of process and tasks, with their times.
#[derive(Default)]
struct Log(VecDeque<(SimTime, Record)>);

impl Log {
    /// Sorts transfers that end at one instant, whose order is arbitrary: the rig uses that of
    /// arming.
    fn sort_ties(&mut self) {
        let ended = |(_, record): &(SimTime, Record)| match record {
            Record::Event(RunEvent::TaskEnd { task }) => Some(*task),
            _ => None,
        };
        self.0
            .make_contiguous()
            .chunk_by_mut(|a, b| a.0 == b.0 && ended(a).is_some() && ended(b).is_some())
            .for_each(|ties| ties.sort_by_key(ended));
    }
}

impl Observer for Log {
    fn samples(&mut self, now: SimTime, group: Group, values: &[f64]) {
        if group != Group::Plant {
            let bits = values.iter().map(|value| value.to_bits()).collect();
            self.0.push_back((now, Record::Samples(group, bits)));
        }
    }
    fn event(&mut self, now: SimTime, event: RunEvent) {
        self.0.push_back((now, Record::Event(event)));
    }
}

#[derive(Clone, Debug)]
struct Case {
    schedule: Schedule,
    lengths: Vec<Vec<SimDuration>>,
    changes: Vec<(SimTime, Change)>,
    end: SimTime,
}

fn run_lockstep(case: &Case) -> Log {
    let tasks = case.lengths.iter().enumerate();
    let tasks = tasks.map(|(n, lengths)| Box::new(FixedTask::new(n, lengths)) as Box<dyn IoTask>);
    let process = TimedProcess::new(case.lengths.len(), None);
    let mut rig = Rig::new(
        &case.schedule,
        process,
        tasks.collect(),
        Box::new(EmptyPlant),
    )
    .unwrap();
    for (at, change) in &case.changes {
        rig.schedule(*at, "offset", *change).unwrap();
    }
    let mut log = Log::default();
    rig.run_until(case.end, &mut log).unwrap();
    log
}

fn run_real_time(case: &Case, clock: &ManualClock) -> (RealTimeScheduler, Log) {
    run_steered(case, clock, |_, _| ())
}

/// Calls `steer` before each control step.
fn run_steered(
    case: &Case,
    clock: &ManualClock,
    mut steer: impl FnMut(u64, &mut Steering),
) -> (RealTimeScheduler, Log) {
    let compute = case.schedule.compute.clone();
    let compute = compute
        .source(case.schedule.seed, "process/compute")
        .unwrap();
    let process = TimedProcess::new(case.lengths.len(), Some((compute, clock.clone())));
    let interfaces = (0..case.lengths.len()).map(|n| TaskInterface {
        name: n.to_string(),
        ports: ports(n).into(),
        diagnostics: Vec::new(),
        period: None,
    });
    let mut scheduler =
        RealTimeScheduler::new(&case.schedule, process, interfaces.collect()).unwrap();
    for (at, change) in &case.changes {
        let slot = &mut scheduler.slot;
        slot.schedule(
            SimTime::ZERO,
            *at,
            "offset",
            *change,
            SimDuration::from_millis(1),
        )
        .unwrap();
    }
    let fixed = case.lengths.iter().enumerate();
    let mut fixed_tasks = FixedTasks(
        fixed
            .map(|(n, lengths)| FixedTask::new(n, lengths))
            .collect(),
    );
    let mut log = Log::default();
    let (mut sender, steered) = steering(scheduler.slot.process.variables().len());
    scheduler.steered = Some(steered);
    scheduler.begin_at(HostTime::default());
    let mut step = 0;
    while scheduler.due(step).0 <= case.end {
        clock.sleep_until(scheduler.due(step).1);
        steer(step, &mut sender);
        step = scheduler
            .control_step(step, clock, &mut fixed_tasks, &mut log)
            .unwrap();
    }
    let end = HostTime::from_nanos(case.end.as_nanos());
    scheduler
        .handle_reports(end, &mut fixed_tasks, &mut log)
        .unwrap();
    log.0.retain(|(at, _)| *at <= case.end);
    (scheduler, log)
}

fn micros(range: std::ops::RangeInclusive<u64>) -> impl Strategy<Value = SimDuration> {
    range.prop_map(SimDuration::from_micros)
}

/// Processes with and without overruns, tasks that take part and that are skipped, simultaneous
/// events.
fn any_case() -> impl Strategy<Value = Case> {
    let compute = prop::collection::vec(micros(0..=900), 1..6).prop_map(Timing::Trace);
    let lengths = prop::collection::vec(prop::collection::vec(micros(1..=900), 1..5), 0..=4);
    let change = (0_u64..20_000, -1.0..1.0_f64, any::<bool>()).prop_map(|(at, value, to)| {
        let change = if to {
            Change::To(value)
        } else {
            Change::By(value)
        };
        (SimTime::ZERO + SimDuration::from_micros(at), change)
    });
    let changes = prop::collection::vec(change, 0..4);
    (micros(100..=300), compute, lengths, changes).prop_map(
        |(period, compute, lengths, changes)| Case {
            schedule: Schedule {
                compute,
                ..Schedule::with_period(period)
            },
            lengths,
            changes,
            end: SimTime::ZERO + SimDuration::from_millis(20),
        },
    )
}

proptest! {
    #[test]
    fn real_time_scheduler_equals_the_lockstep_rig(case in any_case()) {
        let (scheduler, mut real) = run_real_time(&case, &ManualClock::default());
        let mut model = run_lockstep(&case);
        real.sort_ties();
        model.sort_ties();
        for (n, (real, model)) in real.0.iter().zip(&model.0).enumerate() {
            prop_assert_eq!(real, model, "number {}", n);
        }
        prop_assert_eq!(real.0.len(), model.0.len());
        prop_assert_eq!(scheduler.report.overslept, 0);
    }
}

fn regular() -> Case {
    Case {
        schedule: Schedule::with_period(SimDuration::from_micros(100)),
        lengths: vec![vec![SimDuration::from_micros(20)]],
        changes: Vec::new(),
        end: SimTime::ZERO + SimDuration::from_millis(1),
    }
}

/// Changes that are sent while the run goes on are those of a lockstep rig at the next control
/// step; a value that the process refuses is none, and does not end the run.
#[test]
fn sent_changes_are_those_of_the_next_control_step() {
    let mut case = regular();
    let (_, mut real) = run_steered(&case, &ManualClock::default(), |step, steering| {
        let values: &[f64] = match step {
            3 => &[0.5],
            7 => &[f64::NAN, -1.0, 1.5],
            _ => &[],
        };
        assert!(values.iter().all(|value| steering.set(0, *value, None)));
        assert!(
            step != 8 || steering.set(1, 0.0, None),
            "there is no such variable"
        );
    });
    let change = |at, value| {
        let at = SimTime::ZERO + SimDuration::from_micros(at);
        (at, Change::To(value))
    };
    case.changes = vec![change(300, 0.5), change(700, -1.0), change(700, 1.5)];
    let mut model = run_lockstep(&case);
    real.sort_ties();
    model.sort_ties();
    assert_eq!(real.0, model.0);
}

/// A change with a limited rate is one step at each control step, up to its value or to a later
/// change of the variable.
#[test]
fn slewed_changes_are_steps_of_the_control_steps() {
    let case = regular();
    let (_, real) = run_steered(&case, &ManualClock::default(), |step, steering| {
        let sent = match step {
            // 0.1 in each period of 0.1 ms.
            1 => steering.set(0, 0.25, Some(1000.0)),
            6 => steering.set(0, -1.0, Some(1000.0)),
            8 => steering.set(0, 1.0, None),
            _ => true,
        };
        assert!(sent);
    });
    let changes = real.0.iter().filter_map(|(at, record)| match record {
        Record::Event(RunEvent::Change { value, .. }) => Some((at.as_nanos() / 100_000, *value)),
        _ => None,
    });
    let expected = [
        (1, 0.1),
        (2, 0.2),
        (3, 0.25),
        (6, 0.15),
        (7, 0.05),
        (8, 1.0),
    ];
    let changes: Vec<(u64, f64)> = changes.collect();
    assert_eq!(changes.len(), expected.len(), "{changes:?}");
    for (found, expected) in changes.iter().zip(expected) {
        let error = (found.1 - expected.1).abs();
        // Sums of tenths, rounded.
        assert!(found.0 == expected.0 && error < 1e-12, "{changes:?}");
    }
}

#[test]
fn changes_that_nobody_takes_are_refused_when_there_is_no_room() {
    let (mut sender, _steered) = steering(1);
    let sent = (0..1000).take_while(|_| sender.set(0, 1.0, None)).count();
    assert!((100..1000).contains(&sent));
    assert!(!sender.set(0, 2.0, None));
}

#[test]
fn late_wake_up_misses_steps_and_lengthens_the_elapsed_time() {
    let case = regular();
    let clock = ManualClock::default();
    let process = TimedProcess::new(0, None);
    let mut scheduler = RealTimeScheduler::new(&case.schedule, process, Vec::new()).unwrap();
    scheduler.begin_at(HostTime::default());
    let (mut fixed_tasks, mut log) = (FixedTasks(Vec::new()), Log::default());
    let mut step = 0;
    for woken_ns in [0, 100_000, 450_000, 500_000] {
        clock.sleep_until(HostTime::from_nanos(woken_ns));
        step = scheduler
            .control_step(step, &clock, &mut fixed_tasks, &mut log)
            .unwrap();
    }
    let events = log.0.iter().filter_map(|(at, record)| match record {
        Record::Event(RunEvent::ProcessBegin { elapsed }) => {
            Some((at.as_nanos() / 1000, elapsed.as_nanos() / 1000))
        }
        Record::Event(RunEvent::Overrun { missed }) => {
            Some((at.as_nanos() / 1000, 1_000_000 + missed))
        }
        _ => None,
    });
    let events: Vec<_> = events.collect();
    let expected = [
        (0, 0),
        (100, 100),
        (200, 1_000_001),
        (300, 1_000_002),
        (450, 300),
        (500, 100),
    ];
    assert_eq!(events, expected);
    let report = &scheduler.report;
    assert_eq!(
        (report.iterations, report.overslept, report.overruns),
        (4, 2, 0)
    );
    // From 100 to 450 µs, with a period of 100 µs.
    assert_eq!(report.jitter.longest().as_micros(), 250);
    assert_eq!(report.jitter.mean().as_micros(), (250 + 50) / 3);
    assert_eq!(report.lateness.longest().as_micros(), 250);
}

#[test]
fn failed_transfer_ends_the_run_with_task_and_time() {
    struct Failing;
    impl Tasks for Failing {
        fn next_report(&mut self, limit: HostTime) -> Option<Report<'_>> {
            let why = "no answer".to_string();
            Some(Report {
                task: 0,
                at: limit,
                kind: ReportKind::Failed(TaskError::Device { why }),
            })
        }
        fn results(&mut self, _: usize) -> (&[f64], &[f64]) {
            (&[0.0; 2], &[])
        }
        fn begin(&mut self, _: usize, _: HostTime, _: &[f64]) {}
    }
    let interface = TaskInterface {
        name: "0".into(),
        ports: ports(0).into(),
        diagnostics: Vec::new(),
        period: None,
    };
    let mut scheduler = RealTimeScheduler::new(
        &regular().schedule,
        TimedProcess::new(1, None),
        vec![interface],
    )
    .unwrap();
    scheduler.begin_at(HostTime::from_nanos(7));
    let clock = ManualClock::default();
    clock.sleep_until(HostTime::from_nanos(7));
    let error = scheduler
        .control_step(0, &clock, &mut Failing, &mut ())
        .unwrap_err();
    assert_eq!(error.to_string(), "0 failed at 0 ns: no answer");
}

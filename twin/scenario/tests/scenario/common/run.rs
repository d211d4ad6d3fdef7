//! Synthetic runs for the judge: trunk trajectories and periodic foot loads.

use twinrig_kernel::{Direction, Layout, Port, SimDuration, SimTime};
use twinrig_runtime::{EnergyBalance, Group, Observer, RunEvent, WorkCounts};
use twinrig_scenario::{Footstep, Judge, Layouts, Outcome, Reference, RunEnd, Scene};

/// Observation period.
pub const PERIOD_MS: u64 = 2;

/// A function of leg and time.
pub type OfLeg<'r> = &'r dyn Fn(&str, u64) -> f64;

/// A run of 10 s, as functions of time in milliseconds.
pub struct Run<'r> {
    pub body: &'r dyn Fn(u64) -> [f64; 3],
    pub rpy: &'r dyn Fn(u64) -> [f64; 3],
    /// Load of a leg's foot [N].
    pub load: &'r dyn Fn(&str, u64) -> f64,
    /// World position of a leg's foot [m].
    pub foot: &'r dyn Fn(&str, u64) -> [f64; 3],
    /// Tension of a leg's cable [N].
    pub tension: &'r dyn Fn(&str, u64) -> f64,
    /// Angle [rad] and torque [N·m] of every drive.
    pub drive: &'r dyn Fn(u64) -> [f64; 2],
    /// Phase of a leg in the outputs of the controller [rad], for the time after it.
    pub phase: Option<OfLeg<'r>>,
    pub end_ms: u64,
}

impl Default for Run<'_> {
    fn default() -> Self {
        Run {
            body: &|_| [0.0, 0.0, 0.12],
            rpy: &|_| [0.0; 3],
            load: &trot_load,
            foot: &|_, _| [0.0; 3],
            tension: &|_, _| 1.0,
            drive: &|_| [0.0; 2],
            phase: None,
            end_ms: 10_000,
        }
    }
}

/// Cycle of the synthetic trot.
pub const CYCLE_MS: u64 = 300;
/// Stance of the synthetic trot.
pub const STANCE_MS: u64 = 160;

/// Load of a foot in a trot: diagonal legs in phase, the others half a cycle later.
pub fn trot_load(leg: &str, ms: u64) -> f64 {
    let late = if matches!(leg, "LF" | "RH") {
        0
    } else {
        CYCLE_MS / 2
    };
    let phase = (ms + CYCLE_MS - late) % CYCLE_MS;
    if phase < STANCE_MS { 5.4 } else { 0.0 }
}

pub fn at(ms: u64) -> SimTime {
    SimTime::ZERO + SimDuration::from_millis(ms)
}

/// Judges `run` and returns outcomes and footsteps.
pub fn judge_with(
    scene: &Scene,
    run: &Run<'_>,
    reference: Option<&Reference>,
) -> (Vec<Outcome>, Vec<Footstep>) {
    let judged = judge_run(scene, run, reference);
    (judged.outcomes, judged.footsteps)
}

/// Judge and results of a completed run.
pub struct JudgedRun {
    pub judge: Judge,
    pub outcomes: Vec<Outcome>,
    pub footsteps: Vec<Footstep>,
}

/// Judges `run` to its end, or to the fall that ends it.
pub fn judge_run(scene: &Scene, run: &Run<'_>, reference: Option<&Reference>) -> JudgedRun {
    let ports: Vec<Port> = super::facts(scene.legs.clone())
        .plant_outputs
        .into_iter()
        .filter(|port| scene.wanted.contains(&port.name))
        .collect();
    let layout = Layout::of(&ports, Direction::Output);
    let none = Layout::default();
    let phases: Vec<Port> = match run.phase {
        Some(_) => super::facts(scene.legs.clone()).process_ports,
        None => Vec::new(),
    };
    let process_outputs = Layout::of(&phases, Direction::Output);
    let mut commands = vec![0.0; process_outputs.len()];
    let mut judge = Judge::new(
        scene,
        Layouts {
            plant: &layout,
            process_inputs: &none,
            process_outputs: &process_outputs,
            diagnostics: &none,
            tasks: &[],
        },
    );
    if let Some(reference) = reference {
        judge = judge.with_reference(reference);
    }
    let mut footsteps = Vec::new();
    let mut end_ms = run.end_ms;
    let mut values = vec![0.0; layout.len()];
    for ms in (0..=run.end_ms).step_by(usize::try_from(PERIOD_MS).unwrap()) {
        for field in layout.fields() {
            let name = &field.port.name;
            let slot = &mut values[field.range()];
            let leg = name.split('/').nth(1).unwrap();
            match name.as_str() {
                "body/position" => slot.copy_from_slice(&(run.body)(ms)),
                "body/rpy" => slot.copy_from_slice(&(run.rpy)(ms)),
                _ if name.ends_with("load") => slot[0] = (run.load)(leg, ms),
                _ if name.ends_with("hip/position") || name.ends_with("knee/position") => {
                    slot[0] = (run.drive)(ms)[0];
                }
                _ if name.ends_with("torque") => slot[0] = (run.drive)(ms)[1],
                _ if name.ends_with("tension") => slot[0] = (run.tension)(leg, ms),
                _ => slot.copy_from_slice(&(run.foot)(leg, ms)),
            }
        }
        if let Some(phase) = run.phase {
            for field in process_outputs.fields() {
                let leg = field.port.name.split('/').nth(1).unwrap();
                commands[field.range()][0] = phase(leg, ms);
            }
            judge.samples(at(ms), Group::ProcessOutputs, &commands);
        }
        judge.samples(at(ms), Group::Plant, &values);
        footsteps.extend_from_slice(judge.closed());
        if judge.ended_at().is_some() {
            end_ms = ms;
            break;
        }
    }
    let end = RunEnd {
        at: at(end_ms),
        energy: Some(EnergyBalance {
            residual: 2e-7,
            exchanged: 1.0,
            ..EnergyBalance::default()
        }),
        work: Some(WorkCounts {
            steps: 10_000,
            evaluations: 40_000,
            ..WorkCounts::default()
        }),
        real_time_factor: Some(400.0),
        buses: &[],
    };
    let outcomes = judge.finish(&end);
    footsteps.extend_from_slice(judge.closed());
    footsteps.sort_by_key(|step| (step.touch_down, step.leg));
    JudgedRun {
        judge,
        outcomes,
        footsteps,
    }
}

/// Returns the outcome of the expectation `expect` (the inside of an `[[expect]]`) in `run`.
pub fn outcome(expect: &str, run: &Run<'_>) -> Outcome {
    let scene = super::scene(&super::text(&format!("[[expect]]\n{expect}")))
        .unwrap_or_else(|error| panic!("{error}"));
    judge_with(&scene, run, None).0.remove(0)
}

/// Events of the controller's cycle.
pub const BEGIN: RunEvent = RunEvent::ProcessBegin {
    elapsed: SimDuration::ZERO,
};
pub const END: RunEvent = RunEvent::ProcessEnd;
pub const MISSED: RunEvent = RunEvent::Overrun { missed: 1 };

/// Judges the events of a controller's cycle; the run ends with the last of them.
pub fn cycles(expect: &str, events: &[(u64, RunEvent)]) -> Outcome {
    cycles_until(
        expect,
        events,
        events.last().map_or(10_000_000, |(at, _)| *at),
    )
}

/// Judges the events of a controller's cycle in a run that ends at `end_us`.
pub fn cycles_until(expect: &str, events: &[(u64, RunEvent)], end_us: u64) -> Outcome {
    let text = super::text(&format!("[[expect]]\n{expect}"));
    let text = text.replace("\"10 s\"", &format!("\"{end_us} us\""));
    let scene = super::scene(&text).unwrap_or_else(|error| panic!("{error}"));
    let none = Layout::default();
    let mut judge = Judge::new(
        &scene,
        Layouts {
            plant: &none,
            process_inputs: &none,
            process_outputs: &none,
            diagnostics: &none,
            tasks: &[],
        },
    );
    for (micros, event) in events {
        let now = SimTime::ZERO + SimDuration::from_micros(*micros);
        judge.event(now, *event);
    }
    let end = RunEnd {
        at: scene.scenario.end(),
        energy: None,
        work: None,
        real_time_factor: None,
        buses: &[],
    };
    judge.finish(&end).remove(0)
}

//! How long a recording gets, said before it is begun.

use twinrig_document::{Problem, Warning};
use twinrig_kernel::{Port, SimDuration};
use twinrig_scenario::Scene;

/// Code of the warning. Programs rely on it.
pub(crate) const LARGE_RECORDING: &str = "large-recording";

/// From here on a recording is worth a word \[bytes\].
const LARGE: f64 = 1e11;
/// A value of a sample \[bytes\].
const VALUE: f64 = 8.0;
/// What comes before the values of each sample: the headers of the record and of its encoding \[bytes\].
const HEADERS: f64 = 35.0;

/// The warning, if a recording of the scene is large, whose plant has `outputs` and whose controller has `ports`. Frames, footsteps,
/// counters and bytes of buses come on top of it.
pub(crate) fn warning(scene: &Scene, outputs: &[Port], ports: &[Port]) -> Option<Warning> {
    let scenario = &scene.scenario;
    let duration = scenario.duration.as_secs_f64();
    let controller = scenario.controller.as_ref();
    let period = controller.map_or(scenario.io.step, |controller| controller.period);
    let samples = |period: SimDuration, ports: &[Port]| {
        let kept = ports
            .iter()
            .filter(|port| scene.recorded.contains(&port.name));
        let values: usize = kept.map(|port| port.size).sum();
        if values == 0 {
            return 0.0;
        }
        duration / period.as_secs_f64() * (VALUE * values as f64 + HEADERS)
    };
    let bytes = samples(scenario.observe.period, outputs) + samples(period, ports);
    (bytes >= LARGE).then(|| Warning {
        code: LARGE_RECORDING,
        problem: Problem::of_file(
            &scenario.file,
            format!("a recording of this run has at least {} GB", (bytes / 1e9).round()),
            "record fewer signals ([record] signals), observe less often ([observe] period), or run with --no-record",
        ),
    })
}

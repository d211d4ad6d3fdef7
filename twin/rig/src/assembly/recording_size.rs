//! Estimated size of a recording and the warning about large recordings.

use twinrig_document::{Problem, Warning};
use twinrig_kernel::{Port, SimDuration};
use twinrig_scenario::Scene;

/// Code of the warning; part of the JSON interface.
pub const LARGE_RECORDING: &str = "large-recording";

/// Size from which on the warning is given \[bytes\].
const LARGE: f64 = 1e11;
/// Size of one value of a sample \[bytes\].
const VALUE: f64 = 8.0;
/// Size of the headers of a sample, of the record and of its encoding \[bytes\].
const HEADERS: f64 = 35.0;

/// Returns the warning if the recording of the scene is large; `outputs` are those of the plant,
/// `ports` those of the controller. The estimate is a lower bound, without frames, footsteps,
/// counters and bus traffic.
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

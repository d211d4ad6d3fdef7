//! Gait: footsteps, and the contacts of which they consist.

use serde::Serialize;
use twinrig_kernel::signal;
use twinrig_record::{FootstepMessage, RecordError};

use crate::run::Run;

/// Footsteps and contacts of a leg.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct LegGait {
    /// Name of the leg.
    pub(crate) leg: String,
    /// Footsteps, in order of time.
    pub(crate) footsteps: Vec<Footstep>,
    /// Beginning and end of each contact \[s\]; a footstep with several of them bounced.
    contacts: Vec<[f64; 2]>,
}

/// A footstep.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Footstep {
    /// Touch-down \[s\].
    pub(crate) from: f64,
    /// Lift-off \[s\].
    pub(crate) to: f64,
    pub(crate) slip_m: Option<f64>,
    pub(crate) impulse_ns: Option<f64>,
    pub(crate) peak_n: Option<f64>,
    /// Contacts of which it consists.
    pub(crate) contacts: usize,
}

/// Returns the gait of the legs with these names, and of others with footsteps.
pub(crate) fn gait<'n>(
    run: &Run<'_>,
    legs: impl Iterator<Item = &'n str>,
) -> Result<Vec<LegGait>, RecordError> {
    let recording = run.shown();
    let lift_off = run.assembly().map_or(0.0, |assembly| {
        let footsteps = assembly.scenario().observe.footsteps;
        footsteps.lift_off.newton(assembly.scene().weight)
    });
    let mut gait: Vec<LegGait> = Vec::new();
    for leg in legs {
        let load = recording.series(&signal::of_leg(leg, signal::FOOT_LOAD));
        let contacts = load.map_or_else(
            |_| Vec::new(),
            |load| {
                let times = load.times.iter().map(|at| at.as_secs_f64());
                contacts(times.zip(load.values.iter().copied()), lift_off)
            },
        );
        gait.push(LegGait {
            leg: leg.to_owned(),
            footsteps: Vec::new(),
            contacts,
        });
    }
    let finite = |value: f64| value.is_finite().then_some(value);
    for (_, message) in recording.messages::<FootstepMessage>()? {
        let index = gait.iter().position(|of| of.leg == message.leg);
        let index = index.unwrap_or_else(|| {
            gait.push(LegGait {
                leg: message.leg.clone(),
                footsteps: Vec::new(),
                contacts: Vec::new(),
            });
            gait.len() - 1
        });
        let of = &mut gait[index];
        let [from, to] = [message.touch_down_s, message.lift_off_s];
        let within = |contact: &&[f64; 2]| contact[0] < to && contact[1] > from;
        of.footsteps.push(Footstep {
            from,
            to,
            slip_m: finite(message.slip_m),
            impulse_ns: finite(message.impulse_ns),
            peak_n: finite(message.peak_load_n),
            contacts: of.contacts.iter().filter(within).count(),
        });
    }
    for of in &mut gait {
        of.footsteps.sort_by(|a, b| a.from.total_cmp(&b.from));
    }
    Ok(gait)
}

/// Returns the intervals in which the load is above `threshold`.
fn contacts(samples: impl Iterator<Item = (f64, f64)>, threshold: f64) -> Vec<[f64; 2]> {
    let mut contacts: Vec<[f64; 2]> = Vec::new();
    let mut is_open = false;
    for (at, load) in samples {
        let loaded = load > threshold;
        match contacts.last_mut() {
            Some(last) if is_open => last[1] = at,
            _ if loaded => contacts.push([at, at]),
            _ => {}
        }
        is_open = loaded;
    }
    contacts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contacts_are_intervals_above_the_threshold() {
        let loads = [0.0, 2.0, 3.0, 1.0, 0.5, 2.0, 0.0, 0.0, 4.0];
        let samples = loads.into_iter().enumerate();
        let samples = samples.map(|(n, load)| (n as f64, load));
        assert_eq!(contacts(samples, 1.0), [[1.0, 3.0], [5.0, 6.0], [8.0, 8.0]]);
    }
}

//! Two branches, footstep by footstep.

use std::path::Path;

use serde::Serialize;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_record::{RecordedFootstep, Recording, compare_events};
use twinrig_rig::Assembly;
use twinrig_rig::run::repetition::{Detail, repeat};

use crate::error::LiveError;
use crate::session::Session;

/// Footsteps of two branches from the instant on at which they part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Futures {
    /// Numbers of the branches.
    pub branches: [usize; 2],
    /// Instant up to which they are the same run, and that up to which both are known \[s\].
    pub window_s: [f64; 2],
    /// Footsteps that both have, by time.
    pub pairs: Vec<FootstepPair>,
    /// Footsteps that one has alone: number of the branch, leg and time of touch-down \[s\].
    pub alone: Vec<(usize, String, f64)>,
}

/// A footstep in two branches.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FootstepPair {
    /// Leg.
    pub leg: String,
    /// Times of touch-down \[s\].
    pub touch_down_s: [f64; 2],
    /// Times of stance \[s\].
    pub stance_s: [f64; 2],
    /// Positions of the foot, where they are known \[m\].
    pub position_m: [Option<[f64; 3]>; 2],
}

/// Runs the scenarios of two branches up to where both have been, and compares them.
pub(crate) fn compare(session: &Session<'_>, branches: [usize; 2]) -> Result<Futures, LiveError> {
    let [one, other] = branches.map(|number| session.branch(number));
    let (one, other) = (one?, other?);
    let end = one.reached.min(other.reached);
    let begin = one.common(other).min(end);
    let recordings = [
        recording(session, branches[0], end)?,
        recording(session, branches[1], end)?,
    ];
    let failed = |error: &dyn ToString| LiveError::Branch(error.to_string());
    let compared = compare_events(&recordings[0], &recordings[1], [end; 2]);
    let compared = compared.map_err(|error| failed(&error))?;
    let is_later = |step: &RecordedFootstep| step.lift_off_s >= begin.as_secs_f64();
    let mut futures = Futures {
        branches,
        window_s: [begin, end].map(SimTime::as_secs_f64),
        pairs: Vec::new(),
        alone: Vec::new(),
    };
    for leg in &compared.legs {
        for &(a, b) in &leg.pairing.pairs {
            let steps = [&leg.a[a], &leg.b[b]];
            if steps.iter().any(|step| is_later(step)) {
                futures.pairs.push(FootstepPair {
                    leg: leg.leg.clone(),
                    touch_down_s: steps.map(|step| step.touch_down_s),
                    stance_s: steps.map(|step| step.lift_off_s - step.touch_down_s),
                    position_m: steps.map(|step| step.position_m),
                });
            }
        }
        let sides = [
            (&leg.pairing.only_in_a, &leg.a),
            (&leg.pairing.only_in_b, &leg.b),
        ];
        for ((only, steps), branch) in sides.into_iter().zip(branches) {
            let only = only
                .iter()
                .map(|index| &steps[*index])
                .filter(|step| is_later(step));
            let alone = only.map(|step| (branch, leg.leg.clone(), step.touch_down_s));
            futures.alone.extend(alone);
        }
    }
    let by_time = |pair: &FootstepPair| pair.touch_down_s[0].min(pair.touch_down_s[1]);
    futures
        .pairs
        .sort_by(|a, b| by_time(a).total_cmp(&by_time(b)));
    futures.alone.sort_by(|a, b| a.2.total_cmp(&b.2));
    Ok(futures)
}

fn recording(session: &Session<'_>, branch: usize, end: SimTime) -> Result<Recording, LiveError> {
    let failed = |error: &dyn ToString| LiveError::Branch(error.to_string());
    let folder = Path::new("");
    let text = session.text_of(branch, folder)?;
    let builder = Assembly::builder(session.assembly().registry());
    let file = &session.assembly().scenario().file;
    let assembly = builder.text(file, &text, folder);
    let assembly = assembly.map_err(|error| failed(&error))?;
    let detail = Detail {
        frames: SimDuration::from_millis(20),
        instants: 1,
    };
    let repeated = repeat(&assembly, detail, end, None);
    let repeated = repeated.map_err(|error| failed(&error))?;
    Ok(repeated.recording)
}

//! Differences between the signals of two runs.

use serde::Serialize;
use twinrig_kernel::signal;
use twinrig_record::{Drift, SHARES, SignalDrift};

/// Residual of the energy balance. Its range consists of errors, so that a share of it is not
/// meaningful.
pub(super) const RESIDUAL: &str = signal::ENERGY_RESIDUAL;

#[derive(Serialize)]
pub(super) struct FirstSignal {
    pub(super) signal: String,
    pub(super) component: usize,
    #[serde(skip)]
    pub(super) components: usize,
    pub(super) share: f64,
    pub(super) at_s: Option<f64>,
}

#[derive(Serialize)]
pub(super) struct OfSignal {
    pub(super) group: String,
    pub(super) signal: String,
    pub(super) component: usize,
    pub(super) components: usize,
    pub(super) unit: String,
    pub(super) by_leg: Option<String>,
    pub(super) aligned: Drifted,
    pub(super) plain: Drifted,
    /// First and last common times, and the values of both runs there.
    pub(super) ends_at_s: Option<[f64; 2]>,
    pub(super) ends_a: Option<[f64; 2]>,
    pub(super) ends_b: Option<[f64; 2]>,
}

#[derive(Serialize)]
pub(super) struct Drifted {
    pub(super) max: f64,
    pub(super) max_at_s: f64,
    pub(super) rms: f64,
    pub(super) share: Option<f64>,
    pub(super) exceeds_1_percent_at_s: Option<f64>,
    pub(super) exceeds_10_percent_at_s: Option<f64>,
    pub(super) rms_of_tenths: Vec<f64>,
    pub(super) growth_per_s: f64,
}

impl FirstSignal {
    pub(super) fn name(&self) -> String {
        named(&self.signal, self.component, self.components)
    }
}

/// Returns the name of a component of a signal, as in scenarios: `body/position y`.
fn named(signal: &str, component: usize, components: usize) -> String {
    match (components, component) {
        (1, _) => signal.to_owned(),
        (3, 0..3) => format!("{signal} {}", ["x", "y", "z"][component]),
        _ => format!("{signal} {component}"),
    }
}

/// Returns the first signal whose difference exceeds a share of its range.
pub(super) fn first_beyond(signals: &[SignalDrift], share: f64) -> Option<FirstSignal> {
    let differing = signals.iter().filter(|drift| drift.signal != RESIDUAL);
    let differing = differing.filter(|drift| drift.aligned.share.is_some_and(|most| most > share));
    let found = differing.map(|drift| {
        // The time of exceeding is known for the shares `SHARES`; for others, the time of the
        // greatest difference is used.
        let known = SHARES.iter().position(|known| *known == share);
        let at_s = known.and_then(|known| drift.aligned.exceeds_at_s[known]);
        FirstSignal {
            signal: drift.signal.clone(),
            component: drift.component,
            components: drift.components,
            share: drift.aligned.share.unwrap_or(0.0),
            at_s: at_s.or(Some(drift.aligned.max_at_s)),
        }
    });
    found.reduce(|first, next| if next.at_s < first.at_s { next } else { first })
}

impl OfSignal {
    pub(super) fn of(drift: SignalDrift) -> Self {
        Self {
            group: drift.group,
            signal: drift.signal,
            component: drift.component,
            components: drift.components,
            unit: drift.unit,
            by_leg: drift.by_leg,
            aligned: drift.aligned.into(),
            plain: drift.plain.into(),
            ends_at_s: drift.ends.map(|ends| ends.at_s),
            ends_a: drift.ends.map(|ends| ends.a),
            ends_b: drift.ends.map(|ends| ends.b),
        }
    }

    /// Returns the name with the component, if there are several.
    pub(super) fn name(&self) -> String {
        named(&self.signal, self.component, self.components)
    }
}

impl From<Drift> for Drifted {
    fn from(drift: Drift) -> Self {
        let [first, second] = drift.exceeds_at_s;
        Self {
            max: drift.max,
            max_at_s: drift.max_at_s,
            rms: drift.rms,
            share: drift.share,
            exceeds_1_percent_at_s: first,
            exceeds_10_percent_at_s: second,
            rms_of_tenths: drift.rms_of_parts.to_vec(),
            growth_per_s: drift.growth_per_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drift(signal: &str, share: f64, at_s: f64) -> SignalDrift {
        let drift = Drift {
            share: Some(share),
            exceeds_at_s: [Some(at_s), None],
            ..Drift::default()
        };
        SignalDrift {
            group: "plant".to_owned(),
            signal: signal.to_owned(),
            unit: "m".to_owned(),
            component: 1,
            components: 3,
            by_leg: None,
            aligned: drift.clone(),
            plain: drift,
            ends: None,
        }
    }

    #[test]
    fn energy_residual_is_excluded_from_first_difference() {
        let all = [
            drift(RESIDUAL, 4310.0, 0.0),
            drift("body/rpy", 0.5, 3.0),
            drift("body/position", 0.02, 2.0),
        ];
        let first = first_beyond(&all, SHARES[0]).unwrap();
        assert_eq!(
            (first.name().as_str(), first.at_s),
            ("body/position y", Some(2.0))
        );
        assert!(first_beyond(&all[..1], SHARES[0]).is_none());
    }

    #[test]
    fn components_are_named_as_in_scenarios() {
        assert_eq!(named("foot/load", 0, 1), "foot/load");
        assert_eq!(named("body/position", 2, 3), "body/position z");
        assert_eq!(named("body/orientation", 3, 4), "body/orientation 3");
    }
}

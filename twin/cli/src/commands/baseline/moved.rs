//! Footsteps and signals of a run that are beyond the tolerances of its baseline, old and new.

use twinrig_kernel::SimTime;
use twinrig_record::{EventComparison, LegFootsteps, SignalDrift, median};
use twinrig_report::number::{percent, quantity, si};

use super::super::compare::differing_footsteps;
use super::tolerances::Tolerances;

/// Returns the differences in words: of the gait of each leg, of each footstep, of signals, and of
/// the end.
pub(super) fn moved(
    comparison: &EventComparison,
    tolerances: &Tolerances,
    beyond: &[&SignalDrift],
    [was, is]: [SimTime; 2],
) -> Vec<String> {
    let mut moved = Vec::new();
    if was != is {
        let [was, is] = [was, is].map(SimTime::as_secs_f64);
        moved.push(format!("ends at {is:.3} s, at {was:.3} s in the baseline"));
    }
    let footsteps: Vec<String> = comparison
        .legs
        .iter()
        .flat_map(|leg| differing_footsteps(leg, tolerances.bounds()))
        .collect();
    if !footsteps.is_empty() {
        moved.extend(comparison.legs.iter().filter_map(gait));
    }
    moved.extend(footsteps);
    moved.extend(beyond.iter().map(|drift| {
        let share = drift.aligned.share.map_or_else(String::new, |share| {
            format!(", {} of its range", percent(share))
        });
        let component = match drift.components {
            1 => String::new(),
            _ => format!("[{}]", drift.component),
        };
        let most = quantity(drift.aligned.max, &drift.unit);
        let at = drift.aligned.max_at_s;
        format!(
            "{}{component} differs by {most}{share}, at {at:.3} s",
            drift.signal
        )
    }));
    moved
}

/// Returns the medians of stance, stride and touch-downs of a leg, old and new; none without pairs.
fn gait(leg: &LegFootsteps) -> Option<String> {
    let pairs = &leg.pairing.pairs;
    let of = |number: fn(&LegFootsteps, usize, usize) -> Option<[f64; 2]>| {
        let values = pairs.iter().filter_map(|&(a, b)| number(leg, a, b));
        let (was, is): (Vec<f64>, Vec<f64>) = values.map(|[was, is]| (was, is)).unzip();
        Some([median(&was)?, median(&is)?])
    };
    let stance = of(|leg, a, b| {
        let (was, is) = (leg.a[a], leg.b[b]);
        Some([
            was.lift_off_s - was.touch_down_s,
            is.lift_off_s - is.touch_down_s,
        ])
    })?;
    let stride = of(|leg, a, b| {
        let distance = |from: Option<[f64; 3]>, to: Option<[f64; 3]>| {
            let (from, to) = (from?, to?);
            let [x, y] = [0, 1].map(|axis| to[axis] - from[axis]);
            Some(libm::hypot(x, y))
        };
        let [was, is] = [
            distance(leg.a[a].position_m, leg.a.get(a + 1)?.position_m)?,
            distance(leg.b[b].position_m, leg.b.get(b + 1)?.position_m)?,
        ];
        Some([was, is])
    });
    let apart = of(|leg, a, b| Some([leg.a[a].touch_down_s, leg.b[b].touch_down_s]))?;
    let part = |name: &str, [was, is]: [f64; 2], unit: &str| {
        format!("{name} {}, {} in the baseline", si(is, unit), si(was, unit))
    };
    let mut parts = vec![part("stance", stance, "s")];
    parts.extend(stride.map(|stride| part("stride", stride, "m")));
    let later = apart[1] - apart[0];
    let order = if later < 0.0 { "earlier" } else { "later" };
    parts.push(format!("touch-down {} {order}", si(later.abs(), "s")));
    let count = match pairs.len() {
        1 => "one footstep".to_owned(),
        count => format!("medians of {count} footsteps"),
    };
    Some(format!("{}: {} ({count})", leg.leg, parts.join("; ")))
}

//! Speed and footsteps of a walk.

use core::f64::consts::TAU;

use twinrig_kernel::{Direction, Layout, SimTime, signal};
use twinrig_runtime::Plant;

use crate::plants::footsteps::{TouchDown, TouchDownRecorder};
use crate::plants::plant_run::SampleVerdict;

/// Height of the trunk, as a share of the initial height, below which the robot has fallen.
const FALLEN: f64 = 0.5;
/// Range of phases: one that contains those of the usual gaits, 0, ¼, ½ and ¾, away from its ends.
const PHASE_MIN: f64 = -0.125;

/// Walk from the end of its settling time on.
pub(super) struct GaitRecorder {
    from: SimTime,
    outputs: Vec<f64>,
    trunk: usize,
    feet: TouchDownRecorder,
    count: usize,
    first_height: Option<f64>,
    start: Option<(SimTime, [f64; 3])>,
    last: Option<(SimTime, [f64; 3])>,
    samples: u64,
    loaded: u64,
    pub(super) fell: bool,
}

/// Name, unit and value of a quantity.
pub(super) type Quantity = (String, &'static str, f64);

impl GaitRecorder {
    /// Creates the recorder of a walk that has settled at `from`; `None` for a plant without trunk.
    pub(super) fn of(plant: &dyn Plant, from: SimTime) -> Option<Self> {
        let ports = plant.ports();
        let layout = Layout::of(&ports, Direction::Output);
        let feet = TouchDownRecorder::of(&layout);
        Some(Self {
            from,
            outputs: vec![0.0; layout.len()],
            trunk: layout.find(signal::BODY_POSITION)?.start,
            count: feet.count(),
            feet,
            first_height: None,
            start: None,
            last: None,
            samples: 0,
            loaded: 0,
            fell: false,
        })
    }

    pub(super) fn sample(&mut self, now: SimTime, plant: &mut dyn Plant) -> SampleVerdict {
        plant.observe(&mut self.outputs);
        plant.begin_window();
        if self.outputs.iter().any(|output| !output.is_finite()) {
            return SampleVerdict::NotFinite;
        }
        let trunk = core::array::from_fn(|n| self.outputs[self.trunk + n]);
        let first = *self.first_height.get_or_insert(trunk[2]);
        if trunk[2] < FALLEN * first {
            self.fell = true;
            return SampleVerdict::Stop;
        }
        self.feet.sample(now, &self.outputs);
        if now >= self.from {
            self.start.get_or_insert((now, trunk));
            self.last = Some((now, trunk));
            self.samples += 1;
            self.loaded += self.feet.loaded() as u64;
        }
        SampleVerdict::Continue
    }

    /// Returns speed, duty factor (share of stance, mean of all legs), phase of each leg after the
    /// first, and spread of the steps, of those that are defined.
    pub(super) fn quantities(self) -> Vec<Quantity> {
        let mut all = Vec::new();
        let mut add = |name: &str, unit, value| all.push((name.to_owned(), unit, value));
        if let (Some((from, a)), Some((to, b))) = (self.start, self.last)
            && to > from
        {
            let distance = libm::hypot(b[0] - a[0], b[1] - a[1]);
            add("speed", "m/s", distance / (to - from).as_secs_f64());
        }
        let feet = self.samples * self.count as u64;
        if feet > 0 {
            add("duty factor", "", self.loaded as f64 / feet as f64);
        }
        let touch_downs = self.feet.touch_downs();
        let from_s = self.from.as_secs_f64();
        let legs = touch_downs.legs().map(|(leg, touched)| {
            let first = touched.partition_point(|touched| touched.at_s < from_s);
            (leg, &touched[first..])
        });
        let legs: Vec<(&str, &[TouchDown])> = legs.collect();
        if let Some(((_, strides), others)) = legs.split_first() {
            for (leg, touched) in others {
                if let Some(phase) = phase(strides, touched) {
                    add(&format!("phase {leg}"), "", phase);
                }
            }
        }
        if let Some(spread) = spread(&legs) {
            add("footstep spread", "m", spread);
        }
        all
    }
}

/// Returns the circular mean of the instants of touch-downs as shares of the strides of a leg.
fn phase(strides: &[TouchDown], touched: &[TouchDown]) -> Option<f64> {
    let [mut sine, mut cosine] = [0.0, 0.0];
    for stride in strides.windows(2) {
        let [begin, end] = [stride[0].at_s, stride[1].at_s];
        let within = touched
            .iter()
            .filter(|touched| (begin..end).contains(&touched.at_s));
        for touched in within {
            let (s, c) = libm::sincos(TAU * (touched.at_s - begin) / (end - begin));
            sine += s;
            cosine += c;
        }
    }
    if sine == 0.0 && cosine == 0.0 {
        return None;
    }
    let phase = libm::atan2(sine, cosine) / TAU;
    Some(if phase < PHASE_MIN {
        phase + 1.0
    } else {
        phase
    })
}

/// Returns the root mean square deviation of the steps of each leg from their mean, horizontally
/// from touch-down to touch-down \[m\].
fn spread(legs: &[(&str, &[TouchDown])]) -> Option<f64> {
    let (mut squares, mut count) = (0.0, 0_u32);
    for (_, touched) in legs {
        let steps = touched
            .windows(2)
            .map(|pair| [0, 1].map(|n| pair[1].place[n] - pair[0].place[n]));
        let steps: Vec<[f64; 2]> = steps.collect();
        for axis in [0, 1] {
            let mean = steps.iter().map(|step| step[axis]).sum::<f64>() / steps.len().max(1) as f64;
            let deviations = steps
                .iter()
                .map(|step| (step[axis] - mean) * (step[axis] - mean));
            squares += deviations.sum::<f64>();
        }
        count += u32::try_from(steps.len()).unwrap_or(u32::MAX);
    }
    (count > 1).then(|| (squares / f64::from(count)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touched(times: &[f64]) -> Vec<TouchDown> {
        let touched = times.iter().map(|&at_s| TouchDown {
            at_s,
            place: [at_s, 0.0, 0.0],
        });
        touched.collect()
    }

    #[test]
    fn phase_is_the_share_of_a_stride_also_across_its_end() {
        let strides = touched(&[0.0, 1.0, 2.0, 3.0]);
        let of = |times: &[f64]| phase(&strides, &touched(times)).unwrap();
        assert!((of(&[0.5, 1.5, 2.5]) - 0.5).abs() < 1e-12);
        assert!((of(&[0.75, 1.75]) - 0.75).abs() < 1e-12);
        // The mean of 0.99 and 0.01 is 0, not ½.
        assert!(of(&[0.99, 1.01, 1.99, 2.01]).abs() < 1e-12);
        assert_eq!(phase(&strides, &touched(&[3.5])), None);
    }

    #[test]
    fn spread_is_the_deviation_of_the_steps_from_those_of_the_same_leg() {
        // Steps of 1 m by one leg, and of 1.9 m and 2.1 m by the other.
        let (even, uneven) = (touched(&[0.0, 1.0, 2.0]), touched(&[0.0, 1.9, 4.0]));
        let found = spread(&[("A", &even), ("B", &uneven)]).unwrap();
        assert!((found - (0.02_f64 / 4.0).sqrt()).abs() < 1e-12, "{found}");
        assert_eq!(spread(&[("A", &even[..1])]), None);
    }
}

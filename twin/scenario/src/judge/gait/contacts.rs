//! Contacts of the feet, by their loads.

use crate::judge::footstep::Thresholds;

/// Contacts of the feet: begun at the touch-down threshold, ended below the lift-off threshold.
/// Bounces are contacts of their own.
#[derive(Clone, Debug)]
pub(super) struct Contacts {
    loads: Vec<usize>,
    thresholds: Thresholds,
    is_loaded: Vec<bool>,
}

impl Contacts {
    pub fn new(loads: Vec<usize>, thresholds: Thresholds) -> Self {
        Self {
            is_loaded: vec![false; loads.len()],
            loads,
            thresholds,
        }
    }

    #[inline]
    pub fn sample(&mut self, values: &[f64]) {
        for (contact, load) in self.is_loaded.iter_mut().zip(&self.loads) {
            *contact = if *contact {
                values[*load] >= self.thresholds.lift_off
            } else {
                values[*load] >= self.thresholds.touch_down
            };
        }
    }

    pub fn any(&self) -> bool {
        self.is_loaded.contains(&true)
    }

    pub fn all(&self) -> &[bool] {
        &self.is_loaded
    }
}

#[cfg(test)]
mod tests {
    use twinrig_kernel::SimDuration;

    use super::*;

    #[test]
    fn contact_lasts_to_the_lower_threshold() {
        let thresholds = Thresholds {
            touch_down: 0.5,
            lift_off: 0.2,
            shortest_swing: SimDuration::ZERO,
            least_impulse: 0.0,
        };
        let mut contacts = Contacts::new(vec![0], thresholds);
        for (load, expected) in [
            (0.4, false),
            (0.5, true),
            (0.3, true),
            (0.2, true),
            (0.1, false),
            (0.3, false),
        ] {
            contacts.sample(&[load]);
            assert_eq!(contacts.all(), [expected], "{load}");
        }
    }
}

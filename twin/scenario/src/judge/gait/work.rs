//! Work of the drives.

use twinrig_kernel::signal;

/// Positive work of the drives: none of them recovers energy. The power is that of the mean torque
/// of two observations.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    /// Indices of angle and torque of each drive.
    drives: Vec<(usize, usize)>,
    /// Last angle \[rad\] and torque \[N·m\] of each.
    last: Vec<Option<(f64, f64)>>,
    positive: f64,
}

impl Work {
    /// Creates the meter of the drives of these legs, whose signals `index` finds, or returns its
    /// first error.
    pub fn of_legs<'l, E>(
        legs: impl Iterator<Item = &'l str>,
        index: impl Fn(&str) -> Result<usize, E>,
    ) -> Result<Self, E> {
        let drives = legs.flat_map(|leg| {
            signal::DRIVES.map(|(angle, torque)| {
                let index = |name| index(&signal::of_leg(leg, name));
                Ok((index(angle)?, index(torque)?))
            })
        });
        let drives = drives.collect::<Result<Vec<_>, E>>()?;
        Ok(Self {
            last: vec![None; drives.len()],
            drives,
            positive: 0.0,
        })
    }

    #[inline]
    pub fn sample(&mut self, values: &[f64]) {
        for ((angle, torque), last) in self.drives.iter().zip(&mut self.last) {
            let (angle, torque) = (values[*angle], values[*torque]);
            if let Some((last_angle, last_torque)) = last.replace((angle, torque)) {
                let work = 0.5 * (torque + last_torque) * (angle - last_angle);
                // A NaN is kept: `f64::max` would drop it.
                self.positive += if work <= 0.0 { 0.0 } else { work };
            }
        }
    }

    /// Returns the work \[J\].
    pub fn positive(&self) -> f64 {
        self.positive
    }
}

//! Events: instants at which elements are compressed or released.
//!
//! The slope in a state contains the compressed elements of each leg as a number, the sum of 2ⁱ
//! over those with positive depth xᵢ. Where it differs between the ends of an accepted substep, the
//! instant of each element that changed is the root of the cubic Hermite polynomial through depths
//! and rates at the two ends. Events have no influence on the motion. An element that is compressed
//! and released within one substep leaves no event.

use crate::lanes::{LANES, Lanes, Quad};

/// Number of elements inside a leg, the first ones of every plant.
pub const INSIDE: usize = 6;
/// Their names: the leg extended, its diagonal bottomed out, the pantograph open and closed, its
/// rod in line with the third link, the cable.
pub const INSIDE_NAMES: [&str; INSIDE] = [
    "extended",
    "bottomed",
    "open",
    "closed",
    "dead-centre",
    "cable",
];
/// Index of the foot.
pub const GROUND: usize = INSIDE;
/// Index of an element of the plant.
pub const OWN: usize = INSIDE + 1;
/// Index of the stops of abduction.
pub const ABDUCTION: usize = INSIDE + 2;
/// Index of the contact of the knee.
pub const KNEE: usize = INSIDE + 3;
/// Index of the contact of the ankle.
pub const ANKLE: usize = INSIDE + 4;
/// Index of the lower corners of the trunk, one in the place of each leg; the upper ones follow.
pub const CORNERS: usize = INSIDE + 5;
/// Number of elements.
pub const ELEMENTS: usize = INSIDE + 7;
/// Names of the contacts of knee, ankle, and lower and upper corners.
pub const BODY_NAMES: [&str; 4] = [
    "knee-contact",
    "ankle-contact",
    "lower-corner",
    "upper-corner",
];
/// Elements of the trunk, as bits.
const OF_TRUNK: u32 = 0b11 << CORNERS;

/// Returns whether an element belongs to the trunk.
pub(crate) const fn is_of_trunk(element: usize) -> bool {
    element >= CORNERS
}

/// Depths and rates of the elements of all legs.
#[derive(Debug, Clone, Copy)]
pub struct ElementMotion {
    /// Depths, negative where elements are not compressed, −∞ where there are none \[m\].
    pub depths: [Quad; ELEMENTS],
    /// Rates of the depths \[m/s\].
    pub rates: [Quad; ELEMENTS],
}

impl ElementMotion {
    /// Returns no elements.
    pub fn none() -> Self {
        Self {
            depths: [Quad::splat(f64::NEG_INFINITY); ELEMENTS],
            rates: [Quad::splat(0.0); ELEMENTS],
        }
    }

    /// Sets the motion of an element of the first `legs` lanes.
    #[inline(always)]
    pub fn set<L: Lanes>(&mut self, element: usize, legs: usize, depth: L, rate: L) {
        self.depths[element].0[..legs].copy_from_slice(&depth.quad().0[..legs]);
        self.rates[element].0[..legs].copy_from_slice(&rate.quad().0[..legs]);
    }
}

/// Returns the number that an element adds to the compressed ones at a depth \[m\].
#[inline(always)]
pub fn if_compressed<L: Lanes>(element: usize, depth: L) -> L {
    let zero = depth.zero();
    depth.like(weight(element)).or(depth.gt(zero), zero)
}

/// Returns 2ⁱ.
#[inline(always)]
pub(crate) const fn weight(element: usize) -> f64 {
    (1_u32 << element) as f64
}

/// Compression or release of an element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementEvent {
    /// Time since the start; within a step, since its begin \[s\].
    pub at_s: f64,
    /// Leg.
    pub leg: usize,
    /// Element.
    pub element: usize,
    /// Whether it is compressed.
    pub compressed: bool,
}

/// Log of events.
#[derive(Debug, Clone, Default)]
pub struct EventLog {
    enabled: bool,
    events: Vec<ElementEvent>,
}

impl EventLog {
    /// Enables or disables the log, and clears it.
    pub fn enable(&mut self, enabled: bool) {
        self.enabled = enabled;
        self.events.clear();
    }

    /// Returns whether the log is enabled.
    pub fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Returns the number of events in the log.
    pub fn len(&self) -> usize {
        self.events.len()
    }

    /// Returns whether the log is empty.
    pub fn is_empty(&self) -> bool {
        self.events.is_empty()
    }

    /// Removes and returns all events.
    pub fn drain(&mut self) -> impl Iterator<Item = ElementEvent> + '_ {
        self.events.drain(..)
    }

    /// Removes the events from the index `from` on.
    pub(crate) fn truncate(&mut self, from: usize) {
        self.events.truncate(from);
    }

    /// Shifts the events from the index `from` on by a time \[s\].
    pub(crate) fn shift(&mut self, from: usize, seconds: f64) {
        for event in self.events.iter_mut().skip(from) {
            event.at_s += seconds;
        }
    }

    /// Records the events of an accepted substep, its begin and duration, of the first `legs` legs,
    /// and of the trunk, and returns their number. `compressed` has the compressed elements at both
    /// ends, `motion` computes the elements there, and is called only for events that are logged.
    #[inline(always)]
    pub fn observe<L: Lanes>(
        &mut self,
        substep: [f64; 2],
        legs: usize,
        compressed: [L; 2],
        motion: impl FnOnce() -> [ElementMotion; 2],
    ) -> u64 {
        let [before, after] = compressed;
        if !before.any((before - after).abs().gt(before.zero())) {
            return 0;
        }
        let changes = Changes::new(legs, [before.quad(), after.quad()]);
        if self.enabled {
            self.record(substep, &changes, &motion());
        }
        changes.count()
    }

    #[cold]
    fn record(
        &mut self,
        [time, seconds]: [f64; 2],
        changes: &Changes,
        motion: &[ElementMotion; 2],
    ) {
        let from = self.events.len();
        for (leg, [before, after]) in changes.bits.into_iter().enumerate() {
            for element in 0..ELEMENTS {
                let [was, is] = [before, after].map(|bits| bits >> element & 1 == 1);
                if was == is {
                    continue;
                }
                let at = |quads: fn(&ElementMotion) -> &[Quad; ELEMENTS]| {
                    motion.each_ref().map(|end| quads(end)[element].0[leg])
                };
                let rates = at(|end| &end.rates).map(|rate| rate * seconds);
                self.events.push(ElementEvent {
                    at_s: time + seconds * crossing(at(|end| &end.depths), rates),
                    leg,
                    element,
                    compressed: is,
                });
            }
        }
        self.events[from..].sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    }
}

/// Compressed elements of the legs at both ends of a substep, as bits.
struct Changes {
    bits: [[u32; 2]; LANES],
}

impl Changes {
    /// Creates the changes of the first `legs` legs and of the trunk.
    #[cold]
    fn new(legs: usize, [before, after]: [Quad; 2]) -> Self {
        let mut all = [[0; 2]; LANES];
        for (leg, ends) in all.iter_mut().enumerate() {
            let present = if leg < legs { u32::MAX } else { OF_TRUNK };
            *ends = [before, after].map(|end| bits(end.0[leg]) & present);
        }
        Self { bits: all }
    }

    /// Returns their number.
    fn count(&self) -> u64 {
        let changed = |[before, after]: &[u32; 2]| u64::from((before ^ after).count_ones());
        self.bits.iter().map(changed).sum()
    }
}

/// Returns the compressed elements of a leg as bits.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a sum of few powers of two"
)]
fn bits(compressed: f64) -> u32 {
    compressed as u32
}

/// Returns the place in 0 … 1 at which the cubic with these values and slopes at 0 and 1 changes
/// its sign, to round-off, by bisection.
fn crossing([a, b]: [f64; 2], [u, v]: [f64; 2]) -> f64 {
    let at = |s: f64| {
        let r = 1.0 - s;
        a * r * r * (1.0 + 2.0 * s) + u * s * r * r + b * s * s * (3.0 - 2.0 * s) - v * s * s * r
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..54 {
        let middle = 0.5 * (low + high);
        if (at(middle) > 0.0) == (b > 0.0) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::lanes::{Features, Kernel, Simd, dispatch};

    /// Depths `a + u t` of all elements, which grow at the rate `u`.
    fn linear(a: f64, u: f64, seconds: f64) -> [ElementMotion; 2] {
        [a, a + u * seconds].map(|depth| ElementMotion {
            depths: [Quad::splat(depth); ELEMENTS],
            rates: [Quad::splat(u); ELEMENTS],
        })
    }

    /// Observes a substep from 1 s to 1.5 s of two legs and returns the number of events.
    struct Observed<'a>(&'a mut EventLog, [f64; 2]);

    impl Kernel for Observed<'_> {
        type Output = u64;

        #[inline(always)]
        fn run<S: Simd>(self, simd: S) -> u64 {
            let compressed = self.1.map(|bits| simd.splat(bits));
            self.0
                .observe([1.0, 0.5], 2, compressed, || linear(-0.2, 1.0, 0.5))
        }
    }

    #[test]
    fn changed_elements_of_present_legs_are_counted_and_logged() {
        let mut log = EventLog::default();
        let observe = |log: &mut EventLog, ends| dispatch(Features::Detected, Observed(log, ends));
        assert_eq!(observe(&mut log, [0.0, 65.0]), 4);
        assert!(log.is_empty(), "disabled");
        log.enable(true);
        assert_eq!(observe(&mut log, [65.0, 65.0]), 0);
        assert_eq!(observe(&mut log, [0.0, 65.0]), 4);
        let events: Vec<_> = log.drain().collect();
        let places: Vec<_> = events.iter().map(|e| (e.leg, e.element)).collect();
        assert_eq!(places, [(0, 0), (0, GROUND), (1, 0), (1, GROUND)]);
        for event in events {
            assert!(event.compressed && (event.at_s - 1.2).abs() < 1e-15);
        }
    }

    proptest! {
        #[test]
        fn crossing_is_the_root_of_a_cubic(
            root in 0.01..0.99_f64, p in -3.0..3.0_f64, q in 0.01..5.0_f64, sign in any::<bool>(),
        ) {
            // (s − root) ((s − p)² + q) has one real root.
            let k = if sign { 1.0 } else { -1.0 };
            let value = |s: f64| k * (s - root) * ((s - p) * (s - p) + q);
            let slope = |s: f64| k * ((s - p) * (s - p) + q + 2.0 * (s - root) * (s - p));
            let found = crossing([value(0.0), value(1.0)], [slope(0.0), slope(1.0)]);
            prop_assert!((found - root).abs() < 1e-12, "{found} {root}");
        }
    }
}

//! Whether and when the robot falls.

use twinrig_kernel::SimTime;

use super::{Group, Layouts, resolve};
use crate::ground_below::GroundBelow;
use crate::scenario::FallSpec;
use crate::scene::{BODY_POSITION, BODY_RPY, Scene};

/// Watches the trunk until it falls. Where neither its height nor its angles are observed, as at
/// hardware, there is no fall.
#[derive(Clone, Debug)]
pub(super) struct FallDetector {
    spec: FallSpec,
    ground: GroundBelow,
    /// Group and element of x; y and z follow.
    position: Option<(Group, usize)>,
    /// Group and element of roll; pitch follows.
    roll: Option<(Group, usize)>,
    /// The first height above the ground \[m\].
    first_height: Option<f64>,
    fell_at: Option<SimTime>,
}

impl FallDetector {
    pub fn new(scene: &Scene, layouts: &Layouts<'_>) -> Self {
        let three = |name| {
            let (channel, range) = resolve::find(layouts, name)?;
            (range.len() == 3).then_some((channel, range.start))
        };
        FallDetector {
            spec: scene.scenario.fall,
            ground: scene.ground.clone(),
            position: three(BODY_POSITION),
            roll: three(BODY_RPY),
            first_height: None,
            fell_at: None,
        }
    }

    /// When it fell.
    pub fn fell_at(&self) -> Option<SimTime> {
        self.fell_at
    }

    /// When it fell, if that ends the run.
    pub fn ended_at(&self) -> Option<SimTime> {
        self.fell_at.filter(|_| self.spec.end)
    }

    /// Takes the samples of a channel. Whether it falls with them.
    #[inline]
    pub fn sample(&mut self, now: SimTime, channel: Group, values: &[f64]) -> bool {
        if self.fell_at.is_some() {
            return false;
        }
        let of_this = |element: &&(Group, usize)| element.0 == channel;
        let tilted = self.roll.as_ref().filter(of_this).is_some_and(|(_, roll)| {
            self.is_tilted(values[*roll]) || self.is_tilted(values[roll + 1])
        });
        let low = match self.position.as_ref().filter(of_this) {
            Some((_, x)) => self.is_low([values[*x], values[x + 1], values[x + 2]]),
            None => false,
        };
        if tilted || low {
            self.fell_at = Some(now);
        }
        tilted || low
    }

    /// What is not a number is no fall: it fails whatever looks at it.
    fn is_tilted(&self, angle: f64) -> bool {
        angle.is_finite() && angle.abs() > self.spec.tilt
    }

    fn is_low(&mut self, [x, y, z]: [f64; 3]) -> bool {
        let Some(ground) = self.ground.height(x, y) else {
            return false;
        };
        let height = z - ground;
        if !height.is_finite() {
            return false;
        }
        let first = *self.first_height.get_or_insert(height);
        // A trunk that starts on the ground or below it has no height to lose.
        first > 0.0 && height < self.spec.height * first
    }
}

//! Path, height and work of a robot, and the numbers by which gaits are compared.

use twinrig_kernel::SimTime;

use super::work::Work;
use crate::judge::tracker::seconds;
use crate::judge::trunk::PlanarPath;

/// Gravity in the scale of the speed \[m/s²\].
pub(super) const GRAVITY: f64 = 9.81;

/// Transport of the trunk, and work of the drives for it.
#[derive(Clone, Debug)]
pub(crate) struct Transport {
    /// Index of x of the trunk's position; y and z follow.
    position: usize,
    yaw: usize,
    work: Option<Work>,
    path: Option<PlanarPath>,
    last: Option<SimTime>,
    /// Observed time \[s\].
    observed: f64,
    /// Integral of the trunk's height over the observed time \[m·s\].
    heights: f64,
}

/// Part of a run from one observation to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Passage {
    /// Duration; 0 at the first observation \[s\].
    pub elapsed: f64,
    /// Speed of the trunk \[m/s\].
    pub speed: f64,
    /// Height of the trunk \[m\].
    pub height: f64,
}

impl Transport {
    /// Creates the meter of samples with the trunk's position and yaw at these indices.
    pub fn new(position: usize, yaw: usize, work: Option<Work>) -> Self {
        Self {
            position,
            yaw,
            work,
            path: None,
            last: None,
            observed: 0.0,
            heights: 0.0,
        }
    }

    /// Evaluates an observation.
    #[inline]
    pub fn sample(&mut self, now: SimTime, values: &[f64]) -> Passage {
        let [x, y, height] = [0, 1, 2].map(|axis| values[self.position + axis]);
        let yaw = values[self.yaw];
        let elapsed = self.last.map_or(0.0, |last| seconds(now - last));
        self.last = Some(now);
        self.observed += elapsed;
        self.heights += elapsed * height;
        let path = self
            .path
            .get_or_insert_with(|| PlanarPath::new(now, [x, y], yaw));
        let speed = path.advance(now, [x, y]);
        if let Some(work) = &mut self.work {
            work.sample(values);
        }
        Passage {
            elapsed,
            speed,
            height,
        }
    }

    /// Returns the observed time \[s\].
    pub fn observed(&self) -> f64 {
        self.observed
    }

    /// Returns the path; none before some time was observed.
    pub fn path(&self) -> Option<&PlanarPath> {
        self.path.as_ref().filter(|_| self.observed > 0.0)
    }

    /// Returns the mean speed along the initial heading; 0 before some time was observed \[m/s\].
    pub fn speed(&self) -> f64 {
        let speed = self.path().and_then(PlanarPath::speed_ahead);
        speed.unwrap_or(0.0)
    }

    /// Returns the Froude number, or why there is none.
    pub fn froude(&self) -> Result<f64, &'static str> {
        Ok(self.speed() * self.speed() / (GRAVITY * self.height()?))
    }

    /// Returns the Strouhal number at a stride frequency \[Hz\], or why there is none.
    pub fn strouhal(&self, frequency: Option<f64>) -> Result<f64, &'static str> {
        let height = self.height()?;
        if self.speed() <= 0.0 {
            return Err(STANDS);
        }
        let frequency = frequency.ok_or("there is no whole cycle in its window")?;
        Ok(frequency * height / self.speed())
    }

    /// Returns the cost of transport of a weight \[N\], or why there is none.
    pub fn cost(&self, weight: f64) -> Result<f64, &'static str> {
        let distance = self.path().map(PlanarPath::ahead);
        let distance = distance.filter(|distance| *distance > 0.0).ok_or(STANDS)?;
        let work = self.work.as_ref().ok_or("the work is not observed")?;
        Ok(work.positive() / (weight * distance))
    }

    /// Returns the mean height of the trunk \[m\].
    fn height(&self) -> Result<f64, &'static str> {
        let height = self.heights / self.observed;
        if height <= 0.0 {
            return Err("the trunk is not above the ground");
        }
        Ok(height)
    }
}

const STANDS: &str = "the robot did not advance";

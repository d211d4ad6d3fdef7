//! Commands of the drives over a step.

use twinrig_legged::{DriveModels, StepInputs};

use crate::lanes::{LANES, Lanes, Quad, Simd};

/// Set-points of the drives: values at the begin of a step, and their rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Commands<T> {
    /// Absolute angle of the hip \[rad\], or stall torque \[N·m\], and rate.
    pub hip: [T; 2],
    /// Angle of the pulley \[rad\], or stall torque \[N·m\], and rate.
    pub knee: [T; 2],
    /// Damping of the motors of hip, pulley and abduction \[N·m·s/rad\].
    pub damping: [T; 3],
    /// Angle of abduction \[rad\], or stall torque \[N·m\], and rate; without effect on legs that
    /// do not abduct.
    pub abduction: [T; 2],
}

/// Commands of joints of abduction at a time.
#[derive(Debug, Clone, Copy)]
pub struct JointCommand<L> {
    /// Angle \[rad\], or stall torque \[N·m\].
    pub set_point: L,
    /// Damping of motors \[N·m·s/rad\].
    pub damping: L,
}

impl Commands<Quad> {
    /// Returns set-points and damping of zero.
    pub fn zero() -> Self {
        let zero = [Quad::splat(0.0); 2];
        Self {
            hip: zero,
            knee: zero,
            damping: [Quad::splat(0.0); 3],
            abduction: zero,
        }
    }

    /// Sets the inputs of a step; `references` are the absolute angles of the hips at the input
    /// zero \[rad\].
    pub fn set_inputs(
        &mut self,
        drives: Option<&DriveModels>,
        references: &[f64],
        inputs: &StepInputs<'_>,
    ) {
        let of_drives = references.len() * drives.map_or(0, DriveModels::inputs);
        let of_drives = of_drives.min(inputs.start.len());
        let abduction = &inputs.start[of_drives..];
        if let Some(motor) = drives.and_then(DriveModels::abduction) {
            for (leg, input) in abduction.chunks_exact(2).enumerate().take(LANES) {
                let line = motor.line(input[0], input[1]);
                (self.abduction[0].0[leg], self.damping[2].0[leg]) = (line.torque, line.damping);
            }
        } else {
            let rates = &inputs.rates[of_drives..];
            for (leg, (&start, &rate)) in abduction.iter().zip(rates).enumerate().take(LANES) {
                (self.abduction[0].0[leg], self.abduction[1].0[leg]) = (start, rate);
            }
        }
        if let Some(DriveModels::Motors(motors)) = drives {
            let inputs = inputs.start.chunks_exact(4).zip(references);
            for (leg, (input, _)) in inputs.enumerate() {
                let hip = motors.hip.line(input[0], input[1]);
                let knee = motors.knee.line(input[2], input[3]);
                (self.hip[0].0[leg], self.damping[0].0[leg]) = (hip.torque, hip.damping);
                (self.knee[0].0[leg], self.damping[1].0[leg]) = (knee.torque, knee.damping);
            }
            return;
        }
        let pairs = inputs.start.chunks_exact(2);
        let pairs = pairs.zip(inputs.rates.chunks_exact(2)).zip(references);
        for (leg, ((start, rate), reference)) in pairs.enumerate() {
            (self.hip[0].0[leg], self.hip[1].0[leg]) = (start[0] + reference, rate[0]);
            (self.knee[0].0[leg], self.knee[1].0[leg]) = (start[1], rate[1]);
        }
    }

    /// Returns whether the set-points are held over the step.
    pub fn are_held(&self) -> bool {
        let [[_, hip], [_, knee], [_, abduction]] = [self.hip, self.knee, self.abduction];
        let rates = hip.0.iter().chain(&knee.0).chain(&abduction.0);
        rates.into_iter().all(|rate| *rate == 0.0)
    }

    /// Returns whether the commands begin where others end, up to rounding errors of a ramp.
    pub fn continues(&self, end: &Self) -> bool {
        const ROUND_OFF: f64 = 1e-13;
        // All lanes of a pair are compared without a branch in between.
        let is_near = |a: &Quad, b: &Quad| {
            let near = |lane: usize| (a.0[lane] - b.0[lane]).abs() <= ROUND_OFF;
            near(0) & near(1) & near(2) & near(3)
        };
        is_near(&self.hip[0], &end.hip[0])
            && is_near(&self.knee[0], &end.knee[0])
            && is_near(&self.abduction[0], &end.abduction[0])
            // It is no ramp: the same bits where the bridge has not changed.
            && self.damping == end.damping
    }

    /// Returns the set-points after some time, at rest.
    #[must_use]
    pub fn at_end(&self, seconds: f64) -> Self {
        let end = |[start, rate]: [Quad; 2]| {
            let value = std::array::from_fn(|i| start.0[i] + rate.0[i] * seconds);
            [Quad(value), Quad::splat(0.0)]
        };
        Self {
            hip: end(self.hip),
            knee: end(self.knee),
            damping: self.damping,
            abduction: end(self.abduction),
        }
    }

    /// Loads the set-points into lanes.
    #[inline(always)]
    pub fn load<S: Simd>(&self, simd: S) -> Commands<S::Lanes> {
        Commands {
            hip: simd.load_all(&self.hip),
            knee: simd.load_all(&self.knee),
            damping: simd.load_all(&self.damping),
            abduction: simd.load_all(&self.abduction),
        }
    }
}

impl<L: Lanes> Commands<L> {
    /// Returns the set-points of hip and knee at a time.
    #[inline(always)]
    pub fn at(&self, time: f64) -> [L; 2] {
        [
            self.hip[0] + self.hip[1] * time,
            self.knee[0] + self.knee[1] * time,
        ]
    }

    /// Returns the commands of abduction at a time.
    #[inline(always)]
    pub fn abduction_at(&self, time: f64) -> JointCommand<L> {
        JointCommand {
            set_point: self.abduction[0] + self.abduction[1] * time,
            damping: self.damping[2],
        }
    }
}

//! Results of the comparison of a gait with its commands.

use twinrig_kernel::SimTime;

use crate::left_out::LeftOut;

/// Least share of the commanded step height that feet should lift: below half of it most of the
/// swing is not made, and the foot passes over half of the obstacles only that the gait is made
/// for.
pub const LIFT_SHARE_MIN: f64 = 0.5;

/// Greatest share of the time in which a drive should be saturated. In it the position loop is
/// open: the drive neither corrects its error nor rejects loads. Drives reach their torque–speed
/// line in bursts, as at touch-down: of the example gaits the one whose servos are too slow for it
/// has 68 %, the others at most 17 %.
pub const SATURATED_SHARE_MAX: f64 = 0.25;

/// Tracking of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackingReport {
    /// Time from which on it is evaluated: the end of the gait's ramp, or the first command.
    pub from: SimTime,
    /// Whether the run ended in the ramp, of which it is then.
    pub in_ramp: bool,
    /// Legs, in the robot's order.
    pub legs: Vec<TrackedLeg>,
    /// Numbers of a gait; none without one, and where nothing observes the trunk.
    pub similarity: Option<Similarity>,
    /// Parts that are not evaluated.
    pub left_out: Vec<LeftOut>,
}

/// Numbers by which gaits of different robots are compared (thesis, section 4.1.1), as those of
/// [`GaitMeasure`](crate::GaitMeasure); none where the robot did not advance, or made no stride.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Froude number \[1\].
    pub froude: Option<f64>,
    /// Strouhal number \[1\].
    pub strouhal: Option<f64>,
    /// Positive work of the drives over weight and distance \[1\].
    pub cost_of_transport: Option<f64>,
}

/// Tracking of a leg.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedLeg {
    /// Name.
    pub leg: String,
    /// Drives.
    pub drives: Vec<TrackedDrive>,
    /// Lift of the foot; none if it is unknown.
    pub lift: Option<TrackedLift>,
}

/// Tracking of a drive: command less position.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackedDrive {
    /// Name: `hip` or `knee`.
    pub drive: &'static str,
    /// Root mean square of the error \[rad\].
    pub rms: f64,
    /// Greatest magnitude of the error \[rad\].
    pub peak: f64,
    /// Its instant.
    pub peak_at: SimTime,
    /// Share of the time in which the drive was on its torque–speed line; none if it is unknown.
    pub saturated: Option<f64>,
}

/// Lift of a foot: its greatest clearance above the ground from one footstep to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackedLift {
    /// Commanded step height \[m\].
    pub commanded: f64,
    /// Mean \[m\].
    pub mean: f64,
    /// Least one \[m\].
    pub least: f64,
    /// Number of swings.
    pub count: u64,
}

impl TrackingReport {
    /// Names of the drives of a leg.
    pub const DRIVES: [&'static str; 2] = ["hip", "knee"];

    /// Returns warnings: feet that lift less than [`LIFT_SHARE_MIN`] of their commanded step
    /// height, and drives that are saturated for more than [`SATURATED_SHARE_MAX`] of the time.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if let Some((leg, lift)) = self.least_lift()
            && lift.mean < LIFT_SHARE_MIN * lift.commanded
        {
            warnings.push(format!(
                "the gait is not followed: {leg} lifts its foot by {:.1} mm, and {:.1} mm are commanded",
                lift.mean * 1e3,
                lift.commanded * 1e3
            ));
        }
        if let Some((leg, drive, share)) = self.most_saturated()
            && share > SATURATED_SHARE_MAX
        {
            warnings.push(format!(
                "the {drive} drive of {leg} is at its limit of torque and speed in {:.0} % of the time: take shorter or slower steps, or other drives by [actuator]",
                share * 100.0
            ));
        }
        warnings
    }

    /// Returns the leg with the least lift as a share of its step height.
    pub fn least_lift(&self) -> Option<(&str, TrackedLift)> {
        let lifts = self.legs.iter().filter_map(|leg| {
            let lift = leg.lift.filter(|lift| lift.commanded > 0.0)?;
            Some((leg.leg.as_str(), lift))
        });
        let share = |lift: &TrackedLift| lift.mean / lift.commanded;
        lifts.min_by(|(_, a), (_, b)| share(a).total_cmp(&share(b)))
    }

    /// Returns leg, drive and share of the drive that is saturated for the longest.
    pub fn most_saturated(&self) -> Option<(&str, &'static str, f64)> {
        let drives = self.legs.iter().flat_map(|leg| {
            let drives = leg.drives.iter();
            drives.filter_map(move |one| Some((leg.leg.as_str(), one.drive, one.saturated?)))
        });
        drives.max_by(|(.., a), (.., b)| a.total_cmp(b))
    }

    /// Returns the drives of one name with their legs.
    pub fn drives<'r>(
        &'r self,
        name: &'static str,
    ) -> impl Iterator<Item = (&'r str, &'r TrackedDrive)> {
        let drives = self.legs.iter().flat_map(|leg| {
            let drives = leg.drives.iter();
            drives.map(move |drive| (leg.leg.as_str(), drive))
        });
        drives.filter(move |(_, drive)| drive.drive == name)
    }
}

//! Checks between parts of a scenario: times against the duration of the run, periods against the
//! observed phenomena, frequencies against the control rate. Without them a run could pass because
//! nothing was observed or nothing occurred.

use twinrig_document::{Item, Place, Reported, Table};
use twinrig_kernel::{SimDuration, SimTime, Unit};
use twinrig_runtime::Timing;

use crate::catalogue::VariableSpec;
use crate::expect::{Claim, Expectation};
use crate::scenario::{ControllerSpec, FootstepSpec, IoSpec, PlantSpec};
use twinrig_runtime::Coupling;

/// Codes of warnings; programs rely on them.
pub(crate) mod code {
    pub const COMPUTE_TIME: &str = "compute-time-above-period";
    pub const TRANSFER_TIME: &str = "transfer-time-above-step";
    pub const CHANGE: &str = "change-beyond-end";
    pub const DELAY: &str = "delay-beyond-run";
    pub const FAULT: &str = "fault-beyond-end";
    pub const SURFACE: &str = "surface-beyond-end";
    pub const PUSH: &str = "push-beyond-end";
    pub const WITHIN: &str = "within-beyond-end";
    pub const BY: &str = "by-beyond-end";
    pub const LAG: &str = "lag-beyond-run";
    pub const RAMP: &str = "ramp-beyond-run";
    pub const FREQUENCY: &str = "no-frequency";
    pub const UNTIL: &str = "until-before-expectations";
    pub const UNTIL_BEYOND: &str = "until-beyond-end";
    pub const NOTHING_EXPECTED: &str = "nothing-expected";
    pub const EXACT: &str = "exact-beyond-horizon";
    pub const LONG_RUN: &str = "long-run";
    pub const STEP: &str = "step-above-observation";
}

/// Longest observation period of the trunk, which falls 2 mm in it.
const MAX_PERIOD_FOR_BODY: SimDuration = SimDuration::from_millis(20);
/// Number of steps, observations and control steps from which a run is long: an hour at a
/// microsecond each.
const LONG_RUN_STEPS: u128 = 3_600_000_000;
/// Longest observation period of footsteps without a shortest swing: that of the default.
const MAX_PERIOD_FOR_FEET: SimDuration = SimDuration::from_millis(10);

/// Parts of a scenario that are checked against each other.
pub(super) struct ScenarioChecks<'s> {
    pub duration: SimDuration,
    pub observe: SimDuration,
    pub footsteps: &'s FootstepSpec,
    pub plant: &'s PlantSpec,
    pub controller: Option<&'s ControllerSpec>,
    pub io: &'s IoSpec,
    pub expectations: &'s [Expectation],
    pub of_other_plants: usize,
}

impl ScenarioChecks<'_> {
    /// Reports errors and warns about probable mistakes.
    pub fn check(&self, table: &Table<'_>) -> Result<(), Reported> {
        self.warn(table);
        let control = self.control_period(table);
        let observation = self.observation_period(table);
        control.and(observation)
    }

    fn control_period(&self, table: &Table<'_>) -> Result<(), Reported> {
        let Some(control) = self.controller else {
            return Ok(());
        };
        if control.period <= self.duration {
            return Ok(());
        }
        let message = format!(
            "the controller's period, {}, is longer than the run",
            print_duration(control.period)
        );
        let help = format!("the run lasts {}", print_duration(self.duration));
        Err(table.report_at(&place(table, &["controller", "period"]), message, help))
    }

    fn observation_period(&self, table: &Table<'_>) -> Result<(), Reported> {
        let period = print_duration(self.observe);
        let (longest, reason) = self.longest_observation();
        let message = if self.observe > self.duration {
            format!("the observation period, {period}, is longer than the run")
        } else if self.observe > longest {
            format!("an observation period of {period} is too long for {reason}")
        } else {
            return Ok(());
        };
        let remedy = self.suggested_observation_period(longest);
        let help = format!("write [observe] period = \"{}\"", print_duration(remedy));
        let help = match self.plant.coupling {
            Coupling::Grid { step, .. } if !remedy.is_multiple_of(step) => {
                format!("{help}, and a grid that divides it")
            }
            _ => help,
        };
        let explicit = table.get("observe").and_then(|item| item.peek("period"));
        let position = match explicit {
            Some(period) => period.place(),
            None if self.observe > self.duration => table.key_place("duration"),
            None => place(table, &["footsteps", "shortest_swing"]),
        };
        Err(table.report_at(&position, message, help))
    }

    /// Returns the longest observation period that the expectations allow, and the reason.
    fn longest_observation(&self) -> (SimDuration, String) {
        let mut longest = (SimDuration::MAX, String::new());
        for expectation in self.expectations {
            let (limit, reason) = match expectation.claim {
                Claim::Footstep(_) => (
                    longest_for_footsteps(self.footsteps),
                    format!(
                        "footsteps separated by a `shortest_swing` of {}",
                        print_duration(self.footsteps.shortest_swing)
                    ),
                ),
                Claim::Body(_) => (MAX_PERIOD_FOR_BODY, "the motion of the body".to_owned()),
                _ => continue,
            };
            if limit < longest.0 {
                longest = (limit, reason);
            }
        }
        longest
    }

    /// Returns an observation period that passes all checks and gives each expectation the required
    /// number of samples.
    fn suggested_observation_period(&self, longest: SimDuration) -> SimDuration {
        let windows = self.expectations.iter().map(|expectation| {
            let before = expectation
                .before
                .map_or(self.duration, SimTime::since_start);
            let window = before.checked_sub(expectation.after.since_start());
            window.unwrap_or(self.duration)
        });
        let window = windows.min().unwrap_or(self.duration).min(self.duration);
        let nanos = longest.min(window / 10).as_nanos().max(1);
        let step = match self.plant.coupling {
            Coupling::Grid { step, .. } if step.as_nanos() <= nanos => step.as_nanos(),
            _ => leading_power_of_ten(nanos),
        };
        SimDuration::from_nanos(nanos / step * step)
    }

    fn warn(&self, table: &Table<'_>) {
        if let Some(control) = self.controller {
            let mean = mean(&control.compute_time);
            if mean > control.period {
                table.warn_at(
                    &place(table, &["controller", "compute_time"]),
                    code::COMPUTE_TIME,
                    format!(
                        "computing takes {}, longer than the period",
                        print_duration(mean)
                    ),
                    format!(
                        "the period is {}: the controller misses deadlines continually",
                        print_duration(control.period)
                    ),
                );
            }
        }
        self.warn_of_ramp(table);
        self.warn_of_no_frequency(table);
        let mean = mean(&self.io.transfer_time);
        if mean > self.io.step {
            table.warn_at(
                &place(table, &["io", "transfer_time"]),
                code::TRANSFER_TIME,
                format!(
                    "a transfer takes {}, longer than the step",
                    print_duration(mean)
                ),
                format!(
                    "the step is {}: transfers are skipped continually",
                    print_duration(self.io.step)
                ),
            );
        }
        self.warn_of_long_run(table);
        self.warn_of_step(table);
        if self.expectations.is_empty() && self.of_other_plants > 0 {
            table.warn_at(
                &place(table, &["plant", "model"]),
                code::NOTHING_EXPECTED,
                format!("no expectation applies to the plant `{}`", self.plant.model),
                "this run cannot fail: add an [[expect]], or add the plant to the `plants` of one",
            );
        }
    }
}

impl ScenarioChecks<'_> {
    /// Warns about a gait that has no cycle. Any change may be one of its frequency.
    fn warn_of_no_frequency(&self, table: &Table<'_>) {
        let mut variables = self.controller.iter().flat_map(|it| &it.variables);
        let stands = variables.any(|(name, value)| name == "frequency" && *value == 0.0);
        if !stands || table.get("change").is_some() {
            return;
        }
        table.warn_at(
            &place(table, &["controller", "frequency"]),
            code::FREQUENCY,
            "the frequency is 0 Hz, and nothing changes it".to_owned(),
            "give a greater one, or a [[change]] of it".to_owned(),
        );
    }

    /// Warns about a gait whose steps do not reach their length.
    fn warn_of_ramp(&self, table: &Table<'_>) {
        let variables = self.controller.iter().flat_map(|it| &it.variables);
        let ramp = variables.clone().find(|(name, _)| name == "ramp");
        let Some((_, ramp)) = ramp.filter(|(_, ramp)| *ramp > self.duration.as_secs_f64()) else {
            return;
        };
        table.warn_at(
            &place(table, &["controller", "ramp"]),
            code::RAMP,
            format!("the ramp of {ramp} s is longer than the run"),
            format!(
                "the run lasts {}: steps do not reach their length",
                print_duration(self.duration)
            ),
        );
    }

    /// Warns about a step of the plant that the instants of observation divide.
    fn warn_of_step(&self, table: &Table<'_>) {
        let (limit, remedy, label) = match self.plant.coupling {
            Coupling::Grid { step, .. } => {
                (step, "write a longer `grid`", "the communication grid")
            }
            Coupling::Exact => (
                self.observe,
                "give [observe] a longer `period`",
                "the period of observation",
            ),
        };
        let Some(step) = self.plant.step.filter(|step| *step > limit) else {
            return;
        };
        let limit = print_duration(limit);
        table.warn_at(
            &place(table, &["plant", "step"]),
            code::STEP,
            format!(
                "the step of {} is longer than {label}, {limit}: the plant steps by {limit} at most",
                print_duration(step)
            ),
            format!("write `step = \"{limit}\"`, or {remedy}"),
        );
    }

    /// Warns about a run that takes hours or days, from the number of its steps.
    fn warn_of_long_run(&self, table: &Table<'_>) {
        let step = self.plant.step.unwrap_or(self.observe);
        let (step, of_plant) = match self.plant.coupling {
            Coupling::Grid { step: grid, .. } if grid < step => {
                (grid, &["plant", "coupling", "grid"][..])
            }
            _ => (step, &["plant", "step"][..]),
        };
        let control = self.controller.map_or(self.io.step, |it| it.period);
        let periods = [
            (self.observe, &["observe", "period"][..], "observations"),
            (step, of_plant, "steps of the plant"),
            (control, &["controller", "period"], "control steps"),
        ];
        let count = |period: SimDuration| self.duration.as_nanos() / period.as_nanos().max(1);
        let total: u128 = periods
            .iter()
            .map(|(period, ..)| u128::from(count(*period)))
            .sum();
        if total < LONG_RUN_STEPS {
            return;
        }
        // The first of equal counts.
        let dominant = periods
            .iter()
            .rev()
            .max_by_key(|(period, ..)| count(*period));
        let Some((period, keys, label)) = dominant else {
            return;
        };
        let hours = total as f64 / 3.6e9;
        let time = if hours < 48.0 {
            format!("{hours:.1} hours")
        } else {
            format!("{:.0} days", hours / 24.0)
        };
        table.warn_at(
            &place(table, keys),
            code::LONG_RUN,
            format!(
                "the run has {:.0e} {label}, one every {}",
                count(*period) as f64,
                print_duration(*period)
            ),
            format!("the run takes {time} at 1 us each, which most exceed"),
        );
    }
}

/// Returns message and remedy if `value` of `variable` is a frequency above the Nyquist limit of
/// the control rate.
pub(super) fn above_nyquist(
    variable: &VariableSpec,
    value: f64,
    period: SimDuration,
) -> Option<(String, String)> {
    let greatest = 0.5 / period.as_secs_f64();
    // A period that is rounded to whole nanoseconds may shift the limit.
    if variable.unit != Unit::Hertz || value.abs() <= greatest * (1.0 + 1e-9) {
        return None;
    }
    let message = format!(
        "`{}` is {value} Hz, above half of the control rate",
        variable.name
    );
    let help = format!(
        "a controller with a period of {} samples up to {greatest} Hz",
        print_duration(period)
    );
    Some((message, help))
}

/// Returns the position of the value at a path of keys, or of the longest existing prefix of the
/// path.
fn place(table: &Table<'_>, keys: &[&str]) -> Place {
    let [first, rest @ ..] = keys else {
        return table.place();
    };
    let mut found: Option<Item<'_>> = table.get(first);
    for key in rest {
        let deeper = found.as_ref().and_then(|item| item.peek(key));
        found = deeper.or(found);
    }
    found.map_or_else(|| table.key_place("duration"), |item| item.place())
}

fn longest_for_footsteps(footsteps: &FootstepSpec) -> SimDuration {
    let quarter = footsteps.shortest_swing / 4;
    if quarter.is_zero() {
        MAX_PERIOD_FOR_FEET
    } else {
        quarter
    }
}

fn mean(model: &Timing) -> SimDuration {
    match model {
        Timing::Constant(time) | Timing::Normal { mean: time, .. } => *time,
        Timing::Uniform { min, max } => {
            SimDuration::from_nanos(min.as_nanos().midpoint(max.as_nanos()))
        }
        Timing::Trace(times) => {
            let sum: u128 = times.iter().map(|time| u128::from(time.as_nanos())).sum();
            let mean = sum / times.len().max(1) as u128;
            SimDuration::from_nanos(u64::try_from(mean).unwrap_or(u64::MAX))
        }
    }
}

/// Returns the largest power of ten that does not exceed `nanos`, to round down to one digit.
fn leading_power_of_ten(nanos: u64) -> u64 {
    nanos
        .checked_ilog10()
        .map_or(1, |digits| 10_u64.pow(digits))
}

/// Returns a duration in the notation of a scenario, in the largest unit that leaves no fraction.
pub fn print_duration(duration: SimDuration) -> String {
    let nanos = duration.as_nanos();
    let units = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")];
    let fits = |(size, _): &&(u64, &str)| nanos.is_multiple_of(*size);
    let (size, unit) = units.iter().find(fits).unwrap_or(&(1, "ns"));
    format!("{} {unit}", nanos / size)
}

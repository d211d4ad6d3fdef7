//! Results of a study of gait transitions.

use serde::Serialize;
use serde_json::{Value, json};
use twinrig_kernel::Unit;
use twinrig_report::number::plain;

use super::classify::cycles;
use super::events::{hysteresis, transitions, value_at};
use super::{
    GaitCycle, Hysteresis, MIXED, Transition, TransitionCase, TransitionInput, TransitionPlan,
};
use crate::gait::run::{GaitRun, MotionSample};
use crate::machine::Machine;

/// Interval over which speed and slip are given \[s\].
const BIN_S: f64 = 1.0;

/// Agreement of the classes by loads and by oscillators, in the cycles outside of transitions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ClassAgreement {
    /// Number of cycles with both classes.
    pub cycles: usize,
    /// Number of those with one class.
    pub agreeing: usize,
}

impl ClassAgreement {
    /// Returns the share of the agreeing cycles; none without cycles.
    pub fn share(&self) -> Option<f64> {
        (self.cycles > 0).then(|| self.agreeing as f64 / self.cycles as f64)
    }
}

/// Results of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct TransitionResult {
    /// Plant and plateaus.
    pub case: TransitionCase,
    /// The run; empty if it failed.
    pub run: GaitRun,
    /// Cycles of the loads and times without them, in order.
    pub cycles: Vec<GaitCycle>,
    /// Transitions between gaits.
    pub transitions: Vec<Transition>,
    /// Values at which pairs of gaits change.
    pub hysteresis: Vec<Hysteresis>,
    /// Speed of the trunk along its heading over each second: middle of the second \[s\], \[m/s\].
    /// Below zero it moves backwards.
    pub speeds: Vec<[f64; 2]>,
    /// Path of the feet on the ground in each second: its middle \[s\], \[m/s\].
    pub slips: Vec<[f64; 2]>,
    /// Reason of a run without results.
    pub why: Option<String>,
}

impl TransitionResult {
    pub(crate) fn new(
        case: &TransitionCase,
        run: Result<GaitRun, String>,
        input: &TransitionInput,
        plan: &TransitionPlan,
    ) -> Self {
        let (run, why) = match run {
            Ok(run) => (run, None),
            Err(why) => (GaitRun::default(), Some(why)),
        };
        let cycles = if why.is_none() {
            classified(&run, case, input, plan)
        } else {
            Vec::new()
        };
        let transitions = transitions(&run, &cycles, plan.lasting, &case.values);
        let seconds = seconds(&run);
        Self {
            case: case.clone(),
            hysteresis: hysteresis(&transitions),
            transitions,
            speeds: seconds
                .iter()
                .map(|&[at_s, speed, _]| [at_s, speed])
                .collect(),
            slips: seconds
                .iter()
                .map(|&[at_s, _, slip]| [at_s, slip])
                .collect(),
            cycles,
            run,
            why,
        }
    }

    /// Returns the classes with the time in each \[s\], the longest first.
    pub fn shares(&self) -> Vec<(&str, f64)> {
        let mut shares: Vec<(&str, f64)> = Vec::new();
        for cycle in &self.cycles {
            let lasted = cycle.end_s - cycle.begin_s;
            match shares.iter_mut().find(|(class, _)| *class == cycle.class) {
                Some((_, sum)) => *sum += lasted,
                None => shares.push((&cycle.class, lasted)),
            }
        }
        shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        shares
    }

    /// Returns the agreement of loads and oscillators.
    pub fn agreement(&self) -> ClassAgreement {
        let changes = |cycle: &GaitCycle| {
            let mut transitions = self.transitions.iter();
            transitions.any(|one| {
                let until_s = one.established_s.unwrap_or(f64::INFINITY);
                cycle.begin_s < until_s && one.begin_s < cycle.end_s
            })
        };
        let cycles = self.cycles.iter().filter(|cycle| !changes(cycle));
        let both = cycles.filter_map(|cycle| Some(cycle.oscillators.as_ref()? == &cycle.class));
        let mut agreement = ClassAgreement::default();
        for agrees in both {
            agreement.cycles += 1;
            agreement.agreeing += usize::from(agrees);
        }
        agreement
    }

    /// Returns the mean number of contacts of a leg in a cycle; none without cycles.
    pub fn contacts(&self) -> Option<f64> {
        let contacts = self.cycles.iter().filter_map(|cycle| cycle.contacts);
        let (count, sum) = contacts.fold((0.0, 0.0), |(count, sum), one| (count + 1.0, sum + one));
        (count > 0.0).then(|| sum / count)
    }

    /// Returns the second with the most slip: its middle \[s\], \[m/s\].
    pub fn worst_slip(&self) -> Option<[f64; 2]> {
        let slips = self.slips.iter();
        slips.max_by(|a, b| a[1].total_cmp(&b[1])).copied()
    }
}

/// Classifies the cycles of a run.
fn classified(
    run: &GaitRun,
    case: &TransitionCase,
    input: &TransitionInput,
    plan: &TransitionPlan,
) -> Vec<GaitCycle> {
    let mut cycles = cycles(run, &input.patterns, plan.tolerance);
    for cycle in &mut cycles {
        cycle.value = value_at(&case.values, cycle.begin_s);
    }
    cycles
}

/// Returns the middle of each second \[s\] with the speed of the trunk along the heading that it
/// has at the begin of the second, as the claim `body.speed` defines it, and the slip of the feet.
fn seconds(run: &GaitRun) -> Vec<[f64; 3]> {
    let mut found = Vec::new();
    let mut from: Option<MotionSample> = None;
    for &to in &run.motion {
        let begin = *from.get_or_insert(to);
        let elapsed_s = to.at_s - begin.at_s;
        if elapsed_s >= BIN_S - 1e-9 {
            let [dx, dy] = [0, 1].map(|axis| to.trunk_m[axis] - begin.trunk_m[axis]);
            let way = dx * libm::cos(begin.yaw_rad) + dy * libm::sin(begin.yaw_rad);
            let slip = to.slip_m - begin.slip_m;
            let middle_s = f64::midpoint(begin.at_s, to.at_s);
            found.push([middle_s, way / elapsed_s, slip / elapsed_s]);
            from = Some(to);
        }
    }
    found
}

/// Results of a study of transitions, without the machine it ran on.
#[derive(Clone, Debug, PartialEq)]
pub struct TransitionStudy {
    /// Subject of the study.
    pub input: TransitionInput,
    /// Its parameters.
    pub plan: TransitionPlan,
    /// Results of each run.
    pub cases: Vec<TransitionResult>,
}

/// Row of the CSV file.
#[derive(Serialize)]
struct CsvRow<'a> {
    plant: &'a str,
    plateau_s: f64,
    begin_s: f64,
    end_s: f64,
    class: &'a str,
    oscillators: Option<&'a str>,
    contacts: Option<f64>,
    deviation: Option<f64>,
    phases: &'a [f64],
    oscillator_phases: &'a [f64],
    value: f64,
    slip_m: f64,
}

impl TransitionStudy {
    /// Returns a value of the variable with its unit.
    pub fn value_text(&self, value: f64) -> String {
        match self.input.unit {
            Unit::One => plain(value),
            unit => format!("{} {}", plain(value), unit.symbol()),
        }
    }

    /// Returns the name of a run: plant, and plateau if there are several.
    pub fn label(&self, result: &TransitionResult) -> String {
        let first = self.cases.first().map(|it| it.case.plateau_s);
        let several = self.cases.iter().any(|it| Some(it.case.plateau_s) != first);
        if several {
            format!(
                "{}, plateaus of {} s",
                result.case.plant,
                plain(result.case.plateau_s)
            )
        } else {
            result.case.plant.clone()
        }
    }

    /// Returns a summary that agrees with the tables.
    pub fn headline(&self) -> String {
        let sentences = self.cases.iter().map(|result| {
            let label = self.label(result);
            if let Some(why) = &result.why {
                return format!("{label}: {why}.");
            }
            let mut parts: Vec<String> = result
                .transitions
                .iter()
                .map(|it| self.phrase(it))
                .collect();
            if parts.is_empty() {
                let first = result.shares().first().map(|(class, _)| *class);
                parts.push(format!("no transition, mostly {}", first.unwrap_or(MIXED)));
            }
            if let Some(at_s) = result.run.fell_at_s {
                parts.push(format!("falls at {at_s:.1} s"));
            }
            format!("{label}: {}.", parts.join("; "))
        });
        sentences.collect::<Vec<_>>().join(" ")
    }

    fn phrase(&self, transition: &Transition) -> String {
        let Transition { from, to, .. } = transition;
        let until = transition.established_s;
        let until = until.map_or(String::new(), |until| format!(" to {until:.1}"));
        let value = self.value_text(transition.value);
        format!(
            "{from} → {to} at {:.1}{until} s ({value})",
            transition.begin_s
        )
    }

    /// Returns the study as JSON, with the machine it ran on and the command that repeats it.
    pub fn json(&self, machine: &Machine, command: &str) -> Value {
        let cases = self.cases.iter().map(|result| {
            let shares = result.shares().into_iter();
            let shares = shares.map(|(class, seconds)| (class.to_owned(), json!(seconds)));
            json!({
                "plant": result.case.plant,
                "plateau_s": result.case.plateau_s,
                "values": result.case.values,
                "fell_at_s": result.run.fell_at_s,
                "end_s": result.run.end_s,
                "transitions": result.transitions,
                "hysteresis": result.hysteresis,
                "seconds": Value::Object(shares.collect()),
                "agreement": result.agreement(),
                "contacts": result.contacts(),
                "speeds": result.speeds,
                "slips": result.slips,
                "why": result.why,
            })
        });
        json!({
            "study": "transition",
            "scenario": self.input.name,
            "file": self.input.file,
            "machine": machine,
            "command": command,
            "variable": self.input.variable,
            "unit": self.input.unit.symbol(),
            "tolerance": self.plan.tolerance,
            "lasting": self.plan.lasting,
            "patterns": self.input.patterns,
            "headline": self.headline(),
            "cases": cases.collect::<Vec<_>>(),
            "left_out": self.input.left_out,
        })
    }

    /// Returns the cycles of all runs as comma-separated values.
    pub fn csv(&self) -> String {
        let rows = self.cases.iter().flat_map(|result| {
            result.cycles.iter().map(|cycle| CsvRow {
                plant: &result.case.plant,
                plateau_s: result.case.plateau_s,
                begin_s: cycle.begin_s,
                end_s: cycle.end_s,
                class: &cycle.class,
                oscillators: cycle.oscillators.as_deref(),
                contacts: cycle.contacts,
                deviation: cycle.deviation,
                phases: &cycle.phases,
                oscillator_phases: &cycle.oscillator_phases,
                value: cycle.value,
                slip_m: cycle.slip_m,
            })
        });
        crate::csv::table(&rows.collect::<Vec<_>>(), "", &[])
    }
}

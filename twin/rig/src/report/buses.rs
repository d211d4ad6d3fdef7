//! Traffic of the buses of a run, as text and in its serialised form.

use serde::{Serialize, Serializer};
use twinrig_kernel::HostTime;
use twinrig_runtime::BusSummary;

use crate::report::seconds;

/// Traffic of a bus, and the control steps at which it was busy beyond what the periods imply.
#[derive(Clone, Debug)]
pub struct BusReport {
    /// The bus.
    pub bus: BusSummary,
    /// Transfers that had not ended at a control step.
    pub skipped: u64,
}

#[derive(Serialize)]
struct Written<'a> {
    name: &'a str,
    clean: bool,
    packets: u64,
    answers: u64,
    errors: Vec<WrittenError<'a>>,
    late: Vec<WrittenLate<'a>>,
    stale: u64,
    missed_points: u64,
    skipped: u64,
    silence: Option<WrittenSilence<'a>>,
}

#[derive(Serialize)]
struct WrittenError<'a> {
    kind: &'static str,
    device: &'a str,
    count: u64,
    first_s: f64,
}

#[derive(Serialize)]
struct WrittenLate<'a> {
    device: &'a str,
    count: u64,
    first_s: f64,
    worst_s: f64,
}

#[derive(Serialize)]
struct WrittenSilence<'a> {
    device: &'a str,
    since_s: f64,
    length_s: f64,
    period_s: f64,
    dead: bool,
}

impl Serialize for BusReport {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let health = &self.bus.health;
        let errors = health.errors.iter().map(|error| WrittenError {
            kind: error.kind,
            device: &error.device,
            count: error.count,
            first_s: instant_s(error.first),
        });
        let late = health.late.iter().map(|late| WrittenLate {
            device: &late.device,
            count: late.count,
            first_s: instant_s(late.first),
            worst_s: late.worst.as_secs_f64(),
        });
        let silence = health.silence.as_ref().map(|silence| WrittenSilence {
            device: &silence.device,
            since_s: instant_s(silence.since),
            length_s: silence.length.as_secs_f64(),
            period_s: silence.period.as_secs_f64(),
            dead: silence.is_dead(),
        });
        Written {
            name: &self.bus.name,
            clean: self.is_clean(),
            packets: health.packets,
            answers: health.answers,
            errors: errors.collect(),
            late: late.collect(),
            stale: health.stale,
            missed_points: health.missed_points,
            skipped: self.skipped,
            silence,
        }
        .serialize(serializer)
    }
}

fn instant_s(at: HostTime) -> f64 {
    seconds(at.as_nanos())
}

/// Returns the message for transfers of `task` that had not ended at a control step.
pub(crate) fn skips(task: &str, skipped: u64) -> String {
    format!("{task}: busy at {skipped} control steps: its transfers last longer than its period")
}

impl BusReport {
    /// Returns whether nothing was wrong with its traffic and its timing.
    pub fn is_clean(&self) -> bool {
        self.skipped == 0 && self.bus.health.is_clean()
    }

    /// Returns what was wrong, in the order of the columns; empty for a clean bus.
    fn faults(&self) -> Vec<String> {
        let health = &self.bus.health;
        let mut faults = Vec::new();
        for error in &health.errors {
            let device = match error.device.as_str() {
                "" => String::new(),
                device => format!("{device}, "),
            };
            let (count, kind, first) = (error.count, error.kind, instant_s(error.first));
            faults.push(format!("{count} × {kind} ({device}first at {first:.3} s)"));
        }
        for late in &health.late {
            let (count, device, worst) = (late.count, &late.device, late.worst);
            let first = instant_s(late.first);
            faults.push(format!(
                "{count} × late by up to {worst} ({device}, first at {first:.3} s)"
            ));
        }
        for (count, what) in [
            (health.stale, "answers of an earlier cycle taken"),
            (health.missed_points, "missed points"),
            (self.skipped, "control steps at which it was busy"),
        ] {
            if count > 0 {
                faults.push(format!("{count} {what}"));
            }
        }
        if let Some(silence) = health.silence.as_ref().filter(|it| it.is_dead()) {
            faults.push(format!("dead: {silence}"));
        }
        faults
    }

    /// Returns the line of a report.
    pub fn line(&self) -> String {
        let health = &self.bus.health;
        let mut parts = vec![format!(
            "{} packets, {} answers",
            health.packets, health.answers
        )];
        let faults = self.faults();
        if faults.is_empty() {
            parts.push("no errors".to_owned());
        }
        parts.extend(faults);
        if let Some(silence) = health.silence.as_ref().filter(|it| !it.is_dead()) {
            let (length, period) = (silence.length, silence.period);
            parts.push(format!("longest silence {length} of {period}"));
        }
        parts.join("; ")
    }

    /// Returns the warning about a bus that is not clean.
    pub(crate) fn warning(&self) -> Option<String> {
        let name = &self.bus.name;
        (!self.is_clean()).then(|| format!("bus {name}: {}", self.faults().join("; ")))
    }
}

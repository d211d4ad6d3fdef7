//! Schedule of processes and transfers (section 5.2.2.3).

use twinrig_kernel::{SimDuration, SimTime};
use twinrig_runtime::{Group, Observer, RunEvent};

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Rule};

const COUNT: Rule = Rule::Within(0.0);
const A_COUNT: &str = "a count";

pub(crate) const FIG_5_3: Item = Item {
    id: "fig-5-3",
    title: "Schedule of processes and transfers",
    place: "5.2.2.3, figure 5.3",
    run_s: 0.1,
    figures: &[
        PrintedFigure::value(
            "elapsed",
            "steps told to the iteration after an overrun",
            "5.2.2.3, figure 5.3",
            2.0,
            "",
        )
        .rule(COUNT, A_COUNT)
        .remark("the iteration before takes 1.25 steps, and misses one"),
        PrintedFigure::value(
            "skipped",
            "steps with the old inputs of a late transfer",
            "5.2.2.3, figure 5.3",
            1.0,
            "",
        )
        .rule(COUNT, A_COUNT)
        .remark("a transfer takes 1.1 steps"),
    ],
    sources: &[Source::rest(
        Basis::Given,
        &[Input::Set(
            "the printed rule, which the executor implements",
        )],
    )],
    measure: fig_5_3,
    commands: &["cargo test -p twinrig-runtime --test runtime scheduling"],
};

/// Elapsed times after overruns, and steps for which tasks were skipped.
#[derive(Default)]
struct ScheduleObserver {
    has_overrun: bool,
    elapsed: Vec<SimDuration>,
    /// Consecutive skips of a task, and the greatest number of them.
    skips: u64,
    most_skips: u64,
}

impl Observer for ScheduleObserver {
    fn samples(&mut self, _: SimTime, _: Group, _: &[f64]) {}

    fn event(&mut self, _: SimTime, event: RunEvent) {
        match event {
            RunEvent::Overrun { .. } => self.has_overrun = true,
            RunEvent::ProcessBegin { elapsed } => {
                let after_overrun = std::mem::take(&mut self.has_overrun);
                self.elapsed.extend(after_overrun.then_some(elapsed));
            }
            RunEvent::TaskSkipped { .. } => {
                self.skips += 1;
                self.most_skips = self.most_skips.max(self.skips);
            }
            RunEvent::TaskEnd { .. } => self.skips = 0,
            _ => {}
        }
    }
}

/// Runs the standing robot with modelled times, and returns what its schedule was.
fn schedule(
    context: &Context<'_>,
    key: &str,
    trace: &str,
) -> Result<(ScheduleObserver, SimDuration), TwinError> {
    let value = format!("{{ trace = {trace} }}");
    let assembly = context.assembly_with("stand.toml", &[(key, &value)], "")?;
    let mut observer = ScheduleObserver::default();
    let mut rig = assembly.rig()?;
    let end = SimTime::ZERO + SimDuration::from_millis(100);
    let ran = rig.run_until(end, &mut observer);
    ran.map_err(|error| assembly.rig_error(error))?;
    Ok((observer, assembly.period()))
}

fn fig_5_3(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let slow = r#"["0.5 ms", "0.5 ms", "2.5 ms"]"#;
    let (observed, period) = schedule(context, "controller.compute_time", slow)?;
    let steps = |elapsed: &SimDuration| elapsed.as_secs_f64() / period.as_secs_f64();
    let told: Vec<f64> = observed.elapsed.iter().map(steps).collect();
    if let (Some(&first), true) = (told.first(), told.windows(2).all(|two| two[0] == two[1])) {
        found.set("elapsed", first);
    }
    let late = r#"["0.3 ms", "0.3 ms", "2.2 ms"]"#;
    let (observed, _) = schedule(context, "io.transfer_time", late)?;
    if observed.most_skips > 0 {
        found.set("skipped", observed.most_skips as f64);
    }
    Ok(found)
}

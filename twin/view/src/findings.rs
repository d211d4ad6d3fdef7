//! Findings of a run besides its expectations: warnings, and how its drives follow their commands.

use twinrig_report::page::Block;
use twinrig_report::table::{Cell, Column, Table, Tone};
use twinrig_scenario::{LIFT_SHARE_MIN, SATURATED_SHARE_MAX, TrackingReport};

use crate::link::instant;
use crate::run::Run;

/// Returns the findings of a run and its index; none without a repetition.
pub(crate) fn findings((number, run): (usize, &Run<'_>)) -> Vec<Block> {
    let Some(report) = run.repetition().map(|it| &it.report) else {
        return Vec::new();
    };
    let mut blocks = Vec::new();
    let warnings = report.run_warnings();
    if !warnings.is_empty() {
        let mut table = Table::new([Column::label("warning")]);
        for warning in warnings {
            table.row([warning.into()]);
        }
        blocks.push(Block::Table(table));
    }
    let tracking = report.tracking.as_ref();
    if let Some(tracking) = tracking.filter(|it| it.legs.iter().any(|leg| !leg.drives.is_empty())) {
        blocks.push(Block::Table(drives(number, tracking)));
    }
    blocks
}

/// Returns the table of the drives: their errors, and the lift of the feet.
fn drives(run: usize, tracking: &TrackingReport) -> Table {
    let part = if tracking.in_ramp {
        ", in the ramp"
    } else {
        ""
    };
    let mut table = Table::new([
        Column::label("leg"),
        Column::label("drive"),
        Column::text(format!("tracking error, rms{part}")),
        Column::text("greatest"),
        Column::text("at"),
        Column::text("at its limit of torque and speed"),
        Column::text("lift of the foot"),
    ]);
    for leg in &tracking.legs {
        for (number, drive) in leg.drives.iter().enumerate() {
            let [rms, peak] = [drive.rms, drive.peak].map(|it| format!("{:.1}°", it.to_degrees()));
            let at = drive.peak_at.as_secs_f64();
            let tone = |bad: bool| if bad { Tone::Bad } else { Tone::Plain };
            let saturated = drive.saturated.map(|share| {
                let text = format!("{:.1} % of the time", share * 100.0);
                Cell::from(text).with_tone(tone(share > SATURATED_SHARE_MAX))
            });
            let lift = leg.lift.filter(|_| number == 0).map(|lift| {
                let [mean, commanded] = [lift.mean, lift.commanded].map(|it| it * 1e3);
                let text = format!("{mean:.1} mm of {commanded:.1} mm");
                Cell::from(text).with_tone(tone(lift.mean < LIFT_SHARE_MIN * lift.commanded))
            });
            table.row([
                leg.leg.as_str().into(),
                drive.drive.into(),
                rms.into(),
                peak.into(),
                instant(run, at),
                saturated.unwrap_or_default(),
                lift.unwrap_or_default(),
            ]);
        }
    }
    table
}

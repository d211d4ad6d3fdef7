//! Page section on the error of error-controlled methods over their tolerance.

use twinrig_report::number::power;
use twinrig_report::page::Block;
use twinrig_report::table::{Column, Table};

use crate::plants::study::Study;

/// Returns the section: slopes of log error over log tolerance.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    let slopes = study.tolerance_slopes();
    if slopes.is_empty() {
        return Vec::new();
    }
    let slope = |name: &str| Column::number(name).with_places(2);
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("method"),
        slope("feet"),
        slope("trunk"),
        slope("worst foot to hip"),
        Column::number("tolerances"),
        Column::number("from"),
        Column::number("to"),
    ]);
    for slope in &slopes {
        table.row([
            slope.plant.label().into(),
            slope.method.as_str().into(),
            slope.feet.into(),
            slope.trunk.into(),
            slope.foot_to_hip.into(),
            slope.points.into(),
            power(slope.range[0], 2).into(),
            power(slope.range[1], 2).into(),
        ]);
    }
    vec![
        Block::heading("Error against tolerance"),
        Block::text(
            "Slope of the logarithm of the error over that of the tolerance, by least squares, \
             from tolerances of 10⁻⁸ to 10⁻⁵, without errors at the floor: 1 where the error is \
             proportional to the tolerance, 0 where a tighter tolerance gains nothing.",
        ),
        Block::Table(table),
    ]
}

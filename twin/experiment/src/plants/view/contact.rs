//! Page section on the contact of the feet.

use twinrig_report::number::method_setting;
use twinrig_report::page::Block;
use twinrig_report::table::{Cell, Column, Table};

use super::rows;
use crate::plants::contact::ContactResiduals;
use crate::plants::study::Study;

/// Returns the section: penetration at rest and residuals in the gait.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    if study.contacts.is_empty() {
        return Vec::new();
    }
    let number = |name: &str, unit: &str| Column::number(name).in_unit(unit);
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("method"),
        number("load at rest", "N"),
        number("penetration", "m"),
        number("load / k", "m"),
        Column::number("stiffness realised"),
        number("Signorini", "J"),
        number("greatest penetration", "m"),
        number("Coulomb", "N"),
        number("along slip", "J"),
        number("created", "J"),
        number("dissipated", "J"),
        Column::reason(),
    ]);
    for one in &study.contacts {
        let setting = method_setting(one.key.step_s, one.key.tolerance);
        let method = Cell::from(one.key.method.as_str()).with_detail(setting);
        let names = [one.key.plant.label().into(), method];
        let why = one.why.clone().into();
        table.row(names.into_iter().chain(cells(one)).chain([why]));
        rows::mark(&mut table, false, one.status, false);
    }
    vec![
        Block::heading("Contact of the feet"),
        Block::text(
            "At rest, under the first commands: the foot with the greatest load. Stiffness \
             realised: load over penetration, as a share of the stiffness of the sole in the robot \
             file; a sole has a soft start, which makes it less than 1 at small loads. In the first \
             seconds of the gait, from means over steps: greatest product of gap and load \
             (Signorini), greatest friction beyond the cone (Coulomb), work of friction along the \
             slip, and energy that the contacts of a foot, from touch-down to lift-off, created or \
             dissipated. All but the last are 0 for exact rigid contact, except that a bounce within a \
             step counts with the gap at its ends. Compliance stores energy: \
             its penetration and the return of its tangential deflection are properties of the \
             model.",
        ),
        Block::Table(table),
    ]
}

fn cells(one: &ContactResiduals) -> [Cell; 10] {
    let (rest, gait) = (one.rest.as_ref(), one.gait.as_ref());
    [
        rest.map(|rest| rest.load_n),
        rest.map(|rest| rest.penetration_m),
        rest.and_then(|rest| rest.expected_m),
        rest.and_then(|rest| rest.stiffness_realised),
        gait.map(|gait| gait.signorini_j),
        gait.map(|gait| gait.penetration_m),
        gait.and_then(|gait| gait.coulomb_n),
        gait.map(|gait| gait.along_slip_j),
        gait.map(|gait| gait.created_j),
        gait.map(|gait| gait.dissipated_j),
    ]
    .map(Cell::from)
}

//! All items, in the order of the thesis: a declaration each, in a module of its subject.

mod bench;
mod bus;
mod cell_models;
mod cells;
mod formulas;
mod identification;
mod leg_force;
mod load_filters;
mod massless;
mod models;
mod modulation;
mod schedule;
mod tracking;
mod transition;
mod walking;

use crate::thesis::item::Item;

/// Items by their place in the thesis.
static ITEMS: [Item; 34] = [
    walking::SPEEDS,
    walking::STEP_DOWN,
    models::FIG_2_5,
    models::FIG_2_6,
    formulas::SEC_2_6_1,
    leg_force::FIG_2_9,
    massless::FIG_2_10,
    formulas::EQ_3_1,
    formulas::TABLE_3_4,
    modulation::FIG_3_5,
    transition::FIG_3_7,
    modulation::FIG_3_8,
    walking::LOADS,
    bench::TABLE_4_1,
    cells::FIG_4_4,
    cells::TABLE_4_4,
    cell_models::TABLE_4_5,
    cells::SEC_4_2_3,
    load_filters::FIG_4_7,
    load_filters::FIG_4_8,
    load_filters::FIG_4_9,
    bench::FIG_4_10,
    identification::FIG_4_11,
    identification::FIG_4_12,
    identification::FIG_4_13,
    identification::FIG_4_14,
    load_filters::FIG_4_15,
    schedule::FIG_5_3,
    bus::SEC_5_3_1,
    bus::SEC_5_3_2,
    tracking::FIG_5_9,
    tracking::FIG_5_10,
    tracking::TABLE_5_4,
    tracking::TABLE_5_4_WITHOUT,
];

/// Returns all items.
pub(crate) fn items() -> impl Iterator<Item = &'static Item> {
    ITEMS.iter()
}

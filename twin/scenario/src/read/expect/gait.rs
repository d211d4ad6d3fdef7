//! Reading expectations of the gait as a whole.

use twinrig_document::{Item, Range, Reported};
use twinrig_kernel::Unit;

use super::one_of::one_of;
use crate::domain::Domain;
use crate::gait::{FitnessScales, GaitClaim, GaitMeasure};
use crate::language::{
    Declared, Key, Shape, Special, TableSpec, Type, contextual, quantity, table,
};
use crate::limits::Limits;
use crate::read::limits::{limits_of, read};

/// Returns the type of limits of a [`GaitMeasure`].
macro_rules! gait {
    ($measure:ident, $domain:ident) => {
        limits_of!(GaitMeasure::$measure.unit(), Domain::$domain, |limits| (
            GaitMeasure::$measure,
            limits
        ))
    };
}

table! {
    /// Keys of `gait`.
    pub(super) gait_table = TableSpec::new("gait", "claim about the gait as a whole");
    FITNESS: () = "fitness", contextual(Shape::Other(Special::Limits(Unit::One, Domain::FITNESS))),
        "staged fitness of the thesis, table 3.4: 0 to 4", "fitness = { min = 3.5 }", one_of();
    SLIP_UNIT: f64 = "slip_unit", quantity(Unit::Meter, Range::POSITIVE),
        "unit of the slip in exp(−slip²/500)", r#"fitness = { min = 3.5 }, slip_unit = "1 cm""#,
        default("'1 m'"), needs("fitness"), qualifier();
    ANGLE_UNIT: f64 = "angle_unit", quantity(Unit::Radian, Range::POSITIVE),
        "unit of pitch and roll in exp(−(pitch + roll)/0.3)",
        r#"fitness = { min = 3.5 }, angle_unit = "1 deg""#, default("'1 rad'"), needs("fitness"),
        qualifier();
    RESIDUAL_SCALE: f64 = "residual_scale", quantity(Unit::One, Range::POSITIVE),
        "cycle residual at which the fitness falls to 1/e",
        "fitness = { min = 3.5 }, residual_scale = 0.05", otherwise("it has no influence"),
        needs("fitness"), qualifier();
    MISMATCH: (GaitMeasure, Limits) = "mismatch", gait!(Mismatch, SHARE),
        "share of time in which contact and phase contradict each other, mean of the legs",
        "mismatch = { max = 0.2 }", one_of();
    SLIP: (GaitMeasure, Limits) = "slip", gait!(Slip, NOT_NEGATIVE),
        "sum of the slips of all footsteps", r#"slip = { max = "2 m" }"#, one_of();
    FLIGHT_SHARE: (GaitMeasure, Limits) = "flight_share", gait!(FlightShare, SHARE),
        "share of time in which no foot is on the ground", "flight_share = { max = 0.1 }", one_of();
    COST_OF_TRANSPORT: (GaitMeasure, Limits) = "cost_of_transport",
        gait!(CostOfTransport, NOT_NEGATIVE),
        "positive work of the drives over weight and distance", "cost_of_transport = { max = 1 }",
        one_of();
    FROUDE: (GaitMeasure, Limits) = "froude", gait!(Froude, NOT_NEGATIVE),
        "Froude number: square of the speed over gravity and mean height of the trunk",
        r#"froude = { near = 0.5, within = "5 %" }"#, one_of();
    STROUHAL: (GaitMeasure, Limits) = "strouhal", gait!(Strouhal, NOT_NEGATIVE),
        "Strouhal number: stride frequency times mean height of the trunk over the speed",
        r#"strouhal = { near = 0.5, within = "5 %" }"#, one_of();
    CYCLE_RESIDUAL: (GaitMeasure, Limits) = "cycle_residual", gait!(CycleResidual, NOT_NEGATIVE),
        "change of the trunk's state from cycle to cycle, root mean square",
        "cycle_residual = { max = 0.05 }", one_of();
}

/// Reads `gait = { … }`.
pub(super) fn claim(item: &Item<'_>) -> Result<GaitClaim, Reported> {
    let table = &item.table()?;
    let table = gait_table::TABLE.of(table);
    let measure = one_of(table, item, "no measure of the gait is given")?;
    let (measure, limits) = if measure == gait_table::FITNESS.name {
        fitness(table)?
    } else {
        table.read_named(measure)?
    };
    Ok(GaitClaim {
        measure,
        limits,
        place: item.place(),
    })
}

fn fitness(table: Declared<'_, '_>) -> Result<(GaitMeasure, Limits), Reported> {
    use gait_table::{ANGLE_UNIT, FITNESS, RESIDUAL_SCALE, SLIP_UNIT};
    let (slip, angle) = (table.read(&SLIP_UNIT), table.read(&ANGLE_UNIT));
    let residual = table.get(&RESIDUAL_SCALE);
    let limits = table.read_with(&FITNESS, |item| read(item, Unit::One, &Domain::FITNESS));
    let scales = FitnessScales {
        slip: slip?,
        angle: angle?,
        residual: residual?,
    };
    Ok((GaitMeasure::Fitness(scales), limits?))
}

//! Page section on the cost of transport and the residual of the energy balance.

use twinrig_report::number::{method_setting, si};
use twinrig_report::page::Block;
use twinrig_report::table::{Cell, Column, Table};
use twinrig_rig::PlantId;

use super::rows;
use crate::plants::row::Status;
use crate::plants::study::Study;
use crate::plants::transport::{Cost, Transport};

/// Returns the section: cost of transport by plant and method.
pub(crate) fn section(study: &Study) -> Vec<Block> {
    let Some(cost) = study.transports.iter().find_map(|one| one.cost.as_ref()) else {
        return Vec::new();
    };
    let introduction = format!(
        "Each plant, with each of its methods at the scenario's step, receives the same commands \
         for {} from the same start; the window begins at {}. Work is that of the drives on the \
         robot, without losses of motors and gears; the cost of transport is work over weight \
         and distance. Net work is that of the energy balance; positive work is torque times \
         rotation of every drive on its own where that is positive, without recovery by braking. \
         The work of the drives is dissipated by friction and impacts or stored; the residual \
         is energy created or lost by the integration. The covered cost includes the residual as \
         work of the drives; where it differs much from the net cost, the plant gives no valid \
         consumption. Shares are of the net work. A converged cost is one at a setting so fine \
         that it is the same, in the printed digits, at twice the step or ten times the tolerance.",
        si(cost.to_s, "s"),
        si(cost.from_s, "s"),
    );
    let mut out = vec![
        Block::heading("Cost of transport"),
        Block::Text(introduction),
        Block::Table(table(study)),
    ];
    out.extend(summary(study).into_iter().map(Block::Text));
    out
}

fn table(study: &Study) -> Table {
    let joule = |name: &str| Column::number(name).in_unit("J");
    let ratio = |name: &str| Column::number(name).with_places(3);
    let mut table = Table::new([
        Column::label("plant"),
        Column::text("method"),
        ratio("speed").in_unit("m/s"),
        ratio("cost, net"),
        ratio("covered"),
        ratio("positive"),
        joule("work, net"),
        joule("residual"),
        joule("friction"),
        joule("impacts"),
        joule("stored"),
    ]);
    let mut before: Option<&PlantId> = None;
    for one in &study.transports {
        let first = before.is_some_and(|before| *before != one.key.plant);
        before = Some(&one.key.plant);
        let method = Cell::from(one.key.method.as_str()).with_detail(about(one));
        let names = [one.key.plant.label().into(), method];
        let numbers = one.cost.as_ref().map(numbers);
        table.row(names.into_iter().chain(numbers.into_iter().flatten()));
        let status = match one.fell_at_s {
            Some(_) => Status::Failed,
            None => one.status,
        };
        rows::mark(&mut table, first, status, false);
    }
    table
}

/// Returns the setting of a walk, and its reservations.
fn about(one: &Transport) -> String {
    let setting = method_setting(one.key.step_s, one.key.tolerance);
    let setting = match one.converged {
        Some(true) => format!("{setting}, converged"),
        Some(false) => format!("{setting}, the finest tried, not converged"),
        None => setting,
    };
    match &one.why {
        Some(why) => format!("{setting}; {why}"),
        None => setting,
    }
}

/// Greatest relative difference between the net work of the energy balance and that of the drives
/// at which positive work is shown.
const MISMATCH_MAX: f64 = 0.05;

/// Returns the difference between the net work of the drives and that of the energy balance, as a
/// share of the greater.
fn mismatch(cost: &Cost) -> Option<f64> {
    let drives = cost.drive_work_j?;
    let most = cost.work_j.abs().max(drives.abs());
    (most > 0.0).then(|| (drives - cost.work_j).abs() / most)
}

fn numbers(cost: &Cost) -> [Cell; 9] {
    let known = mismatch(cost).is_some_and(|mismatch| mismatch <= MISMATCH_MAX);
    let residual = match share(cost) {
        Some(share) => format!("{}, {:.2} %", si(cost.residual_j, "J"), 100.0 * share).into(),
        None => cost.residual_j.into(),
    };
    [
        cost.speed_m_s.into(),
        cost.cost_of_transport.into(),
        cost.covered_cost_of_transport.into(),
        cost.positive_cost_of_transport.filter(|_| known).into(),
        cost.work_j.into(),
        residual,
        cost.dissipated_j.into(),
        cost.impact_j.into(),
        cost.stored_j.into(),
    ]
}

/// Returns the residual as a share of the net work.
fn share(cost: &Cost) -> Option<f64> {
    (cost.work_j != 0.0).then(|| cost.residual_j / cost.work_j.abs())
}

/// Returns a summary of the table, in sentences.
fn summary(study: &Study) -> Vec<String> {
    let sound = || {
        let all = study.transports.iter();
        let standing = all.filter(|one| one.status == Status::Ok && one.fell_at_s.is_none());
        standing.filter_map(|one| Some((one, one.cost.as_ref()?)))
    };
    let mut out = Vec::new();
    let costs = || sound().filter_map(|(one, cost)| Some((one, cost.cost_of_transport?)));
    let least = costs().min_by(|a, b| a.1.total_cmp(&b.1));
    let most = costs().max_by(|a, b| a.1.total_cmp(&b.1));
    if let (Some((low, least)), Some((high, most))) = (least, most)
        && least > 0.0
    {
        out.push(format!(
            "Over plants that stay upright, the net cost ranges from {least:.3} ({}) to \
             {most:.3} ({}), a factor of {:.2}. The thesis (section 2.6.1) reports a model in \
             maximal coordinates that consumed up to 15 times less than the robot.",
            name(low),
            name(high),
            most / least
        ));
    }
    out.extend(greatest_residual(study));
    let mismatch = sound().filter_map(|(one, cost)| Some((one, mismatch(cost)?)));
    if let Some((one, mismatch)) = mismatch.max_by(|a, b| a.1.total_cmp(&b.1)) {
        out.push(format!(
            "Net work from torque and rotation of the drives, sampled every step, differs from \
             that of the energy balance by {:.2} % at most ({}), which indicates the accuracy of \
             positive work. Where they differ by more than {} %, it is not shown.",
            100.0 * mismatch,
            name(one),
            100.0 * MISMATCH_MAX
        ));
    }
    out
}

/// Returns a sentence on the greatest residual of the energy balance, of upright and fallen robots,
/// and its effect on the cost.
fn greatest_residual(study: &Study) -> Option<String> {
    let ended = study.transports.iter();
    let ended = ended.filter(|one| one.status == Status::Ok);
    let known = ended.filter_map(|one| {
        let cost = one.cost.as_ref()?;
        Some((one, cost, share(cost)?))
    });
    let (one, cost, share) = known.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))?;
    let fell = one
        .fell_at_s
        .map_or(String::new(), |at| format!(" (fell at {})", si(at, "s")));
    let direction = if cost.residual_j > 0.0 {
        "created"
    } else {
        "lost"
    };
    let sentence = format!(
        "The energy balance has its greatest residual in {}{fell}: the net work of the drives is \
         {}, and {} are {direction}, {:.2} % of that; at most {} are created and {} lost in a \
         tenth of the window.",
        name(one),
        si(cost.work_j, "J"),
        si(cost.residual_j.abs(), "J"),
        100.0 * share.abs(),
        si(cost.appears_most_j, "J"),
        si(cost.vanishes_most_j, "J"),
    );
    let covered = cost.covered_cost_of_transport;
    let covered = cost
        .cost_of_transport
        .zip(covered)
        .filter(|(net, _)| *net > 0.0);
    let covered = covered.map_or(String::new(), |(net, covered)| {
        format!(
            " A cost of {net:.3} would be {covered:.3}, {:.2} times as much, if the drives had \
             supplied the residual.",
            covered / net
        )
    });
    Some(sentence + &covered)
}

fn name(one: &Transport) -> String {
    format!(
        "{} {}, {}",
        one.key.plant,
        one.key.method,
        method_setting(one.key.step_s, one.key.tolerance)
    )
}

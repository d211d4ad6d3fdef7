//! Page section on the cost of transport and the residual of the energy balance.

use crate::row::Status;
use crate::study::Study;
use crate::transport::{Cost, Transport};
use twinrig_report::number::{method_setting, si};
use twinrig_rig::PlantId;

use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::table::HtmlTable;

/// Returns the section: cost of transport by plant and method.
pub(crate) fn section(study: &Study) -> String {
    let Some(cost) = study.transports.iter().find_map(|one| one.cost.as_ref()) else {
        return String::new();
    };
    let mut out = "<h2>Cost of transport</h2>\n".to_owned();
    out += &paragraph(&format!(
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
    ));
    out += &table(study);
    out += &summary(study);
    out
}

fn table(study: &Study) -> String {
    let mut table = HtmlTable::new(
        "plant | method | speed | cost, net | covered | positive | work, net | residual \
         | friction | impacts | stored",
        2,
    );
    let mut before: Option<&PlantId> = None;
    for one in &study.transports {
        let first = before.is_some_and(|before| *before != one.key.plant);
        before = Some(&one.key.plant);
        let bad = one.status != Status::Ok || one.fell_at_s.is_some();
        let setting = method_setting(one.key.step_s, one.key.tolerance);
        let setting = match one.converged {
            Some(true) => format!("{setting}, converged"),
            Some(false) => format!("{setting}, the finest tried, not converged"),
            None => setting,
        };
        let about = match &one.why {
            Some(why) => format!("{setting}; {why}"),
            None => setting,
        };
        let about = element("span", "wrap soft", &escaped(&about));
        let mut cells = vec![
            element("b", "", &escaped(&one.key.plant.label())),
            escaped(&one.key.method) + &about,
        ];
        let numbers = one.cost.as_ref().map(numbers);
        cells.extend(numbers.into_iter().flatten());
        table.row(
            match (first, bad) {
                (true, false) => "first",
                (false, false) => "",
                (true, true) => "first bad",
                (false, true) => "bad",
            },
            cells,
        );
    }
    table.html()
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

fn numbers(cost: &Cost) -> [String; 9] {
    let known = mismatch(cost).is_some_and(|mismatch| mismatch <= MISMATCH_MAX);
    let ratio = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.3}"));
    let joule = |value: f64| si(value, "J");
    [
        format!("{:.3} m/s", cost.speed_m_s),
        ratio(cost.cost_of_transport),
        ratio(cost.covered_cost_of_transport),
        ratio(cost.positive_cost_of_transport.filter(|_| known)),
        joule(cost.work_j),
        share(cost).map_or_else(
            || joule(cost.residual_j),
            |share| format!("{}, {:.2} %", joule(cost.residual_j), 100.0 * share),
        ),
        joule(cost.dissipated_j),
        joule(cost.impact_j),
        joule(cost.stored_j),
    ]
}

/// Returns the residual as a share of the net work.
fn share(cost: &Cost) -> Option<f64> {
    (cost.work_j != 0.0).then(|| cost.residual_j / cost.work_j.abs())
}

/// Returns a summary of the table.
fn summary(study: &Study) -> String {
    let sound = || {
        let all = study.transports.iter();
        let standing = all.filter(|one| one.status == Status::Ok && one.fell_at_s.is_none());
        standing.filter_map(|one| Some((one, one.cost.as_ref()?)))
    };
    let mut out = String::new();
    let costs = || sound().filter_map(|(one, cost)| Some((one, cost.cost_of_transport?)));
    let least = costs().min_by(|a, b| a.1.total_cmp(&b.1));
    let most = costs().max_by(|a, b| a.1.total_cmp(&b.1));
    if let (Some((low, least)), Some((high, most))) = (least, most)
        && least > 0.0
    {
        out += &paragraph(&format!(
            "Over plants that stay upright, the net cost ranges from {least:.3} ({}) to \
             {most:.3} ({}), a factor of {:.2}. The thesis (section 2.6.1) reports a model in \
             maximal coordinates that consumed up to 15 times less than the robot.",
            name(low),
            name(high),
            most / least
        ));
    }
    out += &greatest_residual(study);
    let mismatch = sound().filter_map(|(one, cost)| Some((one, mismatch(cost)?)));
    if let Some((one, mismatch)) = mismatch.max_by(|a, b| a.1.total_cmp(&b.1)) {
        out += &paragraph(&format!(
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
fn greatest_residual(study: &Study) -> String {
    let ended = study.transports.iter();
    let ended = ended.filter(|one| one.status == Status::Ok);
    let known = ended.filter_map(|one| {
        let cost = one.cost.as_ref()?;
        Some((one, cost, share(cost)?))
    });
    let furthest = known.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()));
    let Some((one, cost, share)) = furthest else {
        return String::new();
    };
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
    paragraph(&(sentence + &covered))
}

fn name(one: &Transport) -> String {
    format!(
        "{} {}, {}",
        one.key.plant,
        one.key.method,
        method_setting(one.key.step_s, one.key.tolerance)
    )
}

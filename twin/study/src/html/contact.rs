//! Page section on the contact of the feet.

use crate::contact::ContactResiduals;
use crate::row::Status;
use crate::study::Study;
use twinrig_report::number::{method_setting, plain, si};

use super::rows;
use twinrig_report::html::element::{element, escaped, paragraph};
use twinrig_report::html::table::HtmlTable;

/// Returns the section: penetration at rest and residuals in the gait.
pub(crate) fn section(study: &Study) -> String {
    if study.contacts.is_empty() {
        return String::new();
    }
    let mut table = HtmlTable::new(
        "plant | method | load at rest | penetration | load / k | stiffness realised | Signorini \
         | greatest penetration | Coulomb | along slip | created | dissipated | why",
        2,
    );
    for one in &study.contacts {
        let about = element(
            "span",
            "wrap soft",
            &method_setting(one.key.step_s, one.key.tolerance),
        );
        let mut all = vec![
            element("b", "", &escaped(&one.key.plant.label())),
            escaped(&one.key.method) + &about,
        ];
        all.extend(cells(one));
        all.push(escaped(one.why.as_deref().unwrap_or_default()));
        table.row(if one.status == Status::Ok { "" } else { "bad" }, all);
    }
    "<h2>Contact of the feet</h2>\n".to_owned()
        + &paragraph(
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
        )
        + &table.html()
}

fn cells(one: &ContactResiduals) -> [String; 10] {
    let joule = |value: Option<f64>| value.map_or(String::new(), |value| si(value, "J"));
    let newton = |value: Option<f64>| value.map_or(String::new(), |value| si(value, "N"));
    let (rest, gait) = (one.rest.as_ref(), one.gait.as_ref());
    let realised = rest.and_then(|rest| rest.stiffness_realised);
    [
        newton(rest.map(|rest| rest.load_n)),
        rows::length(rest.map(|rest| rest.penetration_m)),
        rows::length(rest.and_then(|rest| rest.expected_m)),
        realised.map_or(String::new(), plain),
        joule(gait.map(|gait| gait.signorini_j)),
        rows::length(gait.map(|gait| gait.penetration_m)),
        newton(gait.and_then(|gait| gait.coulomb_n)),
        joule(gait.map(|gait| gait.along_slip_j)),
        joule(gait.map(|gait| gait.created_j)),
        joule(gait.map(|gait| gait.dissipated_j)),
    ]
}

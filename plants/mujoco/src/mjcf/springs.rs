//! Springs of a leg.

use core::fmt::Write;

use super::sections::{Sections, line};
use crate::model::LegModel;

/// Writes the springs of a leg, with or without the stops of their rods.
pub(super) fn springs(
    leg: &LegModel,
    diagonal_range: &str,
    parallel_range: &str,
    to: &mut Sections,
) {
    let tag = &leg.tag;
    for (name, ends, spring, range) in [
        ("diagonal", ["inner", "ankle"], leg.diagonal, diagonal_range),
        ("parallel", ["inner", "outer"], leg.parallel, parallel_range),
    ] {
        let [stiffness, rest] = spring;
        line!(
            to.tendons,
            "    <spatial name=\"{tag}_{name}\" stiffness=\"{stiffness}\" springlength=\"{rest}\"{range}>"
        );
        let [from, to_site] = ends.map(|end| format!("<site site=\"{tag}_{end}\"/>"));
        line!(to.tendons, "      {from}{to_site}\n    </spatial>");
    }
}

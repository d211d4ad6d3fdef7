//! Kinds of the gait controllers, from scenario options.

use twinrig_gait::{
    Abduction, Cpg, DutyRule, FixedPoint, Gait, Planner, StanceCurve, Stand, Tegotae, TegotaeStart,
};
use twinrig_scenario::{Accepts, OptionSpec, OptionValue, Options};

use crate::error::BuildError;
use crate::parts::controller_kind::{ControllerContext, ControllerKind};
use crate::parts::option::{choice, option};

const START: &str = "start";
const FREQUENCY_OF: &str = "frequency_of";
const PHASE_OUTPUT: &str = "phase_output";
const REACH_OUTPUT: &str = "reach_output";
const FIXED_POINT: &str = "fixed_point";
const LOCUS: &str = "locus";
const DUTY_MAP: &str = "duty_map";
const LOAD: &str = "load";
const LOAD_COMPONENT: &str = "load_component";

/// Starts of `cpg`.
const CPG_START: [&str; 2] = ["in-step", "random"];
/// Components of a force by their names in scenarios.
const COMPONENTS: [&str; 3] = ["x", "y", "z"];

/// Returns the kind of the open-loop controller.
pub(crate) fn cpg() -> ControllerKind {
    let about = "open-loop gait: coupled oscillators, foot locus, inverse kinematics";
    let kind = ControllerKind::new(Cpg::NAME, about, build_cpg);
    let kind = kind.with_variables(|context| Ok(Cpg::variables_of(context.robot, gait(context)?)?));
    cpg_options()
        .into_iter()
        .fold(kind, ControllerKind::with_option)
}

/// Returns the kind of the open-loop controller with planned steps.
pub(crate) fn planner() -> ControllerKind {
    let about = "gait of `cpg` that changes its steps so that no foot lands in a known obstacle";
    let kind = ControllerKind::new(Planner::NAME, about, |context| {
        let planner = Planner::new(context.robot, context.legs, build_cpg(context)?)?;
        Ok(match load(context) {
            Some((name, component)) => planner.with_load(name, component)?,
            None => planner,
        })
    });
    let kind =
        kind.with_variables(|context| Ok(Planner::variables_of(context.robot, gait(context)?)?));
    let options = cpg_options().into_iter().chain(load_options());
    options.fold(kind, ControllerKind::with_option)
}

fn build_cpg(context: &ControllerContext<'_>) -> Result<Cpg, BuildError> {
    let cpg = Cpg::new(context.robot, context.legs, gait(context)?)?;
    let mut cpg = cpg
        .with_abduction(abduction(context))?
        .with_stance(stance_curve(context))
        .with_duty_rule(duty_rule(context.options))?;
    if is_set(context, PHASE_OUTPUT) {
        cpg = cpg.with_phase_output();
    }
    if is_set(context, REACH_OUTPUT) {
        cpg = cpg.with_reach_output();
    }
    if let Some(leg) = context.options.text(FREQUENCY_OF) {
        cpg = cpg.with_frequency_of(leg)?;
    }
    Ok(match context.options.text(START) {
        Some("random") => cpg.with_random_phases(context.seed),
        _ => cpg,
    })
}

fn cpg_options() -> [OptionSpec; 8] {
    [
        gaits("gait, which sets the phases of the legs"),
        choice(
            START,
            "initial phases: those of the gait, or random",
            &CPG_START,
        ),
        loci(),
        choice(
            DUTY_MAP,
            "stance share of the cycle: the duty factor d, or (1 + d)/2 as eq. 3.1 of the thesis \
             is printed",
            &DutyRule::ALL.map(DutyRule::name),
        ),
        abducting(&Abduction::ALL),
        phase_output(),
        reach_output(),
        frequency_of(),
    ]
}

/// Returns the kind of the controller with feedback of the loads.
pub(crate) fn tegotae() -> ControllerKind {
    let about = "gait with feedback: an oscillator per leg, which the load of the leg holds back";
    let kind = ControllerKind::new(Tegotae::NAME, about, |context| {
        let (legs, options) = (context.legs, context.options);
        let tegotae = Tegotae::new(context.robot, legs, gait(context)?, context.seed)?;
        let start = named(
            &TegotaeStart::ALL,
            TegotaeStart::name,
            context.options,
            START,
        );
        let rule = named(
            &FixedPoint::ALL,
            FixedPoint::name,
            context.options,
            FIXED_POINT,
        );
        let mut tegotae = tegotae
            .with_start(start)
            .with_fixed_point(rule)
            .with_stance(stance_curve(context))
            .with_abduction(abduction(context))?;
        if let Some((name, component)) = load(context) {
            tegotae = tegotae.with_load(name, component)?;
        }
        if is_set(context, PHASE_OUTPUT) {
            tegotae = tegotae.with_phase_output();
        }
        if is_set(context, REACH_OUTPUT) {
            tegotae = tegotae.with_reach_output();
        }
        if let Some(leg) = options.text(FREQUENCY_OF) {
            tegotae = tegotae.with_frequency_of(leg)?;
        }
        Ok(tegotae)
    });
    let [load_signal, load_component] = load_options();
    let options = [
        gaits("gait, which sets the initial phases of the legs"),
        choice(
            START,
            "initial phases: those of the gait, random, or all legs at mid-stance",
            &TegotaeStart::ALL.map(TegotaeStart::name),
        ),
        choice(
            FIXED_POINT,
            "phase at which its load stops a leg: always mid-stance, or a function of the load",
            &FixedPoint::ALL.map(FixedPoint::name),
        ),
        loci(),
        load_signal,
        load_component,
        abducting(&Abduction::ALL),
        phase_output(),
        reach_output(),
        frequency_of(),
    ];
    let kind = kind.with_variables(|context| Ok(Tegotae::variables_of(context.robot)?));
    options.into_iter().fold(kind, ControllerKind::with_option)
}

/// Options with the signal of the loads.
fn load_options() -> [OptionSpec; 2] {
    [
        OptionSpec {
            default: Some(OptionValue::Text("leg/*/foot/load".to_owned())),
            ..option(
                LOAD,
                "signal with the load of each leg; `*` is the name of the leg",
                Accepts::Text,
            )
        },
        option(
            LOAD_COMPONENT,
            "component that is the load, where the signal is a force; none for a load",
            Accepts::Choice(COMPONENTS.map(str::to_owned).into()),
        ),
    ]
}

/// Returns the name of the signal of the loads, and the component that is the load.
fn load<'o>(context: &ControllerContext<'o>) -> Option<(&'o str, Option<usize>)> {
    let name = context.options.text(LOAD)?;
    let component = context.options.text(LOAD_COMPONENT);
    let index = component.and_then(|name| COMPONENTS.iter().position(|it| *it == name));
    Some((name, index))
}

/// Returns the kind of the controller that stands.
pub(crate) fn stand() -> ControllerKind {
    ControllerKind::new(Stand::NAME, "holds the feet below the hips", |context| {
        Ok(Stand::new(context.robot, context.legs)?.with_abduction(abduction(context)))
    })
    .with_variables(|context| Ok(Stand::variables_of(context.robot)?))
    .with_option(abducting(&[Abduction::None, Abduction::Hold]))
}

/// Option with the leg whose mean phase rate is an output.
fn frequency_of() -> OptionSpec {
    option(
        FREQUENCY_OF,
        "leg whose mean phase rate over its last cycle is the output `leg/LEG/frequency`, for filters",
        Accepts::Text,
    )
}

fn phase_output() -> OptionSpec {
    option(
        PHASE_OUTPUT,
        "also output the phase of each leg, `leg/LEG/phase`: swing below pi, then stance (false)",
        Accepts::Boolean,
    )
}

fn reach_output() -> OptionSpec {
    option(
        REACH_OUTPUT,
        "also output the distance of each foot's target from the reach of its leg, \
         `leg/LEG/out_of_reach`, zero within it (false)",
        Accepts::Boolean,
    )
}

fn is_set(context: &ControllerContext<'_>, key: &str) -> bool {
    context.options.boolean(key).unwrap_or_default()
}

fn gaits(about: &str) -> OptionSpec {
    choice("gait", about, &Gait::ALL.map(Gait::name))
}

fn gait(context: &ControllerContext<'_>) -> Result<Gait, BuildError> {
    Ok(context.options.text("gait").unwrap_or_default().parse()?)
}

/// Option with the curve of the feet in stance.
fn loci() -> OptionSpec {
    choice(
        LOCUS,
        "curve of the foot in stance: at constant speed, or with the control points of table 3.2 \
         of the thesis as printed",
        &StanceCurve::ALL.map(StanceCurve::name),
    )
}

fn stance_curve(context: &ControllerContext<'_>) -> StanceCurve {
    named(&StanceCurve::ALL, StanceCurve::name, context.options, LOCUS)
}

/// Option of the modes of abduction.
fn abducting(modes: &[Abduction]) -> OptionSpec {
    let about = "also command the hip-abduction servos: `hold` by `splay`, `steer` by steps to the side, too, \
                 `capture` by these and the motion of the trunk to the side";
    let names: Vec<_> = modes.iter().map(|mode| mode.name()).collect();
    choice("abduction", about, &names)
}

fn abduction(context: &ControllerContext<'_>) -> Abduction {
    named(
        &Abduction::ALL,
        Abduction::name,
        context.options,
        "abduction",
    )
}

/// Returns the stance share that a duty factor means, corrected where the kind has no such option.
pub fn duty_rule(options: &Options) -> DutyRule {
    named(&DutyRule::ALL, DutyRule::name, options, DUTY_MAP)
}

/// Returns the one of `all` that the option `key` names; the default without one.
fn named<T: Copy + Default>(
    all: &[T],
    name: impl Fn(T) -> &'static str,
    options: &Options,
    key: &str,
) -> T {
    let wanted = options.text(key);
    let found = all.iter().find(|one| Some(name(**one)) == wanted);
    found.copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use twinrig_gait::Corner;
    use twinrig_scenario::{LegFact, Pattern};

    use super::*;

    #[test]
    fn gaits_of_controllers_are_the_patterns_of_expectations() {
        for gait in Gait::ALL {
            let pattern = Pattern::named(gait.name()).unwrap();
            for (fore, left) in [(true, true), (true, false), (false, true), (false, false)] {
                let name = String::new();
                let touch_down = pattern.share(&LegFact { name, fore, left }).unwrap();
                // A leg that is ahead touches down earlier.
                let ahead = gait.phase_difference(Corner { fore, left }) / TAU;
                let distance = (touch_down + ahead).rem_euclid(1.0);
                let distance = distance.min(1.0 - distance);
                assert!(distance < 1e-12, "{} {fore} {left}", gait.name());
            }
        }
    }
}

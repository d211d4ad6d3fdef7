//! An independent JSON schema validator accepts all scenarios that the reader accepts, and rejects
//! those that a schema can reject.

use std::path::Path;

use std::fs;

use serde_json::json;

/// Valid scenarios that together contain all keys and all kinds of their values.
const VALID: &[&str] = &[
    "name = 'n'\nseed = 18446744073709551615\n[override]\nfriction = 0.5",
    "[actuator]\nkind = 'servo'\nlag = '5 ms'\nspeed = '20 rad/s'\n[actuator.hip]\ntorque = '5 N·m'\n[actuator.knee]\ndead_band = '0 deg'",
    "[actuator]\nkind = 'motor'\nhip = {}",
    "[actuator]\nkind = 'ideal'\nset_point = 'linear'",
    "[actuator]\nset_point = 'linear'\nlag = '5 ms'",
    "[io]\nstep = '1 ms'\ntransfer_time = { min = '0 s', max = '1 ms' }",
    "[io]\ntransfer_time = { mean = '1 ms', deviation = '10 us', min = '0 s', max = '2 ms' }",
    "[io]\ntransfer_time = { trace = ['1 ms', '2 ms'] }",
    "[observe]\nperiod = '1 ms'\n[footsteps]\ntouch_down = 0.1\nlift_off = '5 %'\nshortest_swing = '0 s'\nleast_impulse = '3 ms'",
    "[footsteps]\ntouch_down = '0.5 N'\nlift_off = '200 mN'",
    "[record]\nsignals = ['body/*']\nframes = '0 Hz'\nbytes = true",
    "[[change]]\nat = '1 s'\nset = 'frequency'\nto = '3 Hz'\n[[change]]\nat = '0 s'\nset = 'hip_height/fore'\nby = '-1 mm'",
    "[[change]]\nat = '1 s'\nset = 'phase'\nto = '3 deg'",
    "[[change]]\nat = '1 s'\nset = 'frequency'\nby = '0.01 Hz'\nevery = '1 s'\ntimes = 3\n[[change]]\nat = '1.5 s'\nset = 'frequency'\nby = '-0.01 Hz'\nevery = '2 s'",
    "[bus]\nkind = 'sbcp'\nname = 'left'\nclock = '20 ppm'\nusb = { latency_timer = '1 ms', jitter = '10 us' }",
    "[[bus]]\nkind = 'sbcp'\nclock = { LF = 1e-6, any = '-2 ppm' }\nusb.jitter = { trace = ['1 ms'] }\n[[bus]]\nkind = 'rb110'\nclock = '3 s'",
    "bus = []\nchange = []\nfault = []\nexpect = []",
    "[bus]\nkind = 'sbcp'\n[[fault]]\nat = '1 s'\nfor = '1 ms'\non = 'wire/sbcp'\nkind = 'drop'\nprobability = '5 %'\n[[fault]]\nat = '1 s'\non = 'wire/sbcp/LF'\nkind = 'flip'\nrate = 1e-3",
    "[bus]\nkind = 'sbcp'\n[[fault]]\nat = '1 s'\non = 'wire/sbcp'\nkind = 'delay'\nby = '1 ms'\n[[fault]]\nat = '1 s'\non = 'wire/sbcp'\nkind = 'unplug'\nfails = true\n[[fault]]\nat = '1 s'\non = 'wire/sbcp'\nkind = 'stuck'\n[[fault]]\nat = '1 s'\non = 'wire/sbcp'\nkind = 'babble'\npause = '1 ms'",
    "[[expect]]\nname = 'n'\nafter = '1 s'\nbefore = '2 s'\noptional = true\nplants = ['massless', 'mujoco']\nbody = { fall = false }",
    "[[expect]]\nbody = { fall = { height = 0.3, tilt = '60 deg' } }\n[[expect]]\nbody = { speed = { near = '1 m/s', within = '3 %' }, along = 'path' }\n[[expect]]\nbody = { settles = { within = '1 mm', by = '2 s' } }\n[[expect]]\nbody = { gets_up = { within = '2 s', height = 0.8 } }",
    "[[expect]]\nfootstep = { leg = 'fore', slip = { max = '1 mm' } }\n[[expect]]\nfootstep = { leg = ['LF'], position = { min = '0 m', max = '1 m' }, axis = 'z' }\n[[expect]]\nfootstep = { phase = 'trot', tolerance = 0.1 }\n[[expect]]\nfootstep = { phase = { LF = 0, RF = '50 %' }, tolerance = '5 %' }\n[[expect]]\nfootstep = { order = ['LF', ['RF', 'LH']] }",
    "[[change]]\nat = '1 s'\nset = 'step_length'\nby = '-1 cm'\n[[expect]]\nfootstep = { displacement = { max = '1 mm' }, against = 'without changes', axis = 'horizontal', cycle = 2 }",
    "[[expect]]\ntiming = { of = 'control', cycle_rate = { near = '500 Hz', within = '1 Hz' } }",
    "[[expect]]\nsignal = { name = 'body/position', component = 'z', always = { min = '1 cm' }, until = { name = 'body/rpy', component = 2, max = '3 deg' } }\n[[expect]]\nsignal = { name = 'x', eventually = { near = 3, within = 1 }, within = '1 s' }\n[[expect]]\nsignal = { name = 'x', settles = { within = '1 N', by = '1 s' } }",
    "[[expect]]\ncompare = { signal = 'x', component = 'y', with = 'z', with_component = 2, error = { max = '1 N' } }\n[[expect]]\ncompare = { signal = 'x', with = 'z', delay = { min = '-1 ms', max = '1 ms' }, delay_range = '1 s' }\n[[expect]]\ncompare = { signal = 'x', with = 'z', peaks = { near = 1, within = '3 %' } }",
    "[[expect]]\nenergy = { residual = { max = 1e-6 } }\n[[expect]]\ncost = { real_time_factor = { min = 10 } }\n[[expect]]\ncost = { steps = { max = 10 } }",
];

/// Valid scenarios with their own `[plant]` or `[controller]` instead of the minimal scenario's.
const VALID_WITH_OTHER_PARTS: &[&str] = &[
    "duration = '1 s'\n[plant]\nmodel = 'own'\nfile = 'model.xml'\nstep = '1 ms'\n[plant.outputs.'leg/LF/hip/position']\njoint = 'hip'",
    "duration = '1 s'\nrobot = 'r'\n[plant]\nmodel = 'own'\n[controller]\nkind = 'none'",
    "duration = '1 s'\nrobot = 'r'\n[plant]\nmodel = 'massless'\nbase = 'planar'\nlegs = ['LF']\nstep = '1 ms'\nforce = 'lookup'\ncells = 16\ncrouch = '0 m'\ncoupling = 'exact'\nground = { friction = '60 %', restitution = 0.1, profile = 'flat' }\nstart = { q1 = '3 deg', q2_rate = '-1 rad/s' }",
    "duration = '1 s'\nrobot = 'r'\n[plant]\nmodel = 'massless'\ncoupling = { grid = '1 ms', inputs = 'held' }\nground = { profile = 'step-down', at = '-1 m', height = '1 cm' }",
    "duration = '1 s'\nrobot = 'r'\n[plant]\nmodel = 'massless'\nground = { profile = 'heights', spacing = '1 cm', amplitude = '1 cm', seed = 3 }",
    "duration = '1 s'\nrobot = 'r'\n[plant]\nmodel = 'massless'\nground = { profile = 'heights', spacing = '1 cm', values = [['1 cm', '-1 cm']] }",
    "duration = '1 s'\nrobot = 'r'\nplant = { model = 'massless' }\n[controller]\nkind = 'cpg'\nperiod = '2 ms'\ncompute_time = '1 ms'\ngait = 'walk'\nfrequency = '3 Hz'\nhip_height = { fore = '12 cm' }\nphase = { LF = '3 deg' }",
    "duration = '1 s'\nrobot = 'r'\nplant = { model = 'massless' }\n[controller]\nkind = 'script'\nperiod = '2 ms'\ngait = true\nfrequency = '-3 rad/s'\n[[change]]\nat = '0 s'\nset = 'frequency'\nto = '3 rpm'",
];

/// Malformed files that no schema can reject, by the required knowledge.
const BEYOND_SCHEMA: &[(&str, &[&str])] = &[
    (
        "comparing, adding or dividing values",
        &[
            "bus_twice",
            "payload_twice",
            "change_leaves_the_range",
            "change_repeated_leaves_the_range",
            "change_repeated_meets_another",
            "change_repeated_too_often",
            "change_twice_at_one_instant",
            "controller_period_beyond_the_run",
            "coupling_grid_does_not_divide_the_observation",
            "expect_after_the_end",
            "expect_an_order_with_a_leg_twice",
            "expect_before_after",
            "expect_displacement_without_change",
            "expect_limits_that_cross",
            "expect_fall_with_unreachable_thresholds",
            "footsteps_lift_off_above_touch_down",
            "heights_are_no_grid",
            "io_step_does_not_divide_the_period",
            "io_time_model_invalid",
            "observation_period_beyond_the_run",
            "observation_period_by_default_too_long_for_footsteps",
            "observation_period_on_a_grid_too_long_for_footsteps",
            "observation_period_too_long_for_footsteps",
        ],
    ),
    (
        "the magnitude of a quantity with a unit",
        &[
            "change_to_a_frequency_above_half_the_control_rate",
            "duration_below_a_nanosecond",
            "expect_a_negative_latency",
            "expect_a_recovery_from_an_unknown_disturbance",
            "expect_a_recovery_from_the_start",
            "expect_a_recovery_in_another_unit",
            "expect_a_recovery_to_the_end",
            "expect_a_response_in_another_unit",
            "expect_a_response_of_a_pattern",
            "expect_a_roll_within_a_turn",
            "expect_a_trunk_that_stands_while_it_lies",
            "expect_limits_that_reject_all_values",
            "expect_limits_that_accept_all_values",
            "frequency_above_half_the_control_rate",
            "frequency_by_default_above_half_the_control_rate",
            "observation_period_too_long_for_the_body",
            "payload_too_heavy",
            "push_off_the_robot",
            "push_without_finite_force",
            "step_is_too_long",
            "surface_reversed",
            "variable_out_of_range",
        ],
    ),
    (
        "the names that another table gives",
        &[
            "expect_timing_of_no_bus",
            "fault_on_another_wire",
            "push_on_fixed_trunk",
            "push_out_of_the_plane",
            "surface_without_ground",
        ],
    ),
    (
        "the possible values of a measure",
        &[
            "expect_compare_correlation_above_one",
            "expect_compare_negative_error",
        ],
    ),
    (
        "the robot or the plant",
        &[
            "expect_compare_in_another_unit",
            "expect_compare_of_a_fourth_element",
            "expect_compare_of_a_pattern",
            "expect_compare_of_a_vector",
            "expect_compare_of_an_unknown_signal",
            "expect_compare_of_two_units",
            "expect_compare_with_an_unknown_signal",
            "expect_compare_with_itself",
            "expect_of_a_fourth_element",
            "expect_of_a_signal_in_another_unit",
            "expect_of_an_unknown_leg",
            "expect_of_an_unknown_signal",
            "leg_unknown",
            "push_of_unable_plant",
            "push_on_unknown_leg",
            "record_names_no_signal",
            "standalone_model_with_payload",
        ],
    ),
    ("another build", &["model_not_in_this_build"]),
];

fn valid_documents() -> Vec<String> {
    let with_other_parts = VALID_WITH_OTHER_PARTS.iter().map(|text| (*text).to_owned());
    // Keys of the root table precede the tables of the minimal scenario.
    let more = VALID.iter().map(|more| match more.split_once("\n[") {
        Some((root, _)) if !root.starts_with('[') => {
            format!(
                "{root}\n{}\n{}",
                crate::common::text(""),
                &more[root.len()..]
            )
        }
        None if !more.starts_with('[') => format!("{more}\n{}", crate::common::text("")),
        _ => crate::common::text(more),
    });
    with_other_parts.chain(more).collect()
}

#[test]
fn validator_accepts_all_kinds_of_values() {
    let documents = valid_documents();
    for text in &documents {
        let accepted_by_reader = crate::common::parse(text);
        assert!(
            accepted_by_reader.is_ok(),
            "{text}\n{}",
            accepted_by_reader.unwrap_err()
        );
    }
    let Some(found) = crate::common::validated(&crate::common::catalogue(), &documents, 0) else {
        return;
    };
    for (text, errors) in documents.iter().zip(found["errors"].as_array().unwrap()) {
        assert_eq!(errors, &json!([]), "{text}");
    }
}

#[test]
fn validator_rejects_malformed_files() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/malformed");
    let files = fs::read_dir(folder).unwrap();
    let mut files: Vec<_> = files.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let texts: Vec<String> = files
        .iter()
        .map(|file| fs::read_to_string(file).unwrap())
        .collect();
    let Some(found) = crate::common::validated(&crate::common::catalogue(), &texts, 0) else {
        return;
    };
    let found = found["errors"].as_array().unwrap();
    let accepted = files
        .iter()
        .zip(found)
        .filter(|(_, errors)| **errors == json!([]));
    let accepted: Vec<_> = accepted
        .map(|(file, _)| file.file_stem().unwrap().to_str().unwrap())
        .collect();
    let mut beyond = BEYOND_SCHEMA
        .iter()
        .map(|(_, names)| *names)
        .collect::<Vec<_>>()
        .concat();
    beyond.sort_unstable();
    assert_eq!(
        accepted, beyond,
        "left: accepted by the schema; make the schema reject them, or add them to BEYOND_SCHEMA"
    );
}

/// The schema accepts every mutant that the reader accepts, and rejects nearly all of the others:
/// 804 of 805.
#[test]
fn schema_accepts_all_mutants_that_the_reader_accepts() {
    let Some(found) =
        crate::common::validated(&crate::common::catalogue(), &valid_documents(), 1000)
    else {
        return;
    };
    let (mut accepted_by_reader, mut rejected, mut rejected_by_both) = (0, 0, 0);
    for mutant in found["mutants"].as_array().unwrap() {
        let text = mutant["text"].as_str().unwrap();
        let accepted = mutant["errors"] == json!([]);
        match crate::common::parse(text) {
            Ok(_) => {
                accepted_by_reader += 1;
                assert!(accepted, "{text}\n{}", mutant["errors"]);
            }
            Err(error) => {
                rejected += 1;
                rejected_by_both += usize::from(!accepted);
                if accepted {
                    println!("the schema accepts what the reader does not:\n{text}\n{error}\n");
                }
            }
        }
    }
    assert!(
        accepted_by_reader > 100,
        "{accepted_by_reader} of 1000 mutants are valid"
    );
    assert!(
        100 * rejected_by_both > 97 * rejected,
        "{rejected_by_both} of {rejected}"
    );
}

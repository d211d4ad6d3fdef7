//! Legs on servos whose firmware is on a bus.

use twinrig::{Execution, Registry, execute};
use twinrig_tests::shipped;

/// Measured values of a trot in the air on STS3215, with commands every 10 ms: lag of a hip \[ms\],
/// and its distance from the command \[deg\].
fn trot_on_sts3215(settings: &[(&str, &str)]) -> [f64; 2] {
    let registry = Registry::standard();
    let hanging = [("plant.base", "'fixed'"), ("controller.period", "'10 ms'")];
    let settings = [settings, &hanging].concat();
    let assembly = shipped(&registry, "trot-serial.toml", &settings).unwrap();
    let report = execute(&assembly, &Execution::default()).unwrap();
    let names = ["hips lag", "distance of the hip from its command"];
    names.map(|name| {
        let mut rows = report.expectations.iter().map(|line| &line.outcome);
        rows.find(|row| row.name == name).unwrap().measured.unwrap()
    })
}

/// The firmware of the plant and that of the emulated servos have the same law. The write of all
/// goals has 32 bytes of 10 µs and begins two frames of USB of 125 µs later, so that it takes
/// effect in the next period of the firmware, 1 ms later than a command in the plant.
#[test]
fn robot_on_a_feetech_bus_moves_as_with_the_firmware_in_the_plant() {
    let later = ("override.serial.controller.command_delay", "'1 ms'");
    let [at_once, delayed] = [&[][..], &[later]].map(trot_on_sts3215);
    let on_bus = trot_on_sts3215(&[
        ("actuator.firmware", "'bus'"),
        ("bus", "[{ kind = 'feetech' }]"),
    ]);
    for i in 0..2 {
        let [delay, rest] = [delayed[i] - at_once[i], on_bus[i] - delayed[i]];
        assert!(
            rest.abs() < 0.1 * delay,
            "{at_once:?} {delayed:?} {on_bus:?}"
        );
    }
}

#[test]
fn options_of_servos_are_refused_with_a_remedy() {
    for (setting, part) in [
        (
            ("actuator.firmware", "'plant'"),
            "write [actuator] kind = \"serial\", firmware = \"bus\"",
        ),
        (
            ("bus.dynamixel.settings.position_gain", "3"),
            "has no register `position_gain`: did you mean `position_d_gain`?",
        ),
        (
            ("bus.dynamixel.settings.position_p_gain", "0.5"),
            "the register `position_p_gain` needs a whole number",
        ),
        (
            ("bus.dynamixel.settings.position_p_gain", "70000"),
            "cannot have 70000 in `position_p_gain`: 0 to 65535 fit",
        ),
        (
            (
                "bus",
                "[{ kind = 'dynamixel' }, { kind = 'dynamixel', name = 'other' }]",
            ),
            "the bus `dynamixel` carries `leg/LF/hip/command`, too",
        ),
        (
            ("bus.dynamixel.baud", "1500000"),
            "has no 1500000 bit/s; it has 9600, 57600,",
        ),
        (
            ("bus.dynamixel.registers.baud_rate", "3"),
            "write `baud`, in bit/s",
        ),
        (
            ("bus.dynamixel.clock", "{ 'LF/hop' = '1 ppm' }"),
            "there is no servo `LF/hop`: did you mean `LF/hip`?",
        ),
        (
            (
                "fault",
                "[{ on = 'wire/dynamixel', kind = 'drop', on_frame = { after = 'pong' } }]",
            ),
            "there is no message `pong` on `wire/dynamixel`",
        ),
        (
            (
                "fault",
                "[{ on = 'wire/dynamixel/XX/hip', kind = 'drop', on_frame = { nth = 1 } }]",
            ),
            "there is no place `wire/dynamixel/XX/hip` in this scene",
        ),
        (
            (
                "fault",
                "[{ on = 'wire/dynamixel', kind = 'drift', clock = '2 ppm', direction = 'in' }]",
            ),
            "a fault `drift` acts on boards, not on bytes",
        ),
        (
            ("bus.dynamixel.first_id", "250"),
            "cannot have the identifier 256",
        ),
    ] {
        let registry = Registry::standard();
        let built = shipped(&registry, "trot-dynamixel.toml", &[setting]);
        let built = built.and_then(|assembly| assembly.rig().map(|_| ()));
        let text = built.unwrap_err().to_string();
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn boards_without_a_model_of_their_supply_have_no_brown_out() {
    let registry = Registry::standard();
    let fault = "[{ on = 'wire/rb110', kind = 'brown-out', for = '20 ms' }]";
    let error = shipped(&registry, "oncilla-clocks.toml", &[("fault", fault)]).err();
    let text = error.map(|error| error.to_string()).unwrap_or_default();
    assert!(
        text.contains("no board at `wire/rb110` has a fault `brown-out`"),
        "{text}"
    );
}

/// A fault that never fires is reported, so that a claim about it can fail.
#[test]
fn faults_without_effect_are_warnings() {
    let faults = "[{ on = 'wire/dynamixel/LF/hip', kind = 'drop', direction = 'in', \
                  on_frame = { nth = 3 } }, \
                  { on = 'wire/dynamixel', kind = 'drop', direction = 'in', \
                  on_frame = { after = 'reboot' } }, \
                  { on = 'wire/dynamixel', kind = 'flip', rate = 0.0 }]";
    let registry = Registry::standard();
    let settings = [("fault", faults), ("until", "'100 ms'")];
    let assembly = shipped(&registry, "trot-dynamixel.toml", &settings).unwrap();
    let report = execute(&assembly, &Execution::default()).unwrap();
    let warnings = report.warnings.iter();
    let found: Vec<&str> = warnings
        .filter(|warning| warning.code == "fault-without-effect")
        .map(|warning| warning.message.as_str())
        .collect();
    let expected = [
        "fault 2 harmed no frame: drop on wire/dynamixel, direction in, on_frame = { after = \"reboot\" }",
        "fault 3 harmed no byte: flip on wire/dynamixel",
    ];
    assert_eq!(found, expected);
}

//! Control tables against those of the vendor's library, and their own consistency.

use std::path::Path;

use serde_json::{Value, json};
use twinrig_dynamixel::x::{XL330_M288, XM430_W350, register};
use twinrig_dynamixel::{Access, Bounds, Registers, ServoModel};
use twinrig_testing::python;

/// Names of the library that stand for places in indirect registers.
const INDIRECT: &str = "indirect";

/// Compares addresses and sizes with the file of a model. The library leaves out `missing`.
fn check(model: &ServoModel, file: &str, missing: &[&str]) {
    let Some(python) = python::python("dynamixel_easy_sdk") else {
        return;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dynamixel/protocol/model.py");
    let theirs = python::run(&python, &script, &[], &json!({"model": file}));
    let mut found = Vec::new();
    for row in theirs.as_array().unwrap() {
        let Value::Array(row) = row else { panic!() };
        let name = row[2].as_str().unwrap().to_lowercase().replace(' ', "_");
        let address = row[0].as_u64().unwrap();
        if name.starts_with(INDIRECT) {
            let of = |it: &&twinrig_dynamixel::Indirect| {
                let starts = [it.addresses, it.data].map(u64::from);
                let ends = [2 * it.count, it.count].map(u64::from);
                (0..2).any(|n| (starts[n]..starts[n] + ends[n]).contains(&address))
            };
            assert!(
                model.indirect.iter().any(|it| of(&it)),
                "{name} at {address}"
            );
            continue;
        }
        let item = model
            .named(&name)
            .unwrap_or_else(|| panic!("{name} is missing"));
        assert_eq!(u64::from(item.address), address, "{name}");
        assert_eq!(u64::from(item.size), row[1].as_u64().unwrap(), "{name}");
        found.push(name);
    }
    let ours = model.items.iter().map(|item| item.name);
    let others: Vec<&str> = ours
        .filter(|name| !found.iter().any(|it| it == name))
        .collect();
    assert_eq!(others, missing);
}

#[test]
fn xl330_m288_is_that_of_the_vendors_library() {
    let missing = ["startup_configuration", "backup_ready"];
    check(XL330_M288.model, "xl330_m288_fw52", &missing);
}

#[test]
fn xm430_w350_is_that_of_the_vendors_library() {
    check(XM430_W350.model, "xm430_w350", &[]);
}

#[test]
fn roles_and_limits_refer_to_registers() {
    for (model, size) in [(XL330_M288.model, 228), (XM430_W350.model, 662)] {
        let registers = Registers::new(model);
        for item in model.items {
            assert_eq!(registers.get(item.address), item.initial, "{}", item.name);
            if let Bounds::Limit(address) = item.bounds {
                assert!(item.initial <= registers.get(address), "{}", item.name);
            }
        }
        let roles = model.roles;
        let addresses = [
            roles.status_level,
            roles.torque,
            roles.id,
            roles.baud_rate,
            register::GOAL_POSITION,
        ];
        for address in addresses {
            let item = model.item(address).unwrap();
            assert_ne!(item.access, Access::ReadOnly, "{}", item.name);
        }
        let rate = u8::try_from(registers.get(roles.baud_rate)).unwrap();
        assert_eq!(model.baud_rates.rate(rate), Some(57_600));
        assert_eq!(model.size(), size);
    }
}

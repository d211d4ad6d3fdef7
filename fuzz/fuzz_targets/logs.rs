//! Mappings and logs of arbitrary bytes, separated by a zero: no panic, and what is imported is a
//! recording with all its samples.

#![no_main]

use libfuzzer_sys::fuzz_target;
use twinrig_document::Document;
use twinrig_record::{LogLimits, LogMapping, Recording, import_log_from};

/// Mappings for logs whose mapping is empty.
const MAPPINGS: [&str; 3] = [
    "time = { column = 't' }\nsignal = [{ name = 'a', column = 'a', unit = 'mrad' }]",
    "rows = 'r'\ntime = { column = 't', unit = 'ns' }\n\
     signal = [{ name = 'a', column = 'a.0', word = 'i16', missing = 'hold', unit = '1' }]\n\
     setting = [{ key = 'k', column = 'k', optional = true }]",
    "signal = [{ name = 'a', topic = '/t', field = 'a[1].b', unit = 'V' }]",
];

fn check(mapping: &str, log: &[u8]) {
    let Ok(document) = Document::parse("mapping.toml", mapping) else {
        return;
    };
    let Ok(mapping) = LogMapping::read(&document) else {
        return;
    };
    let limits = LogLimits {
        bytes: 1 << 20,
        values: 1 << 16,
    };
    for file in ["log.json", "log.csv", "log.mcap"] {
        let Ok(log) = import_log_from(file, log, &mapping, limits) else {
            continue;
        };
        let recording = Recording::from_bytes(log.write(Vec::new(), "fuzz").unwrap()).unwrap();
        for group in &log.groups {
            for signal in &group.signals {
                let series = recording.series(&signal.name).unwrap();
                assert_eq!(series.times, *group.times);
                assert_eq!(series.values, signal.values);
            }
        }
    }
}

fuzz_target!(|data: &[u8]| {
    let mut parts = data.splitn(2, |&byte| byte == 0);
    let (mapping, log) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    match std::str::from_utf8(mapping) {
        Ok("") => MAPPINGS.iter().for_each(|mapping| check(mapping, log)),
        Ok(mapping) => check(mapping, log),
        Err(_) => {}
    }
});

//! Runs scenarios in a browser: the rig as a WebAssembly module, and the page around it, which
//! `ci/playground` makes. A scenario has the fingerprint that `twin run` prints: the module is the
//! same code, with the plants, controllers and buses of [`Registry::standard`].
//!
//! # Interface
//!
//! The module has one buffer. The host writes a [`Request`] as JSON to the address that
//! `reserve(length)` returns, calls `run()`, and reads as many bytes at `answer()` as that returns:
//! an [`Answer`] as JSON. `host.progress` receives the part of a run that is done. A trap ends the
//! module: the host makes a new one (`page/module.js`).
//!
//! # Limits
//!
//! - No files: a scenario has the robots of the program, and no file beside it. FMUs, MJCF models
//!   and benches that are files are refused.
//! - No clock: a report has no wall-clock time, and an expectation of it is unobserved.
//! - One run: no ensemble of a scenario, no sweeps, studies or optimizations, and no hardware.

#[cfg(target_family = "wasm")]
mod module;

use serde::{Deserialize, Serialize};
use twinrig_rig::{
    Assembly, Error, Execution, Registry, Report, RunObserver, RunProgress, execute_observed,
};
use twinrig_scenario::Setting;
use twinrig_view::{Run, page};

/// A scenario to run.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Name of its file, for messages.
    pub file: String,
    /// Its text.
    pub text: String,
    /// Time at which the run ends at the latest, as `--until` has it.
    #[serde(default)]
    pub until: Option<String>,
    /// What the answer is to have.
    pub wanted: Wanted,
}

/// Contents of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Wanted {
    /// The first mistakes of the scenario, which does not run.
    Check,
    /// The report of the run.
    Report,
    /// The report and the page of the run.
    Page,
}

/// Result of a request.
#[derive(Debug, Default, Serialize)]
pub struct Answer {
    /// Report of a run that could start.
    pub report: Option<Box<Report>>,
    /// Reason for which it cannot start, with place and help.
    pub error: Option<String>,
    /// Page of the run in HTML.
    pub page: Option<String>,
    /// Part of the scenario that is not run.
    pub left_out: Option<&'static str>,
}

const ENSEMBLE: &str = "the ensemble of the scenario: this is its first run";

/// Runs a scenario; `progress` receives the part of it that is done, from 0 to 1.
pub fn answer(request: &[u8], progress: &mut dyn FnMut(f64)) -> Answer {
    let read = serde_json::from_slice(request).map_err(|error| error.to_string());
    let answer = read.and_then(|request| {
        let answer = run(&request, &mut Polled(progress));
        answer.map_err(|error| error.to_string())
    });
    answer.unwrap_or_else(|error| Answer {
        error: Some(error),
        ..Answer::default()
    })
}

fn run(request: &Request, observer: &mut dyn RunObserver) -> Result<Answer, Error> {
    let registry = Registry::standard();
    let until = request.until.iter().map(|until| Setting {
        origin: "--until".to_owned(),
        key: "until".to_owned(),
        value: until.clone(),
    });
    let settings: Vec<Setting> = until.collect();
    let builder = Assembly::builder(&registry).settings(&settings);
    let assembly = builder.text(&request.file, &request.text, "".as_ref())?;
    let left_out = assembly.scenario().ensemble.as_ref().map(|_| ENSEMBLE);
    match request.wanted {
        Wanted::Check => return Ok(Answer::default()),
        Wanted::Report => {
            let report = execute_observed(&assembly, &Execution::default(), observer)?;
            return Ok(Answer {
                report: Some(Box::new(report)),
                left_out,
                ..Answer::default()
            });
        }
        Wanted::Page => {}
    }
    let run = Run::compute(assembly, &request.file, Some(observer))?;
    let report = run.report().cloned().map(Box::new);
    let command = format!("twin run {} --report", request.file);
    let page = page(&[run], false, &command).map_err(|source| Error::Record {
        path: request.file.clone().into(),
        source,
    })?;
    Ok(Answer {
        report,
        error: None,
        page: Some(page.html),
        left_out,
    })
}

/// Passes the progress on.
struct Polled<'p>(&'p mut dyn FnMut(f64));

impl RunObserver for Polled<'_> {
    fn poll(&mut self, progress: &RunProgress<'_>) {
        let end_s = progress.end.as_secs_f64();
        self.0(progress.now.as_secs_f64() / end_s.max(f64::MIN_POSITIVE));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(text: &str, wanted: &str) -> Answer {
        let request = serde_json::json!({ "file": "a.toml", "text": text, "wanted": wanted });
        answer(request.to_string().as_bytes(), &mut |_| {})
    }

    const HANGS: &str = "robot = 'cheetah-cub'\nduration = '0.1 s'\nplant = { model = 'massless' }";

    #[test]
    fn mistake_has_its_place() {
        let text = HANGS.replace("duration", "durration");
        for wanted in ["check", "report", "page"] {
            let error = asked(&text, wanted).error.unwrap();
            assert!(error.contains("a.toml:2:1"), "{error}");
        }
        assert!(asked(HANGS, "check").error.is_none());
        let error = answer(b"{}", &mut |_| {}).error.unwrap();
        assert!(error.contains("missing field"), "{error}");
    }

    #[test]
    fn page_is_of_the_run() {
        let [report, page] = ["report", "page"].map(|wanted| asked(HANGS, wanted));
        let fingerprint = |answer: &Answer| answer.report.as_ref().unwrap().fingerprint.clone();
        assert!(fingerprint(&report).is_some());
        assert_eq!(fingerprint(&report), fingerprint(&page));
        assert!(report.page.is_none());
        let html = page.page.unwrap();
        assert!(html.contains(&fingerprint(&report).unwrap()));
    }

    #[test]
    fn progress_grows_up_to_the_end() {
        let request = serde_json::json!({ "file": "a.toml", "text": HANGS, "wanted": "report" });
        let mut shares = Vec::new();
        answer(request.to_string().as_bytes(), &mut |share| {
            shares.push(share);
        });
        assert!(
            shares.is_sorted() && shares.last() <= Some(&1.0),
            "{shares:?}"
        );
        assert!(!shares.is_empty());
    }
}

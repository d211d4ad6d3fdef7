//! Requests of studies by the command line, and their reports.

use std::path::{Path, PathBuf};

use serde_json::Value;
use twinrig_report::page::Page;
use twinrig_report::summary::Summary;
use twinrig_rig::error::Error as RigError;
use twinrig_rig::registry::Registry;
use twinrig_scenario::Setting;

use crate::error::{Error, first_line};
use crate::machine::Machine;
use crate::progress::ProgressObserver;

/// Greatest number of scenarios in the name of a file.
const NAMED: usize = 5;

/// Options that all studies have, and the name of the study.
#[derive(Clone, Copy, Debug)]
pub struct StudyFrame<'a> {
    /// Name of the study.
    pub name: &'static str,
    /// Scenario files; none of a study without a scenario.
    pub scenarios: &'a [PathBuf],
    /// Plants, where they are not those of the scenarios.
    pub plants: &'a [String],
    /// Keys of the scenarios with their values.
    pub set: &'a [(String, String)],
    /// Folder of the files.
    pub out: &'a Path,
    /// Whether the report is JSON.
    pub json: bool,
}

impl StudyFrame<'_> {
    /// Returns the settings of all scenarios.
    pub fn settings(self) -> Vec<Setting> {
        let set = self.set.iter().map(|(key, value)| Setting {
            origin: "--set".to_owned(),
            key: key.clone(),
            value: value.clone(),
        });
        set.collect()
    }

    /// Returns the name of the files of the study.
    pub fn stem(self) -> String {
        let stems = self.scenarios.iter().map(|path| stem(path));
        let stems: Vec<_> = stems.collect();
        if stems.is_empty() {
            return self.name.to_owned();
        }
        if let [first, others @ ..] = &*stems
            && others.len() >= NAMED
        {
            return format!("{}-{first}-and-{}-more", self.name, others.len());
        }
        format!("{}-{}", self.name, stems.join("-"))
    }
}

/// Returns the name of the file of a scenario.
pub(crate) fn stem(path: &Path) -> String {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy());
    stem.map_or_else(|| "scenario".to_owned(), std::borrow::Cow::into_owned)
}

/// Returns the plants with these names, or none for the scenario's own.
pub(crate) fn plants(names: &[String]) -> Vec<Option<&str>> {
    match names {
        [] => vec![None],
        names => names.iter().map(|name| Some(&**name)).collect(),
    }
}

/// Returns the line on a scenario that a plant cannot simulate, for the parts left out.
pub(crate) fn left_out(name: &str, plant: Option<&str>, error: &Error) -> String {
    let on = plant.map_or(String::new(), |plant| format!(" on {plant}"));
    format!("{name}{on}: {}", first_line(&error.to_string()))
}

/// Everything that a study is given beside its options.
pub struct StudyContext<'a> {
    /// Kinds of plants, buses and controllers.
    pub registry: &'a Registry,
    /// Settings of all scenarios.
    pub settings: &'a [Setting],
    /// The machine, for reports.
    pub machine: &'a Machine,
    /// The command, for reports.
    pub command: &'a str,
    /// Sees the progress, and can stop the study.
    pub observer: &'a mut dyn ProgressObserver,
}

/// Options of a study, which can do it.
pub trait StudyRequest {
    /// Returns the options that all studies have.
    fn frame(&self) -> StudyFrame<'_>;

    /// Checks options against one another, before anything is read.
    ///
    /// # Errors
    /// An element of a list that is given twice, which would count twice.
    fn check(&self) -> Result<(), Error> {
        unique("--plant", self.frame().plants)
    }

    /// Does the study.
    ///
    /// # Errors
    /// [`Error`] of scenarios, or of the study as a whole.
    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error>;
}

/// Checks that no element of the list of an option is given twice.
pub(crate) fn unique<T: PartialEq + ToString>(option: &str, list: &[T]) -> Result<(), Error> {
    let mut elements = list.iter().enumerate();
    match elements.find(|(index, element)| list[..*index].contains(element)) {
        None => Ok(()),
        Some((_, element)) => Err(Error::from(RigError::InvalidOptions {
            why: format!("{option} has `{}` twice", element.to_string()),
            help: "give it once".to_owned(),
        })),
    }
}

/// Report of a study in all its forms.
#[derive(Clone, Debug)]
pub struct StudyReport {
    /// Summary for terminals.
    pub summary: Summary,
    /// Page.
    pub page: Page,
    /// Rows as comma-separated values.
    pub csv: String,
    /// Everything.
    pub json: Value,
    /// Tables for documents; none of most studies.
    pub markdown: Option<String>,
    /// Error of a study in which a part panicked, or that has no result.
    pub error: Option<String>,
    /// Whether the answer is no.
    pub is_negative: bool,
    /// Reports of further studies of the same scenarios, with the names of their files.
    pub further: Vec<(String, StudyReport)>,
}

impl StudyReport {
    /// Creates the report of a study that has a result.
    pub(crate) fn new(summary: Summary, page: Page, csv: String, json: Value) -> Self {
        Self {
            summary,
            page,
            csv,
            json,
            markdown: None,
            error: None,
            is_negative: false,
            further: Vec::new(),
        }
    }

    /// Returns the text for terminals; the names of all files are at the end.
    pub fn text(self, files: &[PathBuf]) -> String {
        let further = self.further.into_iter().map(|(_, report)| report.summary);
        let mut summaries: Vec<Summary> = std::iter::once(self.summary).chain(further).collect();
        let last = summaries.pop().map(|summary| summary.finish(files));
        let texts = summaries.into_iter().map(|summary| summary.finish(&[]));
        let texts = texts.chain(last).map(|text| text.trim_end().to_owned());
        texts.collect::<Vec<_>>().join("\n\n")
    }

    /// Writes the page, the CSV and the JSON file, and tables in Markdown, also of further studies;
    /// returns their paths.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, folder: &Path, stem: &str) -> Result<Vec<PathBuf>, Error> {
        let mut texts = vec![
            ("html", self.page.html()),
            ("csv", self.csv.clone()),
            ("json", format!("{:#}\n", self.json)),
        ];
        texts.extend(self.markdown.clone().map(|text| ("md", text)));
        let mut files = Vec::new();
        for (ending, text) in texts {
            let path = folder.join(format!("{stem}.{ending}"));
            std::fs::write(&path, text).map_err(|source| RigError::Write {
                path: path.clone(),
                source,
            })?;
            files.push(path);
        }
        for (stem, report) in &self.further {
            files.extend(report.write(folder, stem)?);
        }
        Ok(files)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn name_of_the_files_has_at_most_five_scenarios() {
        let stem = |count: usize| {
            let names = ["a", "b", "c", "d", "e", "f"].into_iter().take(count);
            let scenarios: Vec<PathBuf> = names.map(|name| format!("{name}.toml").into()).collect();
            let frame = StudyFrame {
                name: "gait",
                scenarios: &scenarios,
                plants: &[],
                set: &[],
                out: Path::new("studies"),
                json: false,
            };
            frame.stem()
        };
        assert_eq!(stem(5), "gait-a-b-c-d-e");
        assert_eq!(stem(6), "gait-a-and-5-more");
    }
}

//! Moves of the inputs: which verdicts depend on which numbers.
//!
//! The numbers are those that the items read ([`probe`]); none is listed here. Assumed and fitted
//! ones are moved by 10 %, others by 2 %, one at a time. A number in an expectation is a part of a
//! measurement, not of what is measured, and is not moved.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use twinrig_campaign::engine::{Engine, EngineEvent, EngineOptions, Job, LocalEngine};
use twinrig_document::probe::{self, Number, Probe};

use crate::error::ThesisError;
use crate::error::TwinError;
use crate::progress::Progress;
use crate::thesis::context::Context;
use crate::thesis::item::Item;
use crate::thesis::progress::ItemProgress;
use crate::thesis::result::ItemResult;
use crate::thesis::verdict::Verdict;
use twinrig_rig::registry::Registry;
use twinrig_rig::run::interrupt;

/// Relative moves of numbers that are assumed or fitted, and of the others.
const FREE_MOVE: f64 = 0.1;
const SET_MOVE: f64 = 0.02;
/// Words of comments by which a file marks such numbers.
const FREE_MARKS: [&str; 2] = ["ASSUMED", "FITTED"];
/// Tables of a scenario whose numbers are not inputs of what happens.
const NOT_INPUTS: [&str; 2] = ["expect.", "record."];
/// Folder of the searches, whose dimensions are fitted, below that of the scenarios.
const SEARCHES: &str = "optimizations";

/// Flips of several items. The field names are the JSON keys.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Flips {
    /// Version of the program.
    pub build: String,
    /// Items that read numbers.
    pub items: Vec<ItemFlips>,
}

/// Flips of an item.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ItemFlips {
    /// Identifier of the item.
    pub id: String,
    /// Number of assumed or fitted numbers that were moved, and of others.
    pub moved: [usize; 2],
    /// Number of moves that scenario or robot refuse.
    pub refused: usize,
    /// Moves that flip a verdict, for each figure that has any.
    pub figures: Vec<FigureFlips>,
}

/// Flips of a figure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FigureFlips {
    /// Key of the measurement, and place, of the figure.
    pub key: String,
    /// Section, figure or table.
    pub place: String,
    /// Verdict without a move.
    pub verdict: Verdict,
    /// Moves, the least first.
    pub by: Vec<Flip>,
}

/// Move that flips a verdict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Flip {
    /// File of the number.
    pub file: String,
    /// Its key.
    pub key: String,
    /// Relative move.
    pub by: f64,
    /// Verdict then.
    pub verdict: Verdict,
}

/// A number and its relative move.
#[derive(Clone, Debug, PartialEq)]
struct Move {
    number: Number,
    by: f64,
}

impl ItemFlips {
    /// Returns the flips of a figure for readers: `flips at -10 % of leg.aslp.l1 (3 of 95 inputs)`.
    pub(crate) fn text(&self, key: &str, place: &str) -> String {
        let moved = self.moved[0] + self.moved[1];
        let Some(figure) = self.figure(key, place) else {
            return format!("flips under no move of {moved} inputs");
        };
        let numbers: BTreeSet<_> = figure.by.iter().map(|one| (&one.file, &one.key)).collect();
        let Some(least) = figure.by.first() else {
            return String::new();
        };
        let by = 100.0 * least.by;
        let count = numbers.len();
        format!(
            "flips at {by:+} % of {} ({count} of {moved} inputs)",
            least.key
        )
    }

    /// Returns the flips of a figure; none if no move flips it.
    fn figure(&self, key: &str, place: &str) -> Option<&FigureFlips> {
        let mut figures = self.figures.iter();
        figures.find(|figure| (figure.key.as_str(), figure.place.as_str()) == (key, place))
    }
}

impl Flips {
    /// Returns the flips of an item; none if it reads no number, or was not run.
    pub(crate) fn item(&self, id: &str) -> Option<&ItemFlips> {
        self.items.iter().find(|item| item.id == id)
    }
}

/// Items that are measured under moves.
pub(crate) struct FlipRun<'r> {
    registry: &'r Registry,
    items: Vec<&'static Item>,
    scenarios: PathBuf,
}

/// Outcome of an item without a move.
struct Unmoved {
    result: ItemResult,
    numbers: BTreeMap<Number, String>,
}

impl<'r> FlipRun<'r> {
    pub(crate) fn new(registry: &'r Registry, items: Vec<&'static Item>, scenarios: &Path) -> Self {
        Self {
            registry,
            items,
            scenarios: scenarios.to_owned(),
        }
    }

    /// Moves every number that the items read.
    ///
    /// # Errors
    /// Errors of an item without a move; [`ThesisError::Interrupted`].
    pub(crate) fn all(&self, build: &str, progress: Progress) -> Result<Flips, TwinError> {
        let unmoved = self.unmoved()?;
        let numbers: BTreeMap<&Number, &String> =
            unmoved.iter().flat_map(|item| &item.numbers).collect();
        let mut moves = Vec::new();
        for (number, comment) in numbers {
            let size = self.size(number, comment);
            moves.extend([-size, size].map(|by| Move {
                number: number.clone(),
                by,
            }));
        }
        let moved = self.measure(&moves, &unmoved, progress)?;
        let items = self.items.iter().zip(&unmoved).enumerate();
        let items = items.filter(|(_, (_, unmoved))| !unmoved.numbers.is_empty());
        let items = items.map(|(n, (item, unmoved))| {
            let of_item = |found: &[Option<ItemResult>]| found[n].clone();
            let results = moves.iter().zip(&moved);
            let results: Vec<(&Move, Option<ItemResult>)> = results
                .filter(|(one, _)| unmoved.numbers.contains_key(&one.number))
                .map(|(one, found)| (one, of_item(found)))
                .collect();
            let count = |size: f64| {
                let of_size = |one: &&Number| self.size(one, &unmoved.numbers[*one]) == size;
                unmoved.numbers.keys().filter(of_size).count()
            };
            ItemFlips {
                id: item.id.to_owned(),
                moved: [count(FREE_MOVE), count(SET_MOVE)],
                refused: results.iter().filter(|(_, found)| found.is_none()).count(),
                figures: flips(&unmoved.result, &results),
            }
        });
        Ok(Flips {
            build: build.to_owned(),
            items: items.collect(),
        })
    }

    /// Repeats the least recorded move of each figure; returns the figures whose verdict it does
    /// not change as recorded, and the number of moves.
    ///
    /// # Errors
    /// As [`Self::all`].
    pub(crate) fn repeat(
        &self,
        recorded: &Flips,
        progress: Progress,
    ) -> Result<(Vec<String>, usize), TwinError> {
        let unmoved = self.unmoved()?;
        let mut moves: Vec<Move> = Vec::new();
        let mut expected = Vec::new();
        for (n, item) in self.items.iter().enumerate() {
            let figures = recorded.item(item.id).into_iter();
            for figure in figures.flat_map(|item| &item.figures) {
                let Some(flip) = figure.by.first() else {
                    continue;
                };
                let one = Move {
                    number: Number {
                        file: flip.file.clone(),
                        key: flip.key.clone(),
                    },
                    by: flip.by,
                };
                let index = moves.iter().position(|known| *known == one);
                let index = index.unwrap_or_else(|| {
                    moves.push(one);
                    moves.len() - 1
                });
                expected.push((n, figure, flip, index));
            }
        }
        let moved = self.measure(&moves, &unmoved, progress)?;
        let mut departures = Vec::new();
        for (n, figure, flip, index) in expected {
            let result = moved[index][n].as_ref();
            let result = result.and_then(|item| item.of_figure(&figure.key, &figure.place));
            let verdict = result.map(|figure| figure.verdict);
            if verdict != Some(flip.verdict) {
                departures.push(format!(
                    "{}, {}: {} under {} {} {:+} %, recorded as {}",
                    self.items[n].id,
                    figure.key,
                    verdict.map_or("refused", Verdict::words),
                    flip.file,
                    flip.key,
                    100.0 * flip.by,
                    flip.verdict.words()
                ));
            }
        }
        Ok((departures, moves.len()))
    }

    /// Returns the relative size of the moves of a number.
    fn size(&self, number: &Number, comment: &str) -> f64 {
        let key = number.key.rsplit('.').next().unwrap_or_default();
        // A comment on several values of a line: `stiffness: T, 2.7; preload: ASSUMED`.
        let own = comment.split(';').find_map(|part| {
            let (name, source) = part.split_once(':')?;
            (name.trim() == key).then_some(source)
        });
        let is_marked = FREE_MARKS
            .iter()
            .any(|mark| own.unwrap_or(comment).contains(mark));
        if is_marked || self.is_searched(number) {
            FREE_MOVE
        } else {
            SET_MOVE
        }
    }

    /// Returns whether a search of the scenario has the number as a dimension.
    fn is_searched(&self, number: &Number) -> bool {
        let name = Path::new(&number.file).file_name().unwrap_or_default();
        let search = self.scenarios.join(SEARCHES).join(name);
        let text = std::fs::read_to_string(search).unwrap_or_default();
        text.contains(&format!("\"{}\"", number.key))
    }

    fn context(&self) -> Context<'_> {
        let progress = ItemProgress::new(&[], Progress::new("", false));
        Context::new(self.registry, &self.scenarios, Vec::new(), progress)
    }

    /// Measures all items without a move.
    fn unmoved(&self) -> Result<Vec<Unmoved>, TwinError> {
        let unmoved = self.items.iter().map(|item| {
            let probe = Probe::new();
            // A context of its own, as a study that it keeps would not be read again.
            let measured = probe::within(Some(probe.clone()), || (item.measure)(&self.context()))?;
            let mut numbers = probe.numbers();
            numbers.retain(|number, _| is_input(number));
            Ok(Unmoved {
                result: ItemResult::of(item, &measured),
                numbers,
            })
        });
        unmoved.collect()
    }

    /// Measures the items that read a moved number, for each move; none for an item that does not
    /// read it or refuses the move.
    fn measure(
        &self,
        moves: &[Move],
        unmoved: &[Unmoved],
        progress: Progress,
    ) -> Result<Vec<Vec<Option<ItemResult>>>, TwinError> {
        let job = MoveJob {
            run: self,
            moves,
            unmoved,
        };
        let mut progress = progress;
        let (mut found, mut done) = (vec![vec![None; self.items.len()]; moves.len()], 0);
        let tasks: Vec<usize> = (0..moves.len()).collect();
        let ended = LocalEngine.run(&job, &tasks, &EngineOptions::default(), &mut |event| {
            if let EngineEvent::Done { task, result } = event {
                done += 1;
                progress.part(done, moves.len(), &moves[task].number.key);
                // A panic of one move is a refusal of it.
                let results = result
                    .ok()
                    .and_then(|bytes| serde_json::from_slice(&bytes).ok());
                found[task] = results.unwrap_or_else(|| vec![None; self.items.len()]);
            }
            !interrupt::is_requested()
        });
        if interrupt::is_requested() {
            let of = moves.len();
            return Err(ThesisError::Interrupted { done, of }.into());
        }
        ended.map(|_| found).map_err(|error| {
            let reason = error.to_string();
            let file = String::new();
            ThesisError::Run { file, reason }.into()
        })
    }
}

/// Returns whether a number is an input of what happens in a run.
fn is_input(number: &Number) -> bool {
    let is_file = number.file.contains('/');
    is_file && !NOT_INPUTS.iter().any(|table| number.key.starts_with(table))
}

/// Returns the flips of the figures of an item, the least move first.
fn flips(unmoved: &ItemResult, moved: &[(&Move, Option<ItemResult>)]) -> Vec<FigureFlips> {
    let figures = unmoved.figures.iter().filter(|figure| !figure.timing);
    let figures = figures.map(|figure| {
        let flips = moved.iter().filter_map(|(one, result)| {
            let verdict = result.as_ref()?.figure(figure)?.verdict;
            (verdict != figure.verdict).then(|| Flip {
                file: one.number.file.clone(),
                key: one.number.key.clone(),
                by: one.by,
                verdict,
            })
        });
        let mut by: Vec<Flip> = flips.collect();
        by.sort_by(|a, b| a.by.abs().total_cmp(&b.by.abs()));
        FigureFlips {
            key: figure.key.clone(),
            place: figure.place.clone(),
            verdict: figure.verdict,
            by,
        }
    });
    figures.filter(|figure| !figure.by.is_empty()).collect()
}

/// A task is a move.
struct MoveJob<'j, 'r> {
    run: &'j FlipRun<'r>,
    moves: &'j [Move],
    unmoved: &'j [Unmoved],
}

impl Job for MoveJob<'_, '_> {
    fn shared(&self) -> Vec<u8> {
        Vec::new()
    }

    fn task(&self, _: usize) -> Vec<u8> {
        Vec::new()
    }

    fn run(&self, index: usize) -> Option<Vec<u8>> {
        let one = &self.moves[index];
        let probe = Probe::moving(one.number.clone(), 1.0 + one.by);
        // One context, so that items share the studies.
        let context = self.run.context();
        let results = probe::within(Some(probe), || {
            let items = self.run.items.iter().zip(self.unmoved);
            let results = items.map(|(item, unmoved)| {
                unmoved.numbers.get(&one.number)?;
                let measured = (item.measure)(&context).ok()?;
                Some(ItemResult::of(item, &measured))
            });
            results.collect::<Vec<_>>()
        });
        if interrupt::is_requested() {
            return None;
        }
        serde_json::to_vec(&results).ok()
    }
}

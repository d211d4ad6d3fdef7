//! All items, in the order of the thesis.

use crate::thesis::item::Item;
use crate::thesis::{chapter_1, chapter_2, chapter_4_bench, chapter_4_cells, chapter_5};

/// Items of each chapter.
const CHAPTERS: [&[Item]; 5] = [
    chapter_1::ITEMS,
    chapter_2::ITEMS,
    chapter_4_cells::ITEMS,
    chapter_4_bench::ITEMS,
    chapter_5::ITEMS,
];

/// Returns all items.
pub(crate) fn items() -> impl Iterator<Item = &'static Item> {
    CHAPTERS.into_iter().flatten()
}

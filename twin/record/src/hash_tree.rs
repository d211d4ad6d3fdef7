//! BLAKE3 of a long input as a tree of hashed blocks, whose state can be saved.

use blake3::Hasher;
use blake3::hazmat::{
    ChainingValue, HasherExt, Mode, merge_subtrees_non_root, merge_subtrees_root,
};
use serde::{Deserialize, Serialize};

/// Number of bytes of a block: a power of two of BLAKE3's chunks, so that a block is a subtree.
pub(crate) const BLOCK: usize = 64 * 1024;

/// Greatest number of subtrees: one for each bit of the number of blocks in 2⁶⁴ bytes.
const DEPTH: usize = 48;

/// Hash of the blocks of an input so far. [`blake3::Hasher`] hides its state; this one consists of
/// the chaining values of the complete subtrees, largest first: one for each bit that is set in the
/// number of blocks.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct HashTree {
    blocks: u64,
    subtrees: Vec<ChainingValue>,
}

impl HashTree {
    pub(crate) fn new() -> Self {
        Self {
            blocks: 0,
            subtrees: Vec::with_capacity(DEPTH),
        }
    }

    /// Returns whether the state is one that [`HashTree::push`] leads to.
    pub(crate) fn is_valid(&self) -> bool {
        self.blocks < 1 << DEPTH && self.subtrees.len() == self.blocks.count_ones() as usize
    }

    /// Returns whether there are no blocks.
    pub(crate) fn is_empty(&self) -> bool {
        self.blocks == 0
    }

    /// Adds a block, which must not be the end of the input: the last node of the tree is hashed
    /// in another way.
    pub(crate) fn push(&mut self, block: &[u8; BLOCK]) {
        let mut value = self.subtree(block);
        self.blocks += 1;
        // Two subtrees of equal size make one.
        for _ in 0..self.blocks.trailing_zeros() {
            if let Some(left) = self.subtrees.pop() {
                value = merge_subtrees_non_root(&left, &value, Mode::Hash);
            }
        }
        self.subtrees.push(value);
    }

    /// Returns the hash of the blocks and of `end`, which has at most the length of a block and is
    /// not empty where there are blocks.
    pub(crate) fn finish(&self, end: &[u8]) -> [u8; 32] {
        let Some((root, others)) = self.subtrees.split_first() else {
            return *blake3::hash(end).as_bytes();
        };
        let right = others.iter().rev().fold(self.subtree(end), |right, left| {
            merge_subtrees_non_root(left, &right, Mode::Hash)
        });
        *merge_subtrees_root(root, &right, Mode::Hash).as_bytes()
    }

    /// Returns the chaining value of the bytes behind the blocks.
    fn subtree(&self, bytes: &[u8]) -> ChainingValue {
        let mut hasher = Hasher::new();
        hasher.set_input_offset(self.blocks * BLOCK as u64);
        hasher.update(bytes).finalize_non_root()
    }
}

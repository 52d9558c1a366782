//! Orders that are balanced: in every block of four, two begin with the one and two with the other.

const BLOCKS: [[bool; 4]; 6] = [
    [true, true, false, false],
    [true, false, true, false],
    [true, false, false, true],
    [false, true, true, false],
    [false, true, false, true],
    [false, false, true, true],
];

/// Whether the one comes first at this place (0, 1, ...); `lot` is the draw of the block that the place belongs to.
pub(crate) fn comes_first(lot: u64, place: usize) -> bool {
    let block = lot % BLOCKS.len() as u64;
    BLOCKS[usize::try_from(block).unwrap_or(0)][place % 4]
}

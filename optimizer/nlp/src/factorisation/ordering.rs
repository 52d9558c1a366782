//! Elimination order of the KKT matrix.
//!
//! With elimination blocks: blocks in ascending order (children before parents), and within a block each row next to
//! a variable that it is structurally matched with, so that no supernode starts with an unmatched row, whose diagonal
//! may be zero. Without blocks the factorisation uses approximate minimum degree.

use super::kkt_matrix::couplings;
use crate::formulation::{Formulation, RowForm};
use crate::nonlinear_program::EliminationBlocks;
use crate::status::NlpError;

/// Block of each index of the KKT matrix (variables, then rows).
pub(super) fn block_of_index(blocks: &EliminationBlocks) -> Vec<usize> {
    blocks.block_of_variable.iter().chain(&blocks.block_of_row).copied().collect()
}

/// Checks that the blocks form a forest and that every coupling is between a block and an ancestor.
pub(crate) fn check_blocks(form: &Formulation, blocks: &EliminationBlocks) -> Result<(), NlpError> {
    let fail = |what: String| Err(NlpError::InvalidProblem(format!("elimination blocks: {what}")));
    let count = blocks.parent.len();
    if blocks.block_of_variable.len() != form.n || blocks.block_of_row.len() != form.m {
        return fail(format!(
            "they cover {} of {} variables and {} of {} rows",
            blocks.block_of_variable.len(),
            form.n,
            blocks.block_of_row.len(),
            form.m
        ));
    }
    for (b, parent) in blocks.parent.iter().enumerate() {
        if let Some(p) = parent.filter(|&p| p <= b || p >= count) {
            return fail(format!("the parent of block {b} is {p}; it must be more than {b} and less than {count}"));
        }
    }
    let of = block_of_index(blocks);
    if let Some(b) = of.iter().find(|&&b| b >= count) {
        return fail(format!("block {b} does not exist"));
    }
    for (i, j) in couplings(form) {
        let (mut low, high) = (of[i].min(of[j]), of[i].max(of[j]));
        while low < high {
            let Some(parent) = blocks.parent[low] else { break };
            low = parent;
        }
        if low != high {
            return fail(format!(
                "entry ({i}, {j}) couples blocks {} and {}, of which neither is an ancestor of the other",
                of[i], of[j]
            ));
        }
    }
    Ok(())
}

/// Block of each index, with unmatched equality rows moved up to the nearest ancestor that has a variable of the row:
/// in its own block the pivot of such a row would be the regularisation alone. Rows that a descendant couples with
/// have a pivot from its Schur complement and stay.
pub(super) fn block_of_index_raised(form: &Formulation, blocks: &EliminationBlocks) -> Vec<usize> {
    let mut of = block_of_index(blocks);
    let pattern = form.program.jacobian_pattern();
    let mut from_below = vec![false; form.m];
    for j in 0..form.n {
        for &i in &pattern.row_indices[pattern.column_starts[j]..pattern.column_starts[j + 1]] {
            from_below[i] |= of[j] < of[form.n + i];
        }
    }
    let candidate = |i: usize| matches!(form.rows[i], RowForm::Equality(_)) && !from_below[i];
    let mut nearest = vec![usize::MAX; form.m];
    for j in (0..form.n).filter(|&j| form.fixed[j].is_none()) {
        for &i in &pattern.row_indices[pattern.column_starts[j]..pattern.column_starts[j + 1]] {
            // The blocks that a row couples with are on one branch, so the nearest ancestor has the smallest number.
            if of[j] > blocks.block_of_row[i] {
                nearest[i] = nearest[i].min(of[j]);
            }
        }
    }
    // Augmenting paths keep matched rows matched, so rows that can be moved up come last.
    let mut rows: Vec<usize> = (0..form.m).filter(|&i| candidate(i)).collect();
    rows.sort_by_key(|&i| nearest[i] < usize::MAX);
    let partner = match_rows(form, &rows, |i, j| of[j] == of[form.n + i]);
    for i in rows.into_iter().filter(|&i| partner[i].is_none() && nearest[i] < usize::MAX) {
        of[form.n + i] = nearest[i];
    }
    of
}

/// Elimination order from blocks: position -> index.
#[cfg(feature = "supernodal")]
pub(super) fn block_order(form: &Formulation, blocks: &EliminationBlocks) -> Vec<usize> {
    let rows: Vec<usize> = (0..form.m).collect();
    let partner = match_rows(form, &rows, |i, j| blocks.block_of_variable[j] == blocks.block_of_row[i]);
    let mut row_of_variable = vec![None; form.n];
    for (i, variable) in partner.iter().enumerate() {
        if let Some(j) = variable {
            row_of_variable[*j] = Some(i);
        }
    }
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); blocks.parent.len()];
    for j in 0..form.n {
        let list = &mut members[blocks.block_of_variable[j]];
        list.push(j);
        if let Some(i) = row_of_variable[j] {
            list.push(form.n + i);
        }
    }
    for i in 0..form.m {
        if partner[i].is_none() {
            members[blocks.block_of_row[i]].push(form.n + i);
        }
    }
    members.into_iter().flatten().collect()
}

/// Structural matching of rows, in this order, with free variables by augmenting paths over the entries (row,
/// variable) that are `allowed`; `None` for unmatched rows.
fn match_rows(form: &Formulation, rows: &[usize], allowed: impl Fn(usize, usize) -> bool) -> Vec<Option<usize>> {
    let pattern = form.program.jacobian_pattern();
    let mut columns_of_row: Vec<Vec<usize>> = vec![Vec::new(); form.m];
    for j in 0..form.n {
        if form.fixed[j].is_some() {
            continue;
        }
        for q in pattern.column_starts[j]..pattern.column_starts[j + 1] {
            let i = pattern.row_indices[q];
            if allowed(i, j) {
                columns_of_row[i].push(j);
            }
        }
    }
    let mut row_of: Vec<Option<usize>> = vec![None; form.n];
    let mut partner: Vec<Option<usize>> = vec![None; form.m];
    let mut seen = vec![usize::MAX; form.n];
    for &start in rows {
        // Depth-first search for an augmenting path: (row, next column to try).
        let mut path: Vec<(usize, usize)> = vec![(start, 0)];
        let mut via: Vec<usize> = Vec::new();
        while let Some(&mut (row, ref mut next)) = path.last_mut() {
            let Some(&j) = columns_of_row[row].get(*next) else {
                path.pop();
                via.pop();
                continue;
            };
            *next += 1;
            if seen[j] == start {
                continue;
            }
            seen[j] = start;
            via.push(j);
            if let Some(owner) = row_of[j] {
                path.push((owner, 0));
            } else {
                for (&(r, _), &c) in path.iter().zip(&via) {
                    row_of[c] = Some(r);
                    partner[r] = Some(c);
                }
                break;
            }
        }
    }
    partner
}

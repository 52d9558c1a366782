//! Symbolic analysis: the tree of fronts from the pattern of the matrix and the front of each index.

use super::front::{ChildMap, Front, FrontPlace, PivotKind, RoomForDeferred};

/// The indices of each front, in a postorder of the forest: every subtree is contiguous and ends with its root.
pub(super) fn postordered(column_starts: &[usize], row_indices: &[usize], front_of: &[usize]) -> Vec<Vec<usize>> {
    let count = front_of.iter().max().map_or(0, |f| f + 1);
    // The parent of a front is the first front that its border, extended by those of its children, couples with.
    let mut reach: Vec<Vec<usize>> = vec![Vec::new(); count];
    for j in 0..front_of.len() {
        for &i in &row_indices[column_starts[j]..column_starts[j + 1]] {
            let (a, b) = (front_of[i].min(front_of[j]), front_of[i].max(front_of[j]));
            if a != b {
                reach[a].push(b);
            }
        }
    }
    let mut parent = vec![None; count];
    for f in 0..count {
        let mut list = std::mem::take(&mut reach[f]);
        list.sort_unstable();
        list.dedup();
        if let Some(&p) = list.first() {
            parent[f] = Some(p);
            reach[p].extend(list.iter().copied().filter(|&g| g != p));
        }
    }
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); count];
    for f in 0..count {
        if let Some(p) = parent[f] {
            children[p].push(f);
        }
    }
    let mut sequence = Vec::with_capacity(count);
    for root in (0..count).filter(|&f| parent[f].is_none()) {
        let mut path = vec![(root, 0)];
        while let Some((f, next)) = path.last_mut() {
            if let Some(&child) = children[*f].get(*next) {
                *next += 1;
                path.push((child, 0));
            } else {
                sequence.push(*f);
                path.pop();
            }
        }
    }
    let mut members: Vec<Vec<usize>> = vec![Vec::new(); count];
    for (i, &f) in front_of.iter().enumerate() {
        members[f].push(i);
    }
    sequence.into_iter().map(|f| std::mem::take(&mut members[f])).filter(|m| !m.is_empty()).collect()
}

/// The structure of every front; `None` where a front is too large for its offsets.
pub(super) fn analyse(
    column_starts: &[usize],
    row_indices: &[usize],
    members: &[Vec<usize>],
    kinds: &[PivotKind],
    room: RoomForDeferred,
) -> Option<Vec<Front>> {
    let order = column_starts.len() - 1;
    let count = members.len();
    let (mut front_of, mut rank) = (vec![0; order], vec![0; order]);
    let mut next = 0;
    for (f, list) in members.iter().enumerate() {
        for &i in list {
            front_of[i] = f;
            rank[i] = next;
            next += 1;
        }
    }
    // Entries belong to the front of their earlier index.
    let mut entries: Vec<Vec<(usize, usize, usize)>> = vec![Vec::new(); count];
    for j in 0..order {
        for q in column_starts[j]..column_starts[j + 1] {
            let i = row_indices[q];
            let (first, last) = if rank[i] < rank[j] { (i, j) } else { (j, i) };
            entries[front_of[first]].push((q, first, last));
        }
    }
    let mut fronts: Vec<Front> = Vec::with_capacity(count);
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut touched = vec![false; order];
    let mut places = vec![FrontPlace::Slot(0); order];
    for (f, pivots) in members.iter().enumerate() {
        let mut border: Vec<usize> = entries[f].iter().map(|e| e.2).filter(|&i| front_of[i] != f).collect();
        for &child in &children[f] {
            for &i in &fronts[child].border {
                touched[i] |= front_of[i] == f;
                if front_of[i] != f {
                    border.push(i);
                }
            }
        }
        border.sort_unstable_by_key(|&i| rank[i]);
        border.dedup();
        if let Some(&i) = border.first() {
            children[front_of[i]].push(f);
        }
        let mut front = Front::new(pivots, border, kinds, &touched, room);
        u32::try_from(front.length).ok()?;
        let within = entries[f].iter().filter(|entry| front_of[entry.2] == f);
        front.put_sparse_rows_first(within.map(|entry| [entry.1, entry.2]));
        for (i, place) in front.places() {
            places[i] = place;
        }
        for &(q, first, last) in &entries[f] {
            let offset = front.offset(places[first], places[last]);
            front.sources.push((u32::try_from(q).ok()?, u32::try_from(offset).ok()?));
        }
        front.note_couplings_of_rows();
        for &child in &children[f] {
            front.children.push((child, ChildMap::new(fronts[child].border.iter().map(|&i| places[i]))?));
        }
        front.note_kept();
        fronts.push(front);
    }
    Some(fronts)
}

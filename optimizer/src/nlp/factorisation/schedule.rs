//! Who does which fronts: independent subtrees on several threads, the top of the forest after (or before) them.

use super::front::Front;

/// Something a thread can do independently, or a front of the sequential top of the forest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    /// Range of fronts.
    pub start: usize,
    pub end: usize,
    /// Thread that does it; `None`: the sequential top.
    thread: Option<usize>,
}

/// The pieces of a forest, by ascending front.
#[derive(Debug)]
pub(super) struct Schedule {
    pub pieces: Vec<Piece>,
    threads: usize,
}

impl Schedule {
    /// Cuts the forest into subtrees for the threads and a sequential top: the heaviest subtree is split until no subtree
    /// is larger than a quarter of a thread's share; subtrees go to the least loaded thread, heaviest first.
    pub(super) fn new(fronts: &[Front], threads: usize) -> Self {
        let count = fronts.len();
        let (mut weight, mut start): (Vec<f64>, Vec<usize>) = (vec![0.0; count], (0..count).collect());
        let mut has_parent = vec![false; count];
        for f in 0..count {
            weight[f] = fronts[f].flops;
            for (child, _) in &fronts[f].children {
                weight[f] += weight[*child];
                start[f] = start[f].min(start[*child]);
                has_parent[*child] = true;
            }
        }
        let mut subtrees: Vec<usize> = (0..count).filter(|&f| !has_parent[f]).collect();
        let mut top = Vec::new();
        if threads > 1 {
            let limit = subtrees.iter().map(|&f| weight[f]).sum::<f64>() / (4 * threads) as f64;
            while let Some(k) = subtrees.iter().position(|&f| weight[f] > limit && !fronts[f].children.is_empty()) {
                let f = subtrees.swap_remove(k);
                top.push(f);
                subtrees.extend(fronts[f].children.iter().map(|c| c.0));
            }
        }
        subtrees.sort_unstable_by(|a, b| weight[*b].total_cmp(&weight[*a]).then(a.cmp(b)));
        let mut load = vec![0.0; threads];
        let mut pieces: Vec<Piece> = top.iter().map(|&f| Piece { start: f, end: f + 1, thread: None }).collect();
        for f in subtrees {
            let mut thread = 0;
            for t in 1..threads {
                if load[t] < load[thread] {
                    thread = t;
                }
            }
            load[thread] += weight[f];
            pieces.push(Piece { start: start[f], end: f + 1, thread: Some(thread) });
        }
        pieces.sort_unstable_by_key(|p| p.start);
        Self { pieces, threads }
    }

    /// The fronts of the sequential top, children before parents.
    pub(super) fn top(&self) -> impl DoubleEndedIterator<Item = Piece> + '_ {
        self.pieces.iter().copied().filter(|piece| piece.thread.is_none())
    }

    /// Does every subtree, each thread with a workspace of its own. `items` has one item per front; `work` gets the
    /// subtree, its items, the workspace.
    pub(super) fn subtrees<T: Send, W: Send>(
        &self,
        items: &mut [T],
        workspaces: &mut [W],
        work: impl Fn(Piece, &mut [T], &mut W) + Sync,
    ) {
        if let ([workspace], 1) = (&mut *workspaces, self.threads) {
            for piece in &self.pieces {
                work(*piece, &mut items[piece.start..piece.end], workspace);
            }
            return;
        }
        let mut hands: Vec<Vec<(Piece, &mut [T])>> = (0..self.threads).map(|_| Vec::new()).collect();
        let (mut rest, mut at) = (items, 0);
        for piece in &self.pieces {
            let (_, tail) = rest.split_at_mut(piece.start - at);
            let (own, tail) = tail.split_at_mut(piece.end - piece.start);
            if let Some(thread) = piece.thread {
                hands[thread].push((*piece, own));
            }
            (rest, at) = (tail, piece.end);
        }
        let play = |hand: Vec<(Piece, &mut [T])>, workspace: &mut W| {
            for (piece, items) in hand {
                work(piece, items, workspace);
            }
        };
        let play = &play;
        std::thread::scope(|scope| {
            let mut players = hands.into_iter().zip(workspaces);
            let first = players.next();
            for (hand, workspace) in players.filter(|(hand, _)| !hand.is_empty()) {
                scope.spawn(move || play(hand, workspace));
            }
            if let Some((hand, workspace)) = first {
                play(hand, workspace);
            }
        });
    }
}

//! Partition of the forest of fronts into tasks for the threads: subtrees, and single fronts near the roots.
//!
//! On the way up a task is ready when its children are done, on the way down when its parent is. The result of a task
//! does not depend on when or on which thread it runs, so the result does not depend on the number of threads.

use std::hint::spin_loop;
use std::sync::{Mutex, MutexGuard};
use std::thread::yield_now;

use super::front::Front;
use super::thread_pool::lock;

/// Fronts that one thread processes one after the other.
#[derive(Debug, Clone)]
pub(super) struct SubtreeTask {
    /// Range of fronts; the last one is the root of the others.
    pub start: usize,
    pub end: usize,
    /// Parent and children among the tasks.
    parent: Option<usize>,
    children: Vec<usize>,
}

/// Direction of a pass over the forest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    /// From the leaves to the roots.
    Up,
    /// From the roots to the leaves.
    Down,
}

/// State of a pass.
#[derive(Debug)]
struct Round {
    direction: Direction,
    /// Ready tasks, the next one last.
    ready: Vec<usize>,
    /// Number of unfinished predecessors of each task.
    waits_for: Vec<usize>,
    /// Number of unfinished tasks.
    left: usize,
}

/// The tasks of a forest.
#[derive(Debug)]
pub(super) struct Schedule {
    /// In ascending order of their fronts.
    pub tasks: Vec<SubtreeTask>,
    /// Tasks without children, the heaviest last, and tasks without a parent.
    leaves: Vec<usize>,
    roots: Vec<usize>,
    round: Mutex<Round>,
}

/// A subtree is split until its work is at most a thread's share divided by this.
const TASKS_PER_SHARE: usize = 4;
/// Number of unsuccessful attempts to get a task before a thread yields.
const ATTEMPTS_BEFORE_YIELD: usize = 100;
/// Pauses between two attempts.
const SPINS: usize = 20;

impl Schedule {
    /// Partitions the forest for that many threads: subtrees are split until none has more than a fraction of a
    /// thread's share of the work.
    pub(super) fn new(fronts: &[Front], threads: usize) -> Self {
        let count = fronts.len();
        let (mut weight, mut start): (Vec<f64>, Vec<usize>) = (vec![0.0; count], (0..count).collect());
        let mut parent = vec![None; count];
        for f in 0..count {
            weight[f] = fronts[f].flops;
            for (child, _) in &fronts[f].children {
                weight[f] += weight[*child];
                start[f] = start[f].min(start[*child]);
                parent[*child] = Some(f);
            }
        }
        let mut subtrees: Vec<usize> = (0..count).filter(|&f| parent[f].is_none()).collect();
        let mut single = Vec::new();
        if threads > 1 {
            let limit = subtrees.iter().map(|&f| weight[f]).sum::<f64>() / (TASKS_PER_SHARE * threads) as f64;
            while let Some(k) = subtrees.iter().position(|&f| weight[f] > limit && !fronts[f].children.is_empty()) {
                let f = subtrees.swap_remove(k);
                single.push(f);
                subtrees.extend(fronts[f].children.iter().map(|c| c.0));
            }
        }
        // By their last fronts.
        let mut last: Vec<(usize, usize)> = single.iter().map(|&f| (f, f)).collect();
        last.extend(subtrees.iter().map(|&f| (f, start[f])));
        last.sort_unstable();
        let task_of = |f: usize| last.binary_search_by_key(&f, |(end, _)| *end).ok();
        let mut tasks: Vec<SubtreeTask> = last
            .iter()
            .map(|&(f, start)| SubtreeTask {
                start,
                end: f + 1,
                parent: parent[f].and_then(task_of),
                children: Vec::new(),
            })
            .collect();
        for k in 0..tasks.len() {
            if let Some(parent) = tasks[k].parent {
                tasks[parent].children.push(k);
            }
        }
        let mut leaves: Vec<usize> = (0..tasks.len()).filter(|&k| tasks[k].children.is_empty()).collect();
        let heaviness = |k: &usize| weight[tasks[*k].end - 1];
        leaves.sort_by(|a, b| heaviness(a).total_cmp(&heaviness(b)));
        let roots = (0..tasks.len()).filter(|&k| tasks[k].parent.is_none()).collect();
        let round = Round {
            direction: Direction::Up,
            ready: Vec::with_capacity(tasks.len()),
            waits_for: vec![0; tasks.len()],
            left: 0,
        };
        Self { tasks, leaves, roots, round: Mutex::new(round) }
    }

    fn round(&self) -> MutexGuard<'_, Round> {
        lock(&self.round)
    }

    /// Prepares a pass.
    pub(super) fn begin(&self, direction: Direction) {
        let mut round = self.round();
        round.direction = direction;
        round.left = self.tasks.len();
        round.ready.clear();
        round.ready.extend(if direction == Direction::Up { &self.leaves } else { &self.roots });
        for (waits_for, task) in round.waits_for.iter_mut().zip(&self.tasks) {
            *waits_for =
                if direction == Direction::Up { task.children.len() } else { usize::from(task.parent.is_some()) };
        }
    }

    /// Works on tasks of the current pass until all are done. Several threads may call this at once.
    pub(super) fn take_part(&self, mut work: impl FnMut(&SubtreeTask)) {
        let mut looks = 0;
        loop {
            let taken = {
                let mut round = self.round();
                if round.left == 0 {
                    return;
                }
                round.ready.pop()
            };
            let Some(k) = taken else {
                looks += 1;
                if looks % ATTEMPTS_BEFORE_YIELD == 0 {
                    yield_now();
                } else {
                    (0..SPINS).for_each(|_| spin_loop());
                }
                continue;
            };
            // Marks the task done on drop, so that a panic cannot deadlock its dependents.
            let done = DoneOnDrop { schedule: self, task: k };
            work(&self.tasks[k]);
            drop(done);
        }
    }
}

/// Marks a task done on drop.
struct DoneOnDrop<'a> {
    schedule: &'a Schedule,
    task: usize,
}

impl Drop for DoneOnDrop<'_> {
    fn drop(&mut self) {
        let task = &self.schedule.tasks[self.task];
        let mut round = self.schedule.round();
        round.left -= 1;
        let next = match round.direction {
            Direction::Up => task.parent.as_slice(),
            Direction::Down => task.children.as_slice(),
        };
        for &k in next {
            round.waits_for[k] -= 1;
            if round.waits_for[k] == 0 {
                round.ready.push(k);
            }
        }
    }
}

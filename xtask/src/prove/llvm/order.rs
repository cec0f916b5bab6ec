//! The order in which a function's blocks are written down.
//!
//! A bounded model checker follows a program in the order of its text, and joins what it knows at
//! labels. So every jump that does not repeat a loop must go forward, a loop's blocks must stand
//! together, and each loop must have one place from which it is repeated: with two, a loop's
//! counter would be joined from different rounds, and known in neither.

use std::collections::{HashMap, HashSet};

use super::ir::Function;

/// What is written down next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Item {
    Block(usize),
    /// The one place from which the loop that begins at that block is repeated.
    Repeat(usize),
}

pub(super) struct Order {
    pub(super) items: Vec<Item>,
    /// The jumps, from and to, that repeat a loop.
    pub(super) repeats: HashSet<(usize, usize)>,
}

pub(super) fn order(function: &Function) -> Order {
    let index = function.block_places();
    let successors: Vec<Vec<usize>> = function
        .blocks
        .iter()
        .map(|block| block.end.successors().iter().map(|to| index[to]).collect())
        .collect();
    let mut order = Order {
        items: Vec::new(),
        repeats: HashSet::new(),
    };
    let all: HashSet<usize> = (0..function.blocks.len()).collect();
    place(&successors, &all, 0, None, &mut order);
    order
}

/// Places the blocks that are reached from `entry` within `among`, without the jumps that repeat
/// the loop which begins at `head`.
fn place(
    successors: &[Vec<usize>],
    among: &HashSet<usize>,
    entry: usize,
    head: Option<usize>,
    order: &mut Order,
) {
    let forward = |from: usize| {
        let within = successors[from].iter().copied();
        within.filter(|to| among.contains(to) && Some(*to) != head)
    };
    for component in components(entry, |from| forward(from).collect()) {
        let first = component[0];
        if component.len() == 1 && forward(first).all(|to| to != first) {
            order.items.push(Item::Block(first));
            continue;
        }
        let inside: HashSet<usize> = component.iter().copied().collect();
        // Where the loop is entered from outside; with several such places the loop is written as
        // if it began at one of them, and only costs the checker more.
        let begins = if inside.contains(&entry) {
            entry
        } else {
            among
                .iter()
                .filter(|from| !inside.contains(from))
                .flat_map(|from| forward(*from))
                .filter(|to| inside.contains(to))
                .min()
                .unwrap_or(first)
        };
        let repeating = component
            .iter()
            .filter(|from| successors[**from].contains(&begins));
        order.repeats.extend(repeating.map(|from| (*from, begins)));
        place(successors, &inside, begins, Some(begins), order);
        order.items.push(Item::Repeat(begins));
    }
}

/// Strongly connected components of what is reached from `entry`, so that every jump between two
/// of them goes forward (Tarjan's algorithm, backwards).
fn components(entry: usize, successors: impl Fn(usize) -> Vec<usize>) -> Vec<Vec<usize>> {
    struct Visit {
        block: usize,
        rest: Vec<usize>,
    }
    let mut number = HashMap::from([(entry, 0)]);
    let mut lowest = number.clone();
    let mut open = vec![entry];
    let mut visits = vec![Visit {
        block: entry,
        rest: successors(entry),
    }];
    let mut found = Vec::new();
    while let Some(visit) = visits.last_mut() {
        let block = visit.block;
        if let Some(next) = visit.rest.pop() {
            if let Some(&seen) = number.get(&next) {
                if open.contains(&next) {
                    let low = lowest[&block].min(seen);
                    lowest.insert(block, low);
                }
                continue;
            }
            let new = number.len();
            number.insert(next, new);
            lowest.insert(next, new);
            open.push(next);
            visits.push(Visit {
                block: next,
                rest: successors(next),
            });
            continue;
        }
        visits.pop();
        if let Some(caller) = visits.last() {
            let low = lowest[&caller.block].min(lowest[&block]);
            lowest.insert(caller.block, low);
        }
        if lowest[&block] == number[&block] {
            let start = open.iter().position(|&other| other == block).unwrap_or(0);
            found.push(open.split_off(start));
        }
    }
    found.reverse();
    found
}

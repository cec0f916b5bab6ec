//! The order in which a function's blocks are written.
//!
//! CBMC follows a program in the order of its text, and joins what it knows at labels. So every jump
//! that does not repeat a loop goes forward, a loop's blocks stand together, and each loop is
//! repeated from one place: with two, its counter would be joined from different rounds, and known
//! in neither.

use std::collections::{BTreeSet, HashSet};

use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;

/// What is written next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Item {
    Block(usize),
    /// The one place from which the loop that begins at that block is repeated.
    Repeat(usize),
}

#[derive(Default)]
pub(super) struct Order {
    pub(super) items: Vec<Item>,
    /// The jumps, from and to, that repeat a loop.
    pub(super) repeats: HashSet<(usize, usize)>,
}

/// `jumps` are those between the blocks; the function begins at block 0.
pub(super) fn order(blocks: usize, jumps: &[(usize, usize)]) -> Order {
    let mut order = Order::default();
    place(jumps, &(0..blocks).collect(), &mut order);
    order
}

/// Places the blocks in `among`, by the jumps between them that do not repeat a loop around them.
fn place(jumps: &[(usize, usize)], among: &BTreeSet<usize>, order: &mut Order) {
    let mut graph = DiGraphMap::<usize, ()>::new();
    for &block in among {
        graph.add_node(block);
    }
    let repeats = &order.repeats;
    let forward = |jump: &&(usize, usize)| {
        among.contains(&jump.0) && among.contains(&jump.1) && !repeats.contains(jump)
    };
    let forward: Vec<_> = jumps.iter().filter(forward).copied().collect();
    for &(from, to) in &forward {
        graph.add_edge(from, to, ());
    }
    // The last component is the first that is reached.
    for component in tarjan_scc(&graph).into_iter().rev() {
        if let [only] = component.as_slice()
            && !graph.contains_edge(*only, *only)
        {
            order.items.push(Item::Block(*only));
            continue;
        }
        let inside: BTreeSet<usize> = component.into_iter().collect();
        // Where it is entered. With several such places the loop is written as if it began at one
        // of them, and only costs the checker more.
        let entered = forward
            .iter()
            .filter(|(from, to)| !inside.contains(from) && inside.contains(to));
        let begins = entered.map(|(_, to)| *to).min();
        let Some(begins) = begins.or_else(|| inside.first().copied()) else {
            continue;
        };
        let repeating = forward
            .iter()
            .filter(|(from, to)| inside.contains(from) && *to == begins);
        order.repeats.extend(repeating);
        place(jumps, &inside, order);
        order.items.push(Item::Repeat(begins));
    }
}

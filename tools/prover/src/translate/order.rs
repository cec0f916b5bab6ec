//! The order in which a function's blocks are written.
//!
//! CBMC follows a program in the order of its text. At each label, CBMC merges its knowledge about the values from all
//! paths to this label. The order must therefore obey three rules. Every jump goes forward, unless it repeats a loop.
//! The blocks of a loop are contiguous. Each loop is repeated from only one place. Without these rules, CBMC would
//! merge the values that a loop's counter has in different iterations, and would no longer know the counter's value.

use std::collections::{BTreeSet, HashSet};

use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;

/// An item of the written program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Item {
    Block(usize),
    /// The jump back to this block, at which a loop begins. Every repetition of the loop passes through this jump.
    Repeat(usize),
}

#[derive(Default)]
pub(super) struct Order {
    pub(super) items: Vec<Item>,
    /// The jumps that repeat a loop, as pairs of source and target.
    pub(super) repeats: HashSet<(usize, usize)>,
}

/// Returns the order of the blocks. `jumps` are the jumps between blocks, and the function begins
/// at block 0.
pub(super) fn order(blocks: usize, jumps: &[(usize, usize)]) -> Order {
    let mut order = Order::default();
    place(jumps, &(0..blocks).collect(), &mut order);
    order
}

/// Orders the blocks in `among`. Ignores jumps that repeat a surrounding loop.
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
    // Tarjan's algorithm returns the components in reverse topological order.
    for component in tarjan_scc(&graph).into_iter().rev() {
        if let [only] = component.as_slice()
            && !graph.contains_edge(*only, *only)
        {
            order.items.push(Item::Block(*only));
            continue;
        }
        let inside: BTreeSet<usize> = component.into_iter().collect();
        // The entry of the loop. If there are several entries, the loop is written as if it began at one of them. This
        // makes the check slower, but not wrong.
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

//! The harnesses of a compiled module.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Result, bail};
use petgraph::algo::has_path_connecting;
use petgraph::graphmap::DiGraphMap;
use petgraph::visit::Dfs;
use serde::Serialize;

use crate::llvm::{Block, Module};
use crate::translate::readable;

/// The function that all covers call. The crate in `stand-in`, which replaces Kani's library, declares it.
const COVER: &str = "cover";

/// The prefix of a harness's symbol, which is followed by the path of the function.
const PREFIX: &str = "harness:";

/// One harness.
#[derive(Serialize)]
pub(crate) struct Harness {
    /// The path of the function without the crate. Kani uses the same name.
    pub(crate) name: String,
    /// The function's name in the compiled module, or in the C file.
    #[serde(skip)]
    pub(crate) symbol: String,
    /// The bound of the harness's loops, each of which must run fewer times; `None` without `kani::unwind`.
    pub(crate) unwind: Option<u32>,
    /// The covers that the harness may reach, by the readable names of their functions.
    pub(crate) covers: BTreeSet<String>,
    /// True if the last call of the harness is a cover. Kani shows only for such harnesses that some input reaches the
    /// end.
    pub(crate) ends_with_cover: bool,
    #[serde(skip)]
    pub(crate) language: Language,
}

impl Harness {
    /// Returns whether the harness is in this crate.
    pub(crate) fn is_in(&self, crate_name: &str) -> bool {
        let path = self.symbol.strip_prefix(PREFIX);
        path.and_then(|path| path.split("::").next()) == Some(crate_name)
    }
}

/// The language of a harness.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Language {
    Rust,
    /// C, for a machine whose `int` has 16 or 32 bits.
    C {
        has_int16: bool,
    },
}

/// Returns all harnesses of the module, which LLVM must not have optimised.
pub(crate) fn harnesses(module: &Module) -> Result<Vec<Harness>> {
    let names = module
        .functions
        .iter()
        .map(|(symbol, function)| Ok((symbol, function.names()?)));
    let names: Vec<_> = names.collect::<Result<_>>()?;
    let edges = names.iter().flat_map(|(symbol, names)| {
        let names = names.iter();
        names.map(move |name| (symbol.as_str(), name.as_str()))
    });
    let graph = DiGraphMap::<&str, ()>::from_edges(edges);
    let mut harnesses = BTreeMap::new();
    for symbol in module.functions.keys() {
        let Some(path) = symbol.strip_prefix(PREFIX) else {
            continue;
        };
        let name = path.split_once("::").map_or(path, |(_crate, name)| name);
        let bound = module.constant(&format!("unwind:{path}"))?;
        let bound = bound.as_ref().and_then(|bound| bound.bytes.first_chunk());
        let mut reached = Dfs::new(&graph, symbol.as_str());
        let reached = std::iter::from_fn(|| reached.next(&graph));
        let covers = reached.filter(|function| graph.contains_edge(function, COVER));
        let harness = Harness {
            name: name.to_owned(),
            symbol: symbol.clone(),
            unwind: bound.map(|bytes| u32::from_le_bytes(*bytes)),
            covers: covers.map(readable).collect(),
            ends_with_cover: ends_with_cover(module, &graph, symbol)?,
            language: Language::Rust,
        };
        if harnesses.insert(name, harness).is_some() {
            bail!("two crates have a harness {name}, so Kani's answer would be ambiguous");
        }
    }
    Ok(harnesses.into_values().collect())
}

/// Returns whether the function ends with a cover. On some path to the function's end, the last call must be a cover,
/// or a function that ends with a cover, and only unconditional jumps may follow the call. An input that satisfies this
/// cover then reaches the end.
fn ends_with_cover(module: &Module, graph: &DiGraphMap<&str, ()>, symbol: &str) -> Result<bool> {
    let Some(function) = module.functions.get(symbol) else {
        return Ok(false);
    };
    let blocks = function.blocks()?;
    let returns = |block: &&Block| {
        let last = block.statements.last();
        last.is_some_and(|last| last.line.starts_with("ret "))
    };
    let mut pending: Vec<&Block> = blocks.iter().filter(returns).collect();
    let mut seen = BTreeSet::new();
    while let Some(block) = pending.pop() {
        if !seen.insert(&block.label) {
            continue;
        }
        let mut calls = block
            .statements
            .iter()
            .rev()
            .filter_map(|last| last.callee());
        if let Some(last) = calls.find(|name| !name.starts_with("llvm.")) {
            let recursive = has_path_connecting(graph, last, symbol, None);
            if graph.contains_edge(last, COVER)
                || !recursive && ends_with_cover(module, graph, last)?
            {
                return Ok(true);
            }
            continue;
        }
        pending.extend(blocks.iter().filter(|before| {
            let next: Vec<&str> = before.successors().collect();
            next == [block.label.as_str()]
        }));
    }
    Ok(false)
}

//! The harnesses, as their sources say what they are.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result, bail, ensure};
use syn::visit::Visit;

/// One harness.
#[derive(Debug, Clone)]
pub(crate) struct Harness {
    /// Module and function, such as `encoding::bin`.
    pub(crate) name: String,
    /// The theorems it proves, or a part of them: `3, 4`.
    pub(crate) theorem: String,
    /// For streams of which length: `any`, or what it is bounded to.
    pub(crate) length: String,
    /// Only run with `--all`.
    pub(crate) long: bool,
    /// The public functions of the core that it is about.
    pub(crate) covers_functions: Vec<String>,
    /// How often its loops may run.
    pub(crate) unwind: u32,
    /// The covers it can come to: `file:line`, as the compiler names the file.
    pub(crate) covers: BTreeSet<String>,
    /// For a harness that is there to fail: how.
    pub(crate) expected: Option<String>,
}

/// What a function of a harness's file contains.
struct Contents {
    covers: BTreeSet<String>,
    calls: BTreeSet<String>,
}

/// All harnesses in the files of a folder, in the order of their names. `root` is what the
/// compiler's names of files begin behind.
pub(crate) fn read(root: &Path, folder: &Path) -> Result<Vec<Harness>> {
    let mut all = Vec::new();
    let mut files: Vec<_> = fs::read_dir(folder)
        .with_context(|| format!("the harnesses in {}", folder.display()))?
        .collect::<Result<Vec<_>, _>>()?
        .into_iter()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "rs"))
        .collect();
    files.sort();
    for path in files {
        let text = fs::read_to_string(&path)?;
        let shown = path.strip_prefix(root).unwrap_or(&path);
        let module = path.file_stem().unwrap_or_default().to_string_lossy();
        let found = of_file(&text, &shown.to_string_lossy(), &module)
            .with_context(|| shown.display().to_string())?;
        all.extend(found);
    }
    Ok(all)
}

fn of_file(text: &str, file: &str, module: &str) -> Result<Vec<Harness>> {
    let parsed = syn::parse_file(text)?;
    let mut functions = BTreeMap::new();
    for item in &parsed.items {
        if let syn::Item::Fn(function) = item {
            let mut visitor = Visitor {
                file,
                contents: Contents {
                    covers: BTreeSet::new(),
                    calls: BTreeSet::new(),
                },
            };
            visitor.visit_block(&function.block);
            functions.insert(function.sig.ident.to_string(), visitor.contents);
        }
    }
    let mut harnesses = Vec::new();
    for item in &parsed.items {
        let syn::Item::Fn(function) = item else {
            continue;
        };
        if has_attribute(function, "proof") {
            let name = function.sig.ident.to_string();
            let harness = harness(function, module, &functions).context(name)?;
            harnesses.push(harness);
        }
    }
    Ok(harnesses)
}

fn harness(
    function: &syn::ItemFn,
    module: &str,
    functions: &BTreeMap<String, Contents>,
) -> Result<Harness> {
    let name = function.sig.ident.to_string();
    let mut says = BTreeMap::<String, String>::new();
    for line in documentation(function) {
        if let Some((key, value)) = line.trim().split_once(": ") {
            let entry = says.entry(key.to_owned()).or_default();
            if !entry.is_empty() {
                entry.push_str(", ");
            }
            entry.push_str(value);
        }
    }
    let expected = says.remove("Expected");
    let mut said = |key: &str| {
        let value = says.remove(key);
        value.with_context(|| format!("its documentation has no line `{key}: …`"))
    };
    let (theorem, length) = if expected.is_some() {
        ("none".to_owned(), "none".to_owned())
    } else {
        (said("Theorem")?, said("Length")?)
    };
    let run = says.remove("Run");
    ensure!(
        run.as_deref().is_none_or(|run| run == "long"),
        "`Run:` knows only `long`"
    );
    let covers_functions = says.remove("Covers").unwrap_or_default();
    Ok(Harness {
        covers: reached_covers(&name, functions),
        name: format!("{module}::{name}"),
        theorem,
        length,
        long: run.is_some(),
        covers_functions: covers_functions
            .split(", ")
            .filter(|name| !name.is_empty())
            .map(str::to_owned)
            .collect(),
        unwind: unwind(function)?,
        expected,
    })
}

/// The covers in the function and in those of the same file that it calls.
fn reached_covers(name: &str, functions: &BTreeMap<String, Contents>) -> BTreeSet<String> {
    let mut covers = BTreeSet::new();
    let mut seen = BTreeSet::new();
    let mut pending = vec![name];
    while let Some(next) = pending.pop() {
        if let (true, Some(contents)) = (seen.insert(next), functions.get(next)) {
            covers.extend(contents.covers.iter().cloned());
            pending.extend(contents.calls.iter().map(String::as_str));
        }
    }
    covers
}

fn documentation(function: &syn::ItemFn) -> Vec<String> {
    let lines = function.attrs.iter().filter_map(|attribute| {
        let syn::Meta::NameValue(pair) = &attribute.meta else {
            return None;
        };
        let syn::Expr::Lit(syn::ExprLit {
            lit: syn::Lit::Str(text),
            ..
        }) = &pair.value
        else {
            return None;
        };
        pair.path.is_ident("doc").then(|| text.value())
    });
    lines.collect()
}

fn is_attribute(attribute: &syn::Attribute, wanted: &str) -> bool {
    let last = attribute.path().segments.last();
    last.is_some_and(|segment| segment.ident == wanted)
}

fn has_attribute(function: &syn::ItemFn, wanted: &str) -> bool {
    let mut attributes = function.attrs.iter();
    attributes.any(|attribute| is_attribute(attribute, wanted))
}

fn unwind(function: &syn::ItemFn) -> Result<u32> {
    let mut attributes = function.attrs.iter();
    let Some(attribute) = attributes.find(|attribute| is_attribute(attribute, "unwind")) else {
        bail!("a harness says with `kani::unwind` how often its loops may run");
    };
    let bound: syn::LitInt = attribute.parse_args()?;
    Ok(bound.base10_parse()?)
}

struct Visitor<'a> {
    file: &'a str,
    contents: Contents,
}

impl<'ast> Visit<'ast> for Visitor<'_> {
    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        let Some(last) = call.path.segments.last() else {
            return;
        };
        if last.ident == "cover" {
            let line = last.ident.span().start().line;
            self.contents.covers.insert(format!("{}:{line}", self.file));
        }
        // Calls within `assert!` and the like count too.
        let arguments = call.parse_body_with(
            syn::punctuated::Punctuated::<syn::Expr, syn::Token![,]>::parse_terminated,
        );
        for argument in arguments.iter().flatten() {
            self.visit_expr(argument);
        }
    }

    fn visit_expr_call(&mut self, call: &'ast syn::ExprCall) {
        if let syn::Expr::Path(path) = &*call.func
            && let Some(last) = path.path.segments.last()
        {
            self.contents.calls.insert(last.ident.to_string());
        }
        syn::visit::visit_expr_call(self, call);
    }
}

#[cfg(test)]
impl Harness {
    /// For tests: one that proves that theorem.
    pub(crate) fn example(name: &str, theorem: &str) -> Self {
        Self {
            name: name.to_owned(),
            theorem: theorem.to_owned(),
            length: "any".to_owned(),
            long: false,
            covers_functions: Vec::new(),
            unwind: 1,
            covers: BTreeSet::new(),
            expected: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: &str = "
        fn helper() { kani::cover!(true); }
        fn unused() { kani::cover!(false); }
        /// What it shows.
        ///
        /// Theorem: 3, 4
        /// Length: any
        /// Covers: A::b, A::c
        /// Covers: d
        #[kani::proof]
        #[kani::unwind(9)]
        fn shows() { assert!(helper() == ()); }
    ";

    #[test]
    fn a_harness_is_read_with_the_covers_of_what_it_calls() {
        let harnesses = of_file(SOURCE, "proofs/x.rs", "x").expect("it is a harness");
        let [harness] = harnesses.as_slice() else {
            panic!("{harnesses:?}");
        };
        assert_eq!(harness.name, "x::shows");
        assert_eq!((harness.theorem.as_str(), harness.unwind), ("3, 4", 9));
        assert!(!harness.long && harness.expected.is_none());
        assert_eq!(harness.covers_functions, ["A::b", "A::c", "d"]);
        assert_eq!(harness.covers, BTreeSet::from(["proofs/x.rs:2".to_owned()]));
    }

    #[test]
    fn a_harness_that_does_not_say_what_it_proves_is_an_error() {
        let error = of_file(&SOURCE.replace("Theorem: 3, 4", ""), "f", "x")
            .expect_err("it says too little");
        assert!(format!("{error:#}").contains("shows: its documentation has no line `Theorem: …`"));
    }
}

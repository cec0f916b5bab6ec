//! Every public function of the core stands in the list of some harness.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use anyhow::{Context as _, Result, bail};

use super::harness::Harness;
use crate::workspace::Workspace;

/// Those of other crates' traits, and those that only give text or a copy to a debugger or a user:
/// they are no part of receiving.
const NOT_OURS: [&str; 6] = ["fmt", "clone", "eq", "hash", "default", "source"];

/// Made by macros, which are not looked into: their traits' methods are found with the traits.
const MADE_BY_MACROS: [&str; 1] = ["Shape::new"];

/// Fails if there is a public function that no harness names, or the reverse. Prints the list.
pub(crate) fn check(workspace: &Workspace, harnesses: &[Harness]) -> Result<()> {
    let mut covered = BTreeMap::<&str, Vec<&str>>::new();
    for harness in harnesses {
        for function in &harness.covers_functions {
            covered.entry(function).or_default().push(&harness.name);
        }
    }
    let mut public = BTreeSet::from(MADE_BY_MACROS.map(str::to_owned));
    let mut traits = BTreeMap::new();
    let mut implemented = BTreeSet::new();
    let mut types = BTreeSet::new();
    let mut folders = vec![workspace.root.join("core/src")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            // `Read` is a trait of another crate's, over a source of bytes that no model has.
            if path.file_stem().is_some_and(|file| file == "reader") {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = fs::read_to_string(&path)?;
            let found = of_file(&text).with_context(|| path.display().to_string())?;
            public.extend(found.functions);
            traits.extend(found.traits);
            implemented.extend(found.implemented);
            types.extend(found.types);
        }
    }
    types.extend(traits.keys().cloned());
    public.retain(|function| match function.split_once("::") {
        Some((of, _)) => types.contains(of),
        None => true,
    });
    // A trait's methods are listed with the types that have them; where these are not seen, with it.
    traits.retain(|name, _| !implemented.contains(name));
    public.extend(traits.into_values().flatten());
    println!("Public functions of the core, and the harnesses that cover them:");
    for function in &public {
        let by = covered
            .get(function.as_str())
            .map_or(&[][..], Vec::as_slice);
        println!(
            "  {function:<34} {}",
            if by.is_empty() {
                "NONE".to_owned()
            } else {
                by.join(", ")
            }
        );
    }
    let missing: Vec<&str> = public
        .iter()
        .map(String::as_str)
        .filter(|function| !covered.contains_key(function))
        .collect();
    if !missing.is_empty() {
        bail!(
            "no harness covers {}: write one, and name the function in its `Covers:` line",
            missing.join(", ")
        );
    }
    let unknown: Vec<&str> = covered
        .into_keys()
        .filter(|function| !public.contains(*function))
        .collect();
    if !unknown.is_empty() {
        bail!(
            "harnesses cover what the core does not have: {}",
            unknown.join(", ")
        );
    }
    Ok(())
}

/// What a file has.
#[derive(Default)]
struct Found {
    /// Those of private types too.
    functions: BTreeSet<String>,
    /// Public types.
    types: BTreeSet<String>,
    /// Public traits, and their methods.
    traits: BTreeMap<String, Vec<String>>,
    /// The traits that something is seen to implement.
    implemented: BTreeSet<String>,
}

/// `Type::function` for methods, `function` for free ones. What is for the proofs only, and tests,
/// are left out.
fn of_file(text: &str) -> Result<Found> {
    let mut found = Found::default();
    let file = syn::parse_file(text)?;
    if is_for_proofs(&file.attrs) {
        return Ok(found);
    }
    for item in file.items {
        match item {
            syn::Item::Fn(function) if is_public(&function.vis) => {
                found.functions.insert(function.sig.ident.to_string());
            }
            syn::Item::Struct(item) if is_public(&item.vis) => {
                found.types.insert(item.ident.to_string());
            }
            syn::Item::Enum(item) if is_public(&item.vis) => {
                found.types.insert(item.ident.to_string());
            }
            syn::Item::Impl(item) if !is_for_proofs(&item.attrs) => {
                let of_trait = item.trait_.is_some();
                // What is implemented for any closure counts as well.
                let segments = item
                    .trait_
                    .iter()
                    .filter_map(|(_, path, _)| path.segments.last());
                let segments = segments.filter(|_| matches!(*item.self_ty, syn::Type::Path(_)));
                found
                    .implemented
                    .extend(segments.map(|segment| segment.ident.to_string()));
                let Some(name) = type_name(&item.self_ty) else {
                    continue;
                };
                for part in &item.items {
                    let syn::ImplItem::Fn(method) = part else {
                        continue;
                    };
                    let method_name = method.sig.ident.to_string();
                    let public = of_trait || is_public(&method.vis);
                    if public
                        && !is_for_proofs(&method.attrs)
                        && !NOT_OURS.contains(&method_name.as_str())
                    {
                        found.functions.insert(format!("{name}::{method_name}"));
                    }
                }
            }
            syn::Item::Trait(item) if is_public(&item.vis) => {
                let name = item.ident.to_string();
                let methods = item.items.iter().filter_map(|part| match part {
                    syn::TraitItem::Fn(method) => Some(method),
                    _ => None,
                });
                for method in methods {
                    let listed = format!("{name}::{}", method.sig.ident);
                    if method.default.is_some() {
                        found.functions.insert(listed.clone());
                    }
                    found.traits.entry(name.clone()).or_default().push(listed);
                }
            }
            _ => {}
        }
    }
    Ok(found)
}

/// Whether it stands under `#[cfg(kani)]`.
fn is_for_proofs(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let condition = attribute.parse_args::<syn::Path>();
        attribute.path().is_ident("cfg") && condition.is_ok_and(|path| path.is_ident("kani"))
    })
}

fn is_public(visibility: &syn::Visibility) -> bool {
    matches!(visibility, syn::Visibility::Public(_))
}

/// The name of a type or of a type parameter.
fn type_name(of: &syn::Type) -> Option<String> {
    let syn::Type::Path(path) = of else {
        return None;
    };
    Some(path.path.segments.last()?.ident.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_that_users_can_call_are_found() {
        let text = "
            pub fn free() {}
            pub(crate) fn internal() {}
            impl Machine { pub fn new() {} fn own() {} #[cfg(kani)] pub fn for_proofs() {} }
            #[cfg(kani)] impl Machine { pub fn also_for_proofs() {} }
            impl Parser for Machine { #[cfg(feature = \"x\")] fn push() {} }
            impl Debug for Machine { fn fmt() {} }
            pub trait Format { fn check() {} fn decode(); }
        ";
        let expected = ["Format::check", "Machine::new", "Machine::push", "free"];
        assert_eq!(
            of_file(text).expect("it is Rust").functions,
            expected.map(str::to_owned).into()
        );
        let for_proofs = of_file("#![cfg(kani)] pub fn free() {}").expect("so is this");
        assert!(for_proofs.functions.is_empty());
    }
}

//! The attributes of the stand-in for Kani's library.

use proc_macro::TokenStream;
use quote::quote;
use syn::{ItemFn, ItemStruct, LitInt, parse_macro_input};

/// Marks a function without arguments as a harness. The function is exported under a name that
/// consists of `harness:`, its module's path and its own name.
#[proc_macro_attribute]
pub fn proof(_arguments: TokenStream, harness: TokenStream) -> TokenStream {
    let harness = parse_macro_input!(harness as ItemFn);
    let name = &harness.sig.ident;
    quote! {
        #harness
        const _: () = {
            #[unsafe(export_name = concat!("harness:", module_path!(), "::", stringify!(#name)))]
            extern "C" fn harness() {
                #name()
            }
        };
    }
    .into()
}

/// Sets the bound of the harness's loops. The prover checks that each loop runs fewer times than
/// this bound.
#[proc_macro_attribute]
pub fn unwind(bound: TokenStream, harness: TokenStream) -> TokenStream {
    let bound = parse_macro_input!(bound as LitInt);
    let harness = parse_macro_input!(harness as ItemFn);
    let name = &harness.sig.ident;
    quote! {
        #harness
        const _: () = {
            #[unsafe(export_name = concat!("unwind:", module_path!(), "::", stringify!(#name)))]
            static BOUND: u32 = #bound;
        };
    }
    .into()
}

/// Derives `Arbitrary` for a struct. Each field gets an arbitrary value.
#[proc_macro_derive(Arbitrary)]
pub fn arbitrary(item: TokenStream) -> TokenStream {
    let item = parse_macro_input!(item as ItemStruct);
    let (name, members) = (&item.ident, item.fields.members());
    quote! {
        impl ::kani::Arbitrary for #name {
            fn any() -> Self {
                Self { #(#members: ::kani::Arbitrary::any(),)* }
            }
        }
    }
    .into()
}

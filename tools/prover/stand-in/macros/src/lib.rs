//! The attributes of the stand-in for Kani's library.

use proc_macro::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Fields, Ident, ItemFn, LitInt, parse_macro_input};

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

/// Sets a bound on the iterations of the harness's loops. The prover checks that no loop exceeds
/// it.
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

/// Chooses Kani's solver. The offline prover has only one solver and ignores the attribute.
#[proc_macro_attribute]
pub fn solver(_name: TokenStream, harness: TokenStream) -> TokenStream {
    harness
}

/// Derives `Arbitrary`. Each field gets an arbitrary value, and an enum an arbitrary variant.
#[proc_macro_derive(Arbitrary)]
pub fn arbitrary(item: TokenStream) -> TokenStream {
    let item = parse_macro_input!(item as DeriveInput);
    let any = match &item.data {
        Data::Struct(data) => any_fields(&item.ident, None, &data.fields),
        Data::Enum(data) => {
            let variants = data.variants.iter();
            let any = variants.map(|one| any_fields(&item.ident, Some(&one.ident), &one.fields));
            let (place, last) = (0..data.variants.len(), data.variants.len() - 1);
            quote! {
                match ::kani::any_where(|place| *place <= #last) {
                    #(#place => #any,)*
                    _ => ::core::unreachable!(),
                }
            }
        }
        Data::Union(_) => quote!(::core::compile_error!("a union has no `Arbitrary`")),
    };
    let name = &item.ident;
    let (parameters, arguments, bounds) = item.generics.split_for_impl();
    quote! {
        impl #parameters ::kani::Arbitrary for #name #arguments #bounds {
            fn any() -> Self {
                #any
            }
        }
    }
    .into()
}

/// Returns an expression for a struct, or for a variant of an enum, with arbitrary fields.
fn any_fields(name: &Ident, variant: Option<&Ident>, fields: &Fields) -> proc_macro2::TokenStream {
    let variant = variant.map(|variant| quote!(::#variant));
    let members = fields.members();
    quote!(#name #variant { #(#members: ::kani::Arbitrary::any(),)* })
}

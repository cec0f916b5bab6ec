//! The attributes of the stand-in for Kani's library.
//!
//! The bound of `unwind` is read from the harness's source by `cargo xtask prove`, which gives it
//! to the checker; here it need only be accepted.

use proc_macro::{Literal, TokenStream, TokenTree};

/// Marks a function without arguments as a harness: it is exported from the module under the name
/// `harness:`, its module's path, and its own name.
#[proc_macro_attribute]
pub fn proof(arguments: TokenStream, harness: TokenStream) -> TokenStream {
    if !arguments.is_empty() {
        return error("the stand-in for Kani knows no arguments of `proof`");
    }
    let Some(name) = function_name(harness.clone()) else {
        return error("`kani::proof` marks functions");
    };
    let export = format!(
        r#"
        const _: () = {{
            #[unsafe(export_name = concat!("harness:", module_path!(), "::", "{name}"))]
            extern "C" fn harness() {{
                {name}();
            }}
        }};"#
    );
    match export.parse::<TokenStream>() {
        Ok(export) => [harness, export].into_iter().collect(),
        Err(error) => self::error(&error.to_string()),
    }
}

/// Says how often the harness's loops may run; that they run no more often is checked too.
#[proc_macro_attribute]
pub fn unwind(bound: TokenStream, harness: TokenStream) -> TokenStream {
    if bound.to_string().parse::<u32>().is_err() {
        return error("`kani::unwind` takes a whole number");
    }
    harness
}

/// The identifier behind `fn`.
fn function_name(item: TokenStream) -> Option<String> {
    let mut tokens = item.into_iter();
    tokens.find(|token| matches!(token, TokenTree::Ident(word) if word.to_string() == "fn"))?;
    tokens.next().map(|name| name.to_string())
}

/// What makes the compiler stop with that message.
fn error(message: &str) -> TokenStream {
    let message = Literal::string(message);
    format!("::core::compile_error!({message});")
        .parse()
        .unwrap_or_default()
}

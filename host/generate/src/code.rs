//! Lines of code, each as far to the right as brackets are open.

use std::iter;

/// Source code under way.
#[derive(Default)]
pub(super) struct Code {
    pub(super) text: String,
    depth: usize,
}

impl Code {
    /// Adds lines, or an empty one.
    pub(super) fn add(&mut self, lines: &str) {
        if lines.is_empty() {
            self.text.push('\n');
        }
        for line in lines.lines().map(str::trim_start) {
            let is_comment = ["//", "/*", "*"].iter().any(|mark| line.starts_with(mark));
            let is_closing = line.starts_with([')', ']', '}']);
            let count = |brackets: [char; 3]| line.matches(brackets).count();
            let (open, close) = (count(['(', '[', '{']), count([')', ']', '}']));
            self.depth = self.depth.saturating_sub(usize::from(is_closing));
            if !line.is_empty() {
                self.text.extend(iter::repeat_n("    ", self.depth));
            }
            self.text
                .push_str(if line.starts_with('*') { " " } else { "" });
            self.text.push_str(line);
            self.text.push('\n');
            if open + usize::from(is_closing) > close && !is_comment {
                self.depth += 1;
            } else if open < close && !is_closing {
                self.depth = self.depth.saturating_sub(1);
            }
        }
    }
}

/// Adds what `format!` gives.
macro_rules! add {
    ($code:expr, $($text:tt)*) => {
        $code.add(&format!($($text)*))
    };
}
pub(super) use add;

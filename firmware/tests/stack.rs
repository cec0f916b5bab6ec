//! Computes a bound on the stack's depth from the machine code. The code shows how much stack each function takes,
//! and which functions it calls. Unknown instructions, calls through registers, and recursion are errors. One recursion
//! is allowed: see [`Code::depth`].
#![expect(clippy::cast_possible_truncation, reason = "addresses have 32 bits")]

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use rsemu::cpu::arm::v7m::isa::{DpOp, Insn, MemOffset, Operand, decode, is_32bit};

use crate::firmware::image_file;
use crate::image::MOST_FLASH;

const SP: u8 = 13;
const LR: u8 = 14;
const PC: u8 = 15;
/// Bytes that the processor stores when it enters an exception: the frame with floating-point registers, and four bytes
/// to align the stack.
const EXCEPTION: u32 = 104 + 4;

/// An image's machine code.
struct Code<'a> {
    file: object::File<'a>,
    functions: BTreeMap<u32, Function>,
    /// The panic handler, if there is one.
    panic: Option<u32>,
}

/// The stack that a function takes (the sum of all its pushes), and the functions that it calls.
#[derive(Default)]
struct Function {
    takes: u32,
    calls: BTreeSet<u32>,
}

impl<'a> Code<'a> {
    fn of(elf: &'a [u8]) -> Self {
        let file = object::File::parse(elf).unwrap();
        let (mut ranges, mut mappings, mut panic) = (BTreeMap::new(), BTreeMap::new(), None);
        for symbol in file.symbols() {
            let (name, start) = (symbol.name().unwrap(), symbol.address() as u32 & !1);
            if symbol.kind() == SymbolKind::Text && symbol.size() > 0 {
                ranges.insert(start, start..start + symbol.size() as u32);
            }
            // A symbol $t marks where code begins, and a symbol $d where tables or constants begin.
            if name.starts_with("$t") || name.starts_with("$d") {
                mappings.insert(start, name.starts_with("$t"));
            }
            if name.contains("rust_begin_unwind") {
                panic = Some(start);
            }
        }
        let text = file.section_by_name(".text").unwrap();
        let half = |at: u32| {
            let bytes = text.data_range(at.into(), 2).unwrap().unwrap();
            u16::from_le_bytes(*bytes.first_chunk().unwrap())
        };
        let mut functions = BTreeMap::new();
        for (&start, range) in &ranges {
            let (mut function, mut pc) = (Function::default(), start);
            while pc < range.end {
                let is_code = *mappings.range(..=pc).next_back().unwrap().1;
                let is_long = is_code && is_32bit(half(pc));
                if is_code {
                    let second = if is_long { half(pc + 2) } else { 0 };
                    function.add(decode(half(pc), second), pc, range);
                }
                pc += if is_long { 4 } else { 2 };
            }
            let strange = function
                .calls
                .iter()
                .find(|call| !ranges.contains_key(call));
            assert!(strange.is_none(), "{start:#x} jumps to {strange:x?}");
            functions.insert(start, function);
        }
        Self {
            file,
            functions,
            panic,
        }
    }

    fn symbol(&self, name: &str) -> u32 {
        self.file.symbol_by_name(name).expect(name).address() as u32
    }

    /// Returns the stack that a function takes, including its deepest chain of calls.
    fn depth(&self, function: u32, callers: &[u32]) -> u32 {
        if let Some(before) = callers.iter().rposition(|&caller| caller == function) {
            // One recursion is allowed: a panic is logged, and the log's library panics if it is called while it writes
            // a log entry. No other code panics while an entry is written, so this second panic never happens.
            if self.panic == Some(function) {
                return 0;
            }
            let panics = callers[before..].iter().any(|&one| self.panic == Some(one));
            assert!(panics, "recursion at {function:#x}");
        }
        let callers = [callers, &[function]].concat();
        let Function { takes, calls } = &self.functions[&function];
        let deepest = calls.iter().map(|&call| self.depth(call, &callers)).max();
        takes + deepest.unwrap_or(0)
    }

    /// Returns the stack that the program and all handlers take together. Each handler counts once, because no handler
    /// interrupts itself.
    fn nested(&self) -> u32 {
        let table = self.file.section_by_name(".vector_table").unwrap();
        let words = table.data().unwrap().as_chunks().0.iter();
        let vectors: Vec<u32> = words.map(|word| u32::from_le_bytes(*word) & !1).collect();
        let handlers: BTreeSet<u32> = vectors[2..].iter().copied().filter(|&at| at != 0).collect();
        assert!(handlers.contains(&(self.symbol("UARTE0_UART0") & !1)));
        let handlers = handlers
            .iter()
            .map(|&handler| EXCEPTION + self.depth(handler, &[]));
        self.depth(vectors[1], &[]) + handlers.sum::<u32>()
    }
}

impl Function {
    fn add(&mut self, instruction: Insn, pc: u32, range: &Range<u32>) {
        if let Insn::Branch { offset, .. } | Insn::BranchLink { offset } = instruction {
            let target = (pc + 4).wrapping_add_signed(offset);
            let is_call = matches!(instruction, Insn::BranchLink { .. });
            if is_call || !range.contains(&target) {
                self.calls.insert(target);
            }
        }
        let takes = takes(instruction);
        self.takes += takes.unwrap_or_else(|| panic!("{pc:#x}: {instruction:?} is not understood"));
    }
}

/// Returns the number of bytes by which an instruction moves the stack pointer down. Returns `None` if the instruction
/// may change the stack pointer in another way, or jump to an arbitrary address.
#[rustfmt::skip]
fn takes(instruction: Insn) -> Option<u32> {
    match instruction {
        Insn::LoadStoreMultiple { load: false, rn: SP, list, .. } => Some(4 * list.count_ones()),
        Insn::LoadStore { load: false, rn: SP, offset: MemOffset::Imm(bytes), add: false, wback: true, .. } => Some(bytes),
        Insn::DataProc { op: DpOp::Sub, rd: SP, rn: SP, operand: Operand::Imm { value, .. }, .. } => Some(value),
        // These instructions move the stack pointer up, compare, or return to the caller.
        Insn::DataProc { op: DpOp::Add, rd: SP, rn: SP, operand: Operand::Imm { .. }, .. }
        | Insn::DataProc { op: DpOp::Cmp | DpOp::Cmn | DpOp::Tst | DpOp::Teq, .. }
        | Insn::LoadStoreMultiple { rn: SP, .. }
        | Insn::LoadStore { load: true, rn: SP, offset: MemOffset::Imm(_), add: true, index: false, .. }
        | Insn::Bx { rm: LR } => Some(0),
        Insn::LoadStoreMultiple { load: true, list, .. } if list & (1 << PC | 1 << SP) != 0 => None,
        Insn::DataProc { rd: SP | PC, .. }
        | Insn::LoadStore { load: true, rt: SP | PC, .. }
        | Insn::LoadStore { rn: SP, wback: true, .. }
        | Insn::LoadLiteral { rt: SP | PC, .. }
        | Insn::LoadStoreDual { rn: SP, wback: true, .. }
        | Insn::Bx { .. } | Insn::Blx { .. } | Insn::Msr { sysm: 8 | 9, .. }
        | Insn::Fp(_) | Insn::Coproc { .. } | Insn::Undefined => None,
        _ => Some(0),
    }
}

/// Returns the stack's depth if all handlers are nested, and the stack's size in memory.x, both in bytes.
pub(crate) fn stack(image: &str) -> (u32, u32) {
    let elf = image_file(image);
    let code = Code::of(&elf);
    let has = code.symbol("_stack_start") - code.symbol("_stack_end");
    (code.nested(), has)
}

#[test]
fn the_stack_suffices_with_everything_nested() {
    for (image, _) in MOST_FLASH {
        let (takes, has) = stack(image);
        assert!(takes <= has, "{image}: {takes} bytes of stack, not {has}");
    }
}

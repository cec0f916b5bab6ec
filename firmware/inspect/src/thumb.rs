//! Where a Thumb instruction may go on: as much of the decoder as a call graph needs (Armv7-M
//! Architecture Reference Manual, A5 and A7.7).

/// Where the processor may go on, besides the next instruction.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Leads {
    /// Nowhere else, or back to the caller, or into a table of places in the same function.
    Nowhere,
    /// There: a branch or a call.
    To(u32),
    /// To an address in a register or in memory.
    Anywhere,
}

/// The instruction that begins with `first` at `address`, and how many bytes it has. `second` are
/// the two bytes behind, which belong to it if it has four.
pub(crate) fn decode(address: u32, first: u16, second: u16) -> (Leads, u32) {
    if first >> 11 >= 0b11101 {
        (wide(address, first.into(), second.into()), 4)
    } else {
        (narrow(address, first.into()), 2)
    }
}

fn narrow(address: u32, code: u32) -> Leads {
    let register = code >> 3 & 0xF;
    match code {
        // BX LR returns; BX and BLX of any other register may go anywhere.
        _ if code & 0xFF87 == 0x4700 && register == 14 => Leads::Nowhere,
        _ if code & 0xFF07 == 0x4700 => Leads::Anywhere,
        // MOV and ADD to PC.
        _ if code & 0xFD87 == 0x4487 => Leads::Anywhere,
        // CBZ, CBNZ: forward only.
        _ if code & 0xF500 == 0xB100 => {
            let offset = (code >> 9 & 1) << 6 | (code >> 3 & 0x1F) << 1;
            to(address, offset, 7 + 1)
        }
        // B with a condition; 14 is an undefined instruction, 15 a call of the supervisor.
        _ if code >> 12 == 0b1101 && code >> 8 & 0xF < 14 => to(address, (code & 0xFF) << 1, 9),
        _ if code >> 11 == 0b11100 => to(address, (code & 0x7FF) << 1, 12),
        _ => Leads::Nowhere,
    }
}

fn wide(address: u32, first: u32, second: u32) -> Leads {
    if first >> 11 == 0b11110 && second >> 15 == 1 {
        let (sign, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
        let low = (second & 0x7FF) << 1;
        if second >> 12 & 1 == 1 {
            // BL, B without a condition.
            let (i1, i2) = (1 ^ j1 ^ sign, 1 ^ j2 ^ sign);
            let offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | low;
            return to(address, offset, 25);
        }
        // B with a condition; 14 and 15 are other instructions.
        if first >> 6 & 0xF < 14 {
            let offset = sign << 20 | j2 << 19 | j1 << 18 | (first & 0x3F) << 12 | low;
            return to(address, offset, 21);
        }
        return Leads::Nowhere;
    }
    // PC loaded from the stack is a return, from elsewhere it may be anything.
    let from_stack = first & 0xF == 13;
    let loads_word = first & 0xFF70 == 0xF850 && second >> 12 == 15;
    let loads_several = matches!(first & 0xFFD0, 0xE890 | 0xE910) && second >> 15 == 1;
    if (loads_word || loads_several) && !from_stack {
        return Leads::Anywhere;
    }
    Leads::Nowhere
}

/// An offset of so many bits, the highest being its sign, from four behind the instruction.
fn to(address: u32, offset: u32, bits: u32) -> Leads {
    let sign = 1 << (bits - 1);
    let offset = (offset ^ sign).wrapping_sub(sign);
    Leads::To(address.wrapping_add(4).wrapping_add(offset))
}

#[cfg(test)]
mod tests {
    use super::{Leads, decode};

    /// Encodings as `llvm-objdump` shows them, with the targets that it gives.
    #[test]
    fn branches_lead_where_a_disassembler_says() {
        for (address, first, second, expected) in [
            (0x0d46, 0xf000, 0xff92, Leads::To(0x1c6e)), // bl
            (0x05c4, 0xf000, 0xfbe4, Leads::To(0x0d90)), // bl
            (0x1918, 0xf000, 0xb83c, Leads::To(0x1994)), // b.w
            (0x0100, 0xf7ff, 0xfffe, Leads::To(0x0100)), // bl to itself
            (0x14de, 0xb14a, 0, Leads::To(0x14f4)),      // cbz
            (0x14de, 0xd40b, 0, Leads::To(0x14f8)),      // bmi
            (0x1000, 0xe7fe, 0, Leads::To(0x1000)),      // b to itself
            (0x1000, 0xf43f, 0xaffe, Leads::To(0x1000)), // beq.w to itself
            (0x1000, 0x4770, 0, Leads::Nowhere),         // bx lr
            (0x1000, 0xbd80, 0, Leads::Nowhere),         // pop {r7, pc}
            (0x1000, 0xe8bd, 0x8ff0, Leads::Nowhere),    // pop.w {.., pc}
            (0x1000, 0xf85d, 0xfb04, Leads::Nowhere),    // ldr pc, [sp], #4
            (0x1000, 0xf3ef, 0x8910, Leads::Nowhere),    // mrs r9, primask
            (0x1000, 0xde00, 0, Leads::Nowhere),         // udf
            (0x1000, 0x4798, 0, Leads::Anywhere),        // blx r3
            (0x1000, 0x4718, 0, Leads::Anywhere),        // bx r3
            (0x1000, 0x469f, 0, Leads::Anywhere),        // mov pc, r3
            (0x1000, 0xf8d3, 0xf000, Leads::Anywhere),   // ldr.w pc, [r3]
        ] {
            assert_eq!(
                decode(address, first, second).0,
                expected,
                "{first:04x} {second:04x}"
            );
        }
    }
}

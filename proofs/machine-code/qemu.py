"""Runs steps from random states in the prover's model of the processor and in QEMU (unicorn), and compares the two
before every instruction."""

import random
import unicorn
import z3
from unicorn import arm_const
from image import Failure
from steps import FRAME, pending, window
from thumb import REGISTERS, RETURN, bits, number

THEIRS = {name: getattr(arm_const, f"UC_ARM_REG_{name.upper()}") for name in REGISTERS + ["pc", "cpsr"]}

def value(name, size):
    """Returns a random value for a field, often one near an overflow."""
    if name == "window":
        # Many windows hold a frame without its last byte, so that frames are completed often.
        wrong = random.choice([b"", b"AB\r"])
        data = [bits(random.choice([fixed or 0, *wrong]), 8) for fixed in FRAME]
        data = data[: random.choice([*range(7), 6, 6, 6])]
        return window(data, pending(data))
    most = {"lost": 1, "state": 6}.get(name, (1 << 8 * size) - 1)
    return bits(random.choice([0, most, random.randint(0, most)]), 8 * size)

def compare(step):
    """Compares 60 steps, and returns the numbers of instructions and of their kinds. Fails unless every kind of
    instruction in the proof was also executed here."""
    emulated = unicorn.Uc(unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS)
    for start in (0, step.writable[0].start & ~0xF_FFFF):
        emulated.mem_map(start, 0x10_0000)
    for address, byte in step.image.flash.items():
        emulated.mem_write(address, bytes([byte]))
    proved, kinds, trace, compared = set(step.image.kinds), set(), [], 0
    keep = lambda *_: trace.append({name: emulated.reg_read(one) for name, one in THEIRS.items()})
    emulated.hook_add(unicorn.UC_HOOK_CODE, keep)
    random.seed(1)
    for _ in range(60):
        before = {name: value(name, size) for name, (_, size) in step.fields.items()}
        state = step.called(before, bits(random.choice([0x41, 0x42, 0x0D, 0x0D, random.randrange(256)]), 8))
        for address, byte in state.memory.items():
            emulated.mem_write(address, bytes([number(byte)]))
        for name, content in state.registers.items():
            state.registers[name] = bits(random.getrandbits(32) if number(content) is None else number(content))
            emulated.reg_write(THEIRS[name], number(state.registers[name]))
        trace.clear()
        emulated.emu_start(state.pc | 1, RETURN, count=2_000)
        for theirs in trace:
            while state.pc != theirs["pc"] and state.conditions:
                (state,) = state.step()  # QEMU does not report the instructions that IT skips.
            same = all(number(content) == theirs[name] for name, content in state.registers.items())
            for i, flag in enumerate("VCZN"):
                # If the prover leaves a flag undefined, use QEMU's value from here on.
                is_set = bool(theirs["cpsr"] >> 28 + i & 1)
                same = same and not (z3.is_false if is_set else z3.is_true)(state.flags[flag])
                state.flags[flag] = z3.BoolVal(is_set)
            if state.pc != theirs["pc"] or not same:
                raise Failure(f"{state.pc:#x}: QEMU has {theirs}")
            (state,) = state.step()
            kinds.add(state.name)
        compared += len(trace)
        if any(emulated.mem_read(at, 1)[0] != number(byte) for at, byte in state.memory.items()):
            raise Failure("QEMU's memory differs")
    if not proved or not proved <= kinds:
        raise Failure(f"never executed: {proved - kinds}")
    return f"{compared} instructions of {len(kinds)} kinds"

"""A symbolic Cortex-M4. It follows every path through a piece of machine code, for all values at once, with Z3. It
stops with an error at anything that it does not model: an unknown instruction, an access outside the given memory, or
a jump to an unknown address."""

import copy
import z3
from capstone import arm
from image import Failure

RETURN = 0xF_0000  # The caller's return address. No code is there.
REGISTERS = [f"r{n}" for n in range(13)] + ["sp", "lr"]
ALIASES = {"sb": "r9", "sl": "r10", "fp": "r11", "ip": "r12"}

def bits(value, size=32):
    return z3.BitVecVal(value, size)

def number(expression):
    """Returns the value of the expression, if it is constant."""
    expression = z3.simplify(expression)
    return expression.as_long() if z3.is_bv_value(expression) else None

def joined(parts):
    """Returns the bytes as one value, the first byte lowest."""
    return z3.simplify(z3.Concat(*reversed(parts)) if len(parts) > 1 else parts[0])

class State:
    """A path: its position, the content of registers and memory, and the assumptions made on it."""

    def __init__(self, image, pc, registers, memory, writable, assumed):
        self.image, self.pc, self.registers, self.memory, self.writable = image, pc, registers, memory, writable
        self.flags = {flag: z3.FreshBool() for flag in "NZCV"}
        # IT sets `conditions` for the next instructions. `path` has the assumptions on the whole path.
        self.conditions, self.path = [], list(assumed)
        self.instructions, self.cycles, self.lowest_sp = 0, 0, number(registers["sp"])

    def refuse(self, why):
        raise Failure(f"{self.now.address:#x}: {self.now.mnemonic} {self.now.op_str}: {why}")

    def find(self, condition):
        """Returns values with which the path is taken and the condition holds, or None."""
        solver = z3.SolverFor("QF_BV")
        solver.set("timeout", 60_000)
        solver.add(*self.path, condition)
        answer = solver.check()
        if answer == z3.unknown:
            self.refuse("the solver gives up")
        return solver.model() if answer == z3.sat else None

    def demand(self, what, condition):
        if not z3.is_true(condition) and (values := self.find(z3.Not(condition))) is not None:
            self.refuse(f"{what}: differs from the specification, with {values}")

    def assuming(self, condition):
        other = copy.copy(self)
        for name in ("registers", "memory", "flags", "conditions", "path"):
            setattr(other, name, getattr(self, name).copy())
        other.path.append(condition)
        return other

    def fork(self, condition):
        """Returns the possible truth values of the condition, each with the state in which the condition has this value."""
        condition = z3.simplify(condition)
        if z3.is_true(condition) or z3.is_false(condition):
            return [(z3.is_true(condition), self)]
        ways = [(True, condition), (False, z3.Not(condition))]
        return [(taken, self.assuming(way)) for taken, way in ways if self.find(way) is not None]

    def run(self):
        """Follows every path to its return."""
        todo = [self]
        while todo:
            state = todo.pop()
            if state.pc == RETURN:
                yield state
            elif state.instructions == 2_000:
                state.refuse("2 000 instructions, and no return")
            else:
                todo += state.step()

    def step(self):
        """Executes one instruction. Returns the states to which it may lead."""
        self.now = self.image.instruction(self.pc)
        self.name, self.operands = self.now.insn_name(), self.now.operands
        self.pc += self.now.size
        self.instructions, self.cycles = self.instructions + 1, self.cycles + cycles(self.now)
        # Inside an IT block, a 16-bit instruction sets no flags, except cmp and tst.
        self.sets_flags = self.now.update_flags and not (self.conditions and self.now.size == 2)
        condition = self.holds(self.conditions.pop(0)) if self.conditions else z3.BoolVal(True)
        return sum([way.execute() if taken else [way] for taken, way in self.fork(condition)], [])

    def execute(self):
        if self.name in ("cps", "msr", "mrs", "udf", "svc", "bkpt"):
            self.refuse("only a panic uses this instruction")
        if self.name not in EXECUTIONS:
            # This is not a `Failure`, so that an unknown instruction does not count as noticing a seeded bug.
            raise NotImplementedError(f"{self.now.mnemonic} {self.now.op_str}")
        self.image.kinds.add(self.name)
        return EXECUTIONS[self.name](self) or [self]

    def holds(self, condition):
        n, z, c, v = (self.flags[flag] for flag in "NZCV")
        pairs = [z, c, n, v, z3.And(c, z3.Not(z)), n == v, z3.And(z3.Not(z), n == v), z3.BoolVal(True)]
        pair, is_opposite = divmod(condition - arm.ARM_CC_EQ, 2)
        return z3.Not(pairs[pair]) if is_opposite else pairs[pair]

    def load(self, address, size):
        parts = [self.memory.get(address + i, self.image.flash.get(address + i)) for i in range(size)]
        if None in parts:
            self.refuse(f"reads {size} bytes at {address:#x}")
        return joined([bits(part, 8) if isinstance(part, int) else part for part in parts])

    def store(self, address, value, size):
        if not any(address in region and address + size - 1 in region for region in self.writable):
            self.refuse(f"writes {size} bytes at {address:#x}")
        for i in range(size):
            self.memory[address + i] = z3.simplify(z3.Extract(8 * i + 7, 8 * i, value))

    def name_of(self, register):
        return ALIASES.get(name := self.now.reg_name(register), name)

    def get(self, register):
        return self.registers[self.name_of(register)]  # pc is not supported, because no step reads it.

    def put(self, name, value):
        if name == "pc":
            return self.jump(value)
        self.registers[name] = z3.simplify(value)
        if name == "sp":
            self.lowest_sp = min(self.lowest_sp, number(value))

    def jump(self, target):
        if number(target) is None or not number(target) & 1:
            self.refuse("the jump's target is unknown")
        self.pc = number(target) & ~1

    def branch(self):
        condition = self.holds(self.now.cc)
        if self.name == "bl":
            self.registers["lr"] = bits(self.pc | 1)
        elif self.name in ("cbz", "cbnz"):
            condition = (self.get(self.operands[0].reg) == 0) == (self.name == "cbz")
        for taken, way in (ways := self.fork(condition)):
            way.pc = self.operands[-1].imm if taken else way.pc
        return [way for _, way in ways]

    def table(self):
        """Jumps by the table of bytes after the instruction, once for each possible index."""
        index = self.get(self.operands[0].mem.index)
        self.demand("an index below 16", z3.ULT(index, 16))
        ways = [(n, self.assuming(index == n)) for n in range(16) if self.find(index == n) is not None]
        for n, way in ways:
            way.pc = self.pc + 2 * self.image.flash[self.pc + n]
        return [way for _, way in ways]

    def condition_block(self):
        first = self.now.cc
        other = first + 1 if first % 2 else first - 1
        self.conditions = [first if way == "t" else other for way in self.now.mnemonic[1:]]

    def push_or_pop(self):
        names = [self.name_of(operand.reg) for operand in self.operands]
        sp, size, is_push = number(self.registers["sp"]), 4 * len(names), self.name == "push"
        self.put("sp", bits(sp - size if is_push else sp + size))
        for place, name in zip(range(sp - size if is_push else sp, sp + size, 4), names):
            if is_push:
                self.store(place, self.registers[name], 4)
            else:
                self.put(name, self.load(place, 4))

    def access(self):
        """Loads or stores one register or two."""
        is_load, count = self.name.startswith("ldr"), 2 if self.name.endswith("d") else 1
        size, memory = {"b": 1, "h": 2}.get(self.name[3:], 4), self.operands[count].mem
        index = self.get(memory.index) << memory.lshift if memory.index else 0
        address = number(self.get(memory.base) + index + memory.disp)
        if address is None or len(self.operands) > count + 1 or self.now.writeback:
            self.refuse("the address is unknown, or the instruction changes its pointer")
        for i, operand in enumerate(self.operands[:count]):
            if is_load:
                self.put(self.name_of(operand.reg), z3.ZeroExt(32 - 8 * size, self.load(address + 4 * i, size)))
            else:
                self.store(address + 4 * i, self.get(operand.reg), size)

    def second(self):
        """Returns the last operand, shifted, and the carry out of the shift."""
        operand, carry = self.operands[-1], self.flags["C"]
        if operand.type == arm.ARM_OP_IMM:
            # The carry of a 32-bit instruction depends on its encoding.
            return bits(operand.imm), carry if self.now.size == 2 else z3.FreshBool()
        if operand.shift.type == arm.ARM_SFT_INVALID:
            return self.get(operand.reg), carry
        return shift(SHIFTS[operand.shift.type], self.get(operand.reg), bits(operand.shift.value), carry)

    def compute(self):
        a, (b, carry) = self.get(self.operands[-2].reg), self.second()
        result, *flags = OPERATIONS[self.name](a, b, self.flags["C"])
        if self.name not in ("cmp", "tst"):
            self.put(self.name_of(self.operands[0].reg), result)
        if self.sets_flags or self.name in ("cmp", "tst"):
            new = dict(zip("NZCV", [result < 0, result == 0, *(flags or [carry])]))
            self.flags |= {flag: z3.simplify(is_set) for flag, is_set in new.items()}

    def bit_field(self):
        into, (low, width) = self.operands[0].reg, self.operands[-2:]
        of = bits(0) if self.name == "bfc" else self.get(self.operands[1].reg)
        low, mask = low.imm, (1 << width.imm) - 1
        inserted = self.get(into) & ~(mask << low) | (of & mask) << low
        self.put(self.name_of(into), inserted if self.name in ("bfi", "bfc") else z3.LShR(of, low) & mask)

def cycles(instruction):
    """Returns the greatest number of cycles by the Cortex-M4's manual, without wait states. A jump refills the pipeline in
    up to three cycles."""
    name, count = instruction.insn_name(), len(instruction.operands)
    known = {"push": 1 + count, "pop": 4 + count, "ldrd": 3, "strd": 3, "tbb": 5}
    known |= dict.fromkeys(["b", "bl", "bx", "cbz", "cbnz"], 4)
    return known.get(name, 2 if name.startswith(("ldr", "str")) else 1)

def shift(kind, value, amount, carry):
    """Returns the result and the carry. If the amount is unknown or above 32, the carry may be either."""
    result = {"lsl": value << amount, "lsr": z3.LShR(value, amount), "asr": value >> amount}[kind]
    if (n := number(amount)) is None or n > 32:
        return result, z3.FreshBool()
    last = 32 - n if kind == "lsl" else n - 1
    return result, z3.Extract(last, last, value) == 1 if n else carry

def subtract(a, b, _):
    return a - b, z3.UGE(a, b), (a ^ b) & (a ^ (a - b)) < 0

SHIFTS = {arm.ARM_SFT_ASR: "asr", arm.ARM_SFT_LSL: "lsl", arm.ARM_SFT_LSR: "lsr"}
# Each function takes two operands and the carry. It returns the result, perhaps followed by the new carry, and perhaps
# by the new overflow flag. If it returns no carry, the new carry is that of the last operand.
OPERATIONS = {
    "add": lambda a, b, c: (a + b, z3.ULT(a + b, a), (a ^ (a + b)) & (b ^ (a + b)) < 0),
    "sub": subtract, "cmp": subtract, "rsb": lambda a, b, c: subtract(b, a, c),
    "mov": lambda a, b, c: [b], "mvn": lambda a, b, c: [~b], "movt": lambda a, b, c: [a & 0xFFFF | b << 16],
    "and": lambda a, b, c: [a & b], "tst": lambda a, b, c: [a & b], "bic": lambda a, b, c: [a & ~b],
    "orr": lambda a, b, c: [a | b], "eor": lambda a, b, c: [a ^ b], "uxtb": lambda a, b, c: [b & 0xFF],
    "rev": lambda a, b, c: [z3.Concat(*[z3.Extract(8 * i + 7, 8 * i, b) for i in range(4)])],
    "clz": lambda a, b, c: [sum(z3.If(z3.LShR(b, i) == 0, bits(1), bits(0)) for i in range(32))],
} | {kind: lambda a, b, c, kind=kind: shift(kind, a, b & 0xFF, c) for kind in SHIFTS.values()}
EXECUTIONS = {"tbb": State.table, "it": State.condition_block, "push": State.push_or_pop, "pop": State.push_or_pop}
EXECUTIONS |= dict.fromkeys(["b", "bl", "cbz", "cbnz"], State.branch) | dict.fromkeys(OPERATIONS, State.compute)
EXECUTIONS |= dict.fromkeys(["ldr", "ldrb", "ldrh", "ldrd", "str", "strb", "strh", "strd"], State.access)
EXECUTIONS |= dict.fromkeys(["bfc", "bfi", "ubfx"], State.bit_field)
EXECUTIONS["bx"] = lambda state: state.jump(state.get(state.operands[0].reg))

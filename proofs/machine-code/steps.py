"""The specification of the step that takes a byte, and the proof that the step of an image follows this specification.
The specification shares no code with the firmware."""

import z3
from image import Failure
from thumb import REGISTERS, RETURN, State, bits, joined

FRAME = [0x41, 0x42, None, None, None, None, 0x0D]
AXES = ["pitch", "roll", "yaw"]
REASONS = {"no_sync": 0, "broken_sync": 1, "wrong_terminator": 6}  # Each reason, and the first wrong position in the frame.
# The setpoint that the main loop takes: one word, laid out as in firmware/src/setpoint.rs.
SETPOINT = {f"published {axis}": (n, 1) for n, axis in enumerate(AXES)} | {"sequence": (3, 1)}
KEPT_BY_CALLS = ["sp"] + [f"r{n}" for n in range(4, 12)]
MOST = {"receiver": (240, 380, 48), "lecture": (50, 90, 32)}  # Limits of a step: instructions, cycles, bytes of stack.

def one_if(condition):
    return z3.If(condition, bits(1), bits(0))

def begins_frame(data):
    return z3.And([byte == fixed for byte, fixed in zip(data, FRAME) if fixed is not None])

def pending(data):
    """Returns how many of the last bytes may still belong to a frame."""
    count = bits(0)
    for n in range(1, min(len(data), 6) + 1):
        count = z3.If(begins_frame(data[-n:]), bits(n), count)
    return count

def window(data, count):
    """Returns the word that holds these bytes: a 1 before the oldest byte, and the newest byte lowest. The four highest
    bits are 6 minus `count`, the number of bytes that may still belong to a frame."""
    note, above = z3.Extract(3, 0, 6 - count), bits(0, 52 - 8 * len(data))
    return z3.simplify(z3.Concat(note, above, bits(1, 8), *data))

def receiver(held, byte):
    """Unless the bytes are a frame, discards the pending bytes and this byte, oldest first, until a frame can begin
    with the rest. The first wrong position decides the reason. Returns whether there is a frame, its axes, the number
    of bytes discarded for each reason, and the fields after the step."""
    stream = held + [byte]
    is_frame = z3.And(len(stream) == 7, begins_frame(stream))
    kept, discarded = pending(stream), dict.fromkeys(REASONS, bits(0))
    after = z3.If(is_frame, window([], bits(0)), window(stream[-6:], kept))
    for n in range(1, len(stream) + 1):
        last = stream[-n:]
        is_discarded = z3.And(z3.ULE(n, pending(held) + 1), z3.UGT(n, kept), z3.Not(is_frame))
        for reason, place in REASONS.items():
            is_reason = z3.And(begins_frame(last[:place]), last[place] != FRAME[place]) if place < n else False
            discarded[reason] += one_if(z3.And(is_discarded, is_reason))
    return is_frame, stream[3:6], discarded, {"window": after}

def lecture(before, byte):
    """Does the same as `receiver`, by the lecture's table. `state` is the number of bytes of a frame that have come. A
    wrong byte is discarded together with them."""
    state, temp = before["state"], [before[axis] for axis in AXES]
    goes_on = z3.Or([z3.And(state == n, fixed is None or byte == fixed) for n, fixed in enumerate(FRAME)])
    after = {"state": z3.If(z3.And(goes_on, state < 6), state + 1, bits(0, 8))}
    after |= {axis: z3.If(state == 3 + n, byte, temp[n]) for n, axis in enumerate(AXES)}
    wrong = {reason: z3.And(state == place, z3.Not(goes_on)) for reason, place in REASONS.items()}
    discarded = {reason: (REASONS[reason] + 1) * one_if(condition) for reason, condition in wrong.items()}
    return z3.And(goes_on, state == 6), temp, discarded, after

def expected(before, is_frame, axes, discarded, fields):
    """Returns the fields after the step. Each byte is counted by its outcome. The setpoint is published in the step that
    completes its frame, and in no other step. All other fields keep their values."""
    after, was_lost = before | fields, before["lost"] == 1
    for name, more in (discarded | {"bytes": 1}).items():
        after[name] = before[name] + more
    is_lost = z3.Or(was_lost, *[count != 0 for count in discarded.values()])
    after["lost"] = one_if(z3.And(is_lost, z3.Not(is_frame)))
    counted = {"frames": 1, "frame_bytes": 7, "resynchronisations": one_if(was_lost), "sequence": 1}
    frame = {f"published {axis}": value for axis, value in zip(AXES, axes)}
    frame |= {name: before[name] + more for name, more in counted.items()}
    return after | {name: z3.If(is_frame, value, before[name]) for name, value in frame.items()}

class Step:
    """The step in an image, and the memory that it may use."""

    def __init__(self, image):
        line, setpoint, stack = (image.symbol(name) for name in ("LINE", "SETPOINT", "_stack_end"))
        layout, size = image.layout("receiver_step")
        self.image, self.kind, self.sp = image, "receiver" if "window" in layout else "lecture", stack + 0x400
        self.writable = [range(line, line + size), range(setpoint, setpoint + 4), range(stack, self.sp)]
        self.fields = {name: (line + offset, size) for name, (offset, size) in layout.items()}
        self.fields |= {name: (setpoint + offset, size) for name, (offset, size) in SETPOINT.items()}

    def called(self, before, byte, assumed=()):
        """Returns the state at the call. The flags, and the registers that a call does not set, may have any value. The
        step must not read padding, or parts of the stack that it has not written."""
        registers, memory = {name: z3.BitVec(name, 32) for name in REGISTERS}, {}
        registers |= {"r0": bits(self.writable[0].start), "r1": z3.ZeroExt(24, byte)}
        registers |= {"sp": bits(self.sp), "lr": bits(RETURN | 1)}
        for name, (place, size) in self.fields.items():
            memory |= {place + i: z3.simplify(z3.Extract(8 * i + 7, 8 * i, before[name])) for i in range(size)}
        return State(self.image, self.image.symbol("receiver_step") & ~1, registers, memory, self.writable, assumed)

    def cases(self, byte):
        """Yields every state that satisfies the invariant: the window holds up to six bytes and states how many of them may
        still belong to a frame, or the lecture's machine is in one of its states. With each state, yields the assumptions
        and the expected state after the step."""
        before = {name: z3.BitVec(name, 8 * size) for name, (_, size) in self.fields.items()}
        assumed = [z3.ULE(before["lost"], 1)]
        if self.kind == "lecture":
            yield before, [*assumed, z3.ULT(before["state"], 7)], expected(before, *lecture(before, byte))
            return
        for size in range(7):
            held = [z3.BitVec(f"held {n}", 8) for n in range(size)]
            for count in range(size + 1):
                before["window"] = window(held, bits(count))
                yield before, [*assumed, pending(held) == count], expected(before, *receiver(held, byte))

    def prove(self):
        """Proves the step. Returns its greatest costs."""
        byte, takes = z3.BitVec("byte", 8), []
        for before, assumed, after in self.cases(byte):
            state = self.called(before, byte, assumed)
            registers = dict(state.registers)
            for end in state.run():
                end.demand("registers", z3.And([end.registers[name] == registers[name] for name in KEPT_BY_CALLS]))
                for name, (place, size) in self.fields.items():
                    now = joined([end.memory[place + i] for i in range(size)])
                    end.demand(name, z3.simplify(now == after[name]))
                takes.append((end.instructions, end.cycles, self.sp - end.lowest_sp))
        most = tuple(map(max, zip(*takes)))
        if any(taken > limit for taken, limit in zip(most, MOST[self.kind])):
            raise Failure(f"takes {most}, more than {MOST[self.kind]}")
        return f"{len(takes)} paths, at most {most[0]} instructions, {most[1]} cycles, {most[2]} bytes of stack"

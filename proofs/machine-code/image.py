"""Reads a firmware's ELF file: flash, symbols, machine code, and the memory layout of a function's first argument."""

import functools
import capstone
from elftools.elf.elffile import ELFFile

THUMB = capstone.Cs(capstone.CS_ARCH_ARM, capstone.CS_MODE_THUMB | capstone.CS_MODE_MCLASS)
THUMB.detail = True

class Failure(Exception):
    """The proof fails: something differs from the specification, or is unknown."""

class Image:
    def __init__(self, path):
        self.elf = ELFFile(open(path, "rb"))
        self.flash = {}  # Bytes by address.
        for segment in self.elf.iter_segments("PT_LOAD"):
            self.flash |= enumerate(segment.data(), segment["p_paddr"])
        self.kinds = set()  # The kinds of instructions executed.

    @functools.cache
    def instruction(self, pc):
        code = bytes(self.flash.get(pc + i, 0) for i in range(4))
        for instruction in THUMB.disasm(code, pc, 1):
            return instruction
        raise Failure(f"{pc:#x}: no instruction")

    def symbol(self, name):
        """Returns the address of the only symbol with this name, plain or mangled."""
        symbols = self.elf.get_section_by_name(".symtab").iter_symbols()
        found = {one["st_value"] for one in symbols if one.name == name or f"{len(name)}{name}" in one.name}
        if len(found) != 1:
            raise Failure(f"{len(found)} symbols {name}")
        return found.pop()

    def layout(self, function):
        """Reads from DWARF the type that the function's first argument points to. Returns (offset, size) of each field by
        name, and the size of the whole type."""
        for unit in self.elf.get_dwarf_info().iter_CUs():
            for entry in unit.iter_DIEs():
                if entry.tag == "DW_TAG_subprogram" and attribute(entry, "name") == function.encode():
                    arguments = (one for one in entry.iter_children() if one.tag == "DW_TAG_formal_parameter")
                    pointed_to = type_of(type_of(next(arguments)))
                    return dict(fields(pointed_to)), attribute(pointed_to, "byte_size")
        raise Failure(f"DWARF has no {function}")

def attribute(entry, name):
    found = entry.attributes.get(f"DW_AT_{name}")
    return found and found.value

def type_of(entry):
    return entry.get_DIE_from_attribute("DW_AT_type")

def fields(entry, name="", offset=0):
    """Yields the innermost fields, those without fields of their own. A field of a
    tuple has the name of the field that contains the tuple."""
    inner = [child for child in entry.iter_children() if child.tag == "DW_TAG_member"]
    for child in inner:
        own = attribute(child, "name").decode()
        own = name if own.startswith("__") else own
        yield from fields(type_of(child), own, offset + attribute(child, "data_member_location"))
    if not inner and attribute(entry, "byte_size"):
        yield name, (offset, attribute(entry, "byte_size"))

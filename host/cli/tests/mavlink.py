"""Compares the values that `framelock decode` shows for MAVLink's definitions with those that pymavlink packed.

pymavlink's package has the definitions. Each message of two dialects is packed with random values, as MAVLink 2 and, if
its number allows, as MAVLink 1. `cargo xtask verify --only tables` installs pymavlink and runs this script.
"""

import importlib
import json
import math
import os
import random
import re
import struct
import subprocess
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from decimal import Decimal

import pymavlink

FRAMELOCK, DIALECTS = sys.argv[1:]
FOLDER = os.path.join(os.path.dirname(pymavlink.__file__), "dialects", "v20")
# Each message is packed with values from anywhere in the range, with small or special values, and with zeros.
ROUNDS = ["any", "special", "zero"]
# Columns that do not come from a message's fields. A field with such a name gets an underscore.
TAKEN = {"offset", "length", "time", "kind", "sequence", "system", "component", "message", "signature", "compatible_flags"}
BASES = {"deg", "deg/s", "degC", "rad/s", "m", "m/s", "V", "A", "%", "gauss", "s"}
POWERS = {"degE7": ("1e-7", "deg"), "degE5": ("1e-5", "deg"), "dam": ("10", "m")}
CODES = {"float": "f", "double": "d", "char": "s"}


class Field:
    def __init__(self, node, is_extension, enums):
        self.name = node.get("name")
        kind, _, count = node.get("type").partition("[")
        self.count = int(count[:-1]) if count else None
        self.kind = kind.removesuffix("_mavlink_version")
        self.is_float, self.is_text = self.kind in ("float", "double"), self.kind == "char"
        self.is_extension = is_extension
        self.bits = 64 if self.kind in ("double",) else int("".join(c for c in self.kind if c.isdigit()) or 32)
        self.names = {} if self.is_float else enums.get(node.get("enum"), {})
        self.factor = self.factor_of(node)
        self.missing = self.missing_of(node)

    def factor_of(self, node):
        """Returns the factor between a raw value and the value that is shown."""
        unit = node.get("units", "")
        if self.is_float:
            return None
        if node.get("multiplier"):
            return Decimal(node.get("multiplier")) if "/" not in node.get("multiplier") else None
        if unit in POWERS:
            return Decimal(POWERS[unit][0])
        if unit[1:] in BASES - {"s"} or unit in ("cs", "ds"):
            return {"d": Decimal("0.1"), "c": Decimal("0.01"), "m": Decimal("0.001")}.get(unit[0])
        return None

    def missing_of(self, node):
        text = node.get("invalid")
        if text is None or self.count and text == "[0]":
            return None
        text = text.strip("[]").rstrip(":")
        if text.upper() == "NAN":
            return math.nan
        if text.endswith("_MAX"):
            bits = int("".join(c for c in text if c.isdigit()))
            return 2**bits - 1 if text.startswith("U") else 2 ** (bits - 1) - 1
        if text in self.names.values():
            return next(value for value, name in self.names.items() if name == text)
        if text == "UINT16_MIN":
            return 0
        return float(text) if "." in text else int(text, 0)

    def random_value(self, chance, how):
        if self.is_text:
            length = {"any": self.count, "special": chance.randrange(self.count), "zero": 0}[how]
            # A text may end with blanks, but not with the byte that pads it.
            return bytes(chance.choice(b" !\"',;AZaz09~") for _ in range(length))
        special = [0, 1, *self.names] + ([] if self.missing is None else [self.missing] * 3)
        if self.is_float:
            if how == "any":
                number = struct.unpack("<f", chance.randbytes(4))[0] if self.bits == 32 else chance.uniform(-1e9, 1e9)
                # NaN has many bit patterns, which a row does not distinguish.
                return 0.5 if math.isnan(number) else number
            # In JSON, NaN is null, which `encode` takes for the missing value.
            odd = [math.inf, -math.inf, -0.5] + [math.nan] * (self.missing is None)
            return float(chance.choice(special + odd)) if how == "special" else 0.0
        least = 0 if self.kind.startswith("u") else -(2 ** (self.bits - 1))
        fitting = [value for value in special if least <= value < least + 2**self.bits]
        return {"any": chance.randrange(least, least + 2**self.bits), "special": chance.choice(fitting), "zero": 0}[how]

    def shown(self, value):
        """Returns the value that a row shows, or None if there is none."""
        if self.is_float:
            value = struct.unpack("<f", struct.pack("<f", value))[0] if self.bits == 32 else float(value)
            is_missing = math.isnan(value) or value == self.missing
            return None if is_missing else value
        if value == self.missing:
            return None
        return self.names.get(value) or (value if self.factor is None else value * self.factor)

    def is_same(self, expected, shown):
        if isinstance(expected, float) and not isinstance(shown, str) and shown is not None:
            if math.isinf(expected):
                return abs(shown) > (1e38 if self.bits == 32 else 1e308) and (shown > 0) == (expected > 0)
            code = "<f" if self.bits == 32 else "<d"
            return struct.pack(code, expected) == struct.pack(code, float(shown))
        return expected == shown and type(expected) in (type(shown), Decimal)


def definitions(name, enums, messages):
    """Reads the enums and the messages of a definition without pymavlink's own parser."""
    root = ElementTree.parse(os.path.join(FOLDER, name)).getroot()
    for include in root.iter("include"):
        definitions(include.text, enums, messages)
    for node in root.iter("enum"):
        own = enums.setdefault(node.get("name"), {})
        # The values of a bitmask have no names.
        if node.get("bitmask") != "true":
            own.update((int(entry.get("value"), 0), entry.get("name")) for entry in node.iter("entry"))
    for node in root.iter("message"):
        messages[int(node.get("id"))] = node


def fields_of(node, enums):
    children = [child for child in node if child.tag in ("field", "extensions")]
    tags = [child.tag for child in children] + ["extensions"]
    first = tags.index("extensions")
    return [Field(child, at > first, enums) for at, child in enumerate(children) if child.tag == "field"]


def framelock(arguments, data=b""):
    done = subprocess.run([FRAMELOCK, *arguments], input=data, capture_output=True)
    assert done.returncode == 0 and not done.stderr, (arguments, done.stderr.decode())
    return done.stdout


def check_numbers(path, classes):
    """Compares CRC_EXTRA and the lengths with those of pymavlink and of framelock's own tables."""
    described = tomllib.loads(framelock(["decode", "--frame", path, "--describe"]).decode())["kinds"]
    extras = {number: message.crc_extra for number, message in classes.items()}
    with open(DIALECTS) as file:
        table = {int(number): int(extra) for number, extra in re.findall(r"\((\d+),(\d+)\)", file.read())}
    assert [kind["name"] for kind in described] == ["mavlink2", "mavlink1"]
    for kind, first, most in zip(described, (10, 6), (1 << 24, 256)):
        known = dict(kind["messages"]["known"])
        assert known == {number: extra for number, extra in extras.items() if number < most}, kind["name"]
        assert known.items() <= table.items(), dict(known.items() - table.items())
        for view in kind["views"]:
            message = classes[int.from_bytes(bytes.fromhex(view["bytes"]), "little")]
            assert view["name"] == message.msgname, view["name"]
            bytes_of = lambda field: field.get("count", 1) * int(field["type"].strip("uifletxb") or 8) // 8
            end = max(field["at"] + bytes_of(field) for field in view["fields"])
            # pymavlink also packs extensions.
            assert end - first == message.unpacker.size or first == 6 and end - first < message.unpacker.size, view["name"]


def check(dialect):
    module = importlib.import_module(f"pymavlink.dialects.v20.{dialect}")
    path = os.path.join(FOLDER, f"{dialect}.xml")
    enums, nodes = {}, {}
    definitions(f"{dialect}.xml", enums, nodes)
    chance = random.Random(67)
    classes = {number: message for number, message in module.mavlink_map.items() if number >= 0}
    assert set(classes) == set(nodes), set(classes) ^ set(nodes)
    check_numbers(path, classes)
    packed = []
    for version in (2, 1):
        sender = module.MAVLink(None, srcSystem=7, srcComponent=9)
        for number, message in classes.items():
            if version == 1 and number > 255:
                continue
            fields = fields_of(nodes[number], enums)
            for how in ROUNDS:
                values = {}
                for field in fields:
                    one = not field.count or field.is_text
                    values[field.name] = field.random_value(chance, how) if one else [field.random_value(chance, how) for _ in range(field.count)]
                frame = message(**values).pack(sender, force_mavlink1=version == 1)
                packed.append((message.msgname, version, fields, values, frame))
    stream = b"".join(frame for *_, frame in packed)
    lines = framelock(["decode", "--frame", path, "--format", "jsonl"], stream)
    rows = [json.loads(line, parse_float=Decimal) for line in lines.splitlines()]
    assert len(rows) == len(packed), (dialect, len(rows), len(packed))
    compared = missing = named = 0
    for row, (name, version, fields, values, frame) in zip(rows, packed):
        assert (row["kind"], row["system"], row["component"], row["length"]) == (name, 7, 9, len(frame)), (name, row)
        for field in fields:
            where = (dialect, version, name, field.name, values[field.name], row)
            column = field.name + ("_" if field.name in TAKEN else "")
            if version == 1 and field.is_extension:
                assert column not in row, where
                continue
            if field.is_text:
                assert row[column] == values[field.name].decode(), where
            elif field.count is None:
                expected = field.shown(values[field.name])
                assert field.is_same(expected, row.get(column)), (*where, expected)
                missing += expected is None
                named += isinstance(expected, str)
            else:
                expected = [field.shown(value) for value in values[field.name]]
                assert len(row[column]) == field.count and all(map(field.is_same, expected, row[column])), (*where, expected)
                missing += expected.count(None)
            compared += 1
    assert missing > 100 and named > 100, (missing, named)
    # A row does not tell the version of MAVLink, so `encode` makes frames of MAVLink 2. A table has thousands of
    # columns, so it has only one frame of each message.
    of_2 = [(name, frame) for name, version, *_, frame in packed if version == 2]
    for form, frames in (("jsonl", of_2), ("csv", of_2[1 :: len(ROUNDS)])):
        table = framelock(["decode", "--frame", path, "--format", form], b"".join(frame for _, frame in frames))
        again = framelock(["encode", "--frame", path], table)
        for name, frame in frames:
            assert again.startswith(frame), (dialect, form, name, frame.hex(), again[: len(frame)].hex())
            again = again[len(frame) :]
        assert not again, (dialect, form)
    return f"{dialect}: {compared} fields of {len(packed)} frames of {len(classes)} messages"


for dialect in ("common", "ardupilotmega"):
    print(check(dialect))

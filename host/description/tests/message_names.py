"""Compares the names and the CRC_EXTRA of MAVLink's messages with those of pymavlink, from PyPI.

`cargo xtask verify --only tables` installs pymavlink and runs this. pymavlink lacks some messages of mavlink.io's
definitions. For these messages, src/message_names.txt has the names from mavlink.io's XML.
"""

import re
import sys

import pymavlink
from pymavlink.dialects.v20 import ardupilotmega

NAMES, DIALECTS = sys.argv[1:]

with open(NAMES) as file:
    names = {int(number): name for number, name in map(str.split, file)}
with open(DIALECTS) as file:
    extras = {int(number): int(extra) for number, extra in re.findall(r"\((\d+),(\d+)\)", file.read())}
assert list(names) == sorted(extras), set(names) ^ set(extras)
theirs = {number: message for number, message in ardupilotmega.mavlink_map.items() if number >= 0}
assert len(theirs) > 250, len(theirs)
for number, message in theirs.items():
    assert names.get(number) == message.msgname, (number, names.get(number), message.msgname)
    assert extras[number] == message.crc_extra, (number, extras[number], message.crc_extra)
print(f"{len(theirs)} of {len(names)} messages have the names of pymavlink {pymavlink.__version__}")

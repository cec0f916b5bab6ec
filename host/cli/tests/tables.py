"""Uses pandas and polars to read tables that `framelock decode` writes, and compares them with the values.

`cargo xtask verify --only tables` installs pandas and polars, and runs this script.
"""

import csv
import io
import json
import math
import os
import subprocess
import sys
import tempfile

import pandas
import polars

FRAMELOCK, RECORDINGS = sys.argv[1:]

# Values that programs tend to misread: hex that looks like a number, NaN, infinities, -0.0, numbers of 64 bits, and two
# kinds of missing values.
ODD = """
sync = "24"
length_field = { at = 1, type = "u8" }
longest = 60
fields = [{ name = "tag", at = 2, type = "u8" }]
[[kinds]]
name = "numbers"
shortest = 30
fields = [
    { name = "which", at = 3, type = "u8", value = 1 },
    { name = "single", at = 4, type = "f32le" },
    { name = "large", at = 8, type = "u64le" },
    { name = "iTOW", at = 16, type = "i64le", scale = 0.001, offset = -1000, unit = "s" },
    { name = "small", at = 24, type = "i16le", scale = 0.01, count = 2 },
    { name = "two", at = 28, type = "bytes", count = 2 },
    { name = "rest", at = 30, type = "bytes" },
]
[[kinds]]
name = "text"
shortest = 6
fields = [
    { name = "which", at = 3, type = "u8", value = 2 },
    { name = "note", at = 4, type = "text", count = 2 },
]
"""
CRSF = b"""\
{"kind":"GPS","address":200,"type":2,"latitude":-47.3977418,"longitude":8.5455939,"groundspeed":36.1,"heading":271.05,\
"altitude":-12,"satellites":14}
{"kind":"BATTERY","address":200,"type":8,"voltage":16.8,"current":12.5,"capacity_used":1300,"remaining":57}
{"kind":"ATTITUDE","address":200,"type":30,"pitch":-0.1234,"roll":3.1415,"yaw":0.0001}
{"kind":"crsf","address":200,"type":33,"payload":"x1E0500"}
"""
SINGLES = [1.5, math.nan, math.inf, -math.inf, -0.0, 1e-7, 3.4028235e38]
LARGES = [0, 1, 2**63 - 1, 2**53 + 1, 7, 8, 9]
ITOWS = ["4503599627370.496", "-4503599627370.497", "0.000", "-1000.000", "1.001", "2.000", "3.000"]
TWOS = ["x0600", "x1E05", "x0000", "x9999", "xFFFF", "x00E1", "x1234"]


def framelock(arguments, data):
    done = subprocess.run([FRAMELOCK, *arguments], input=data, capture_output=True)
    assert done.returncode == 0 and not done.stderr, (arguments, done.stderr.decode())
    return done.stdout


def odd_rows():
    rows = ["kind,tag,single,large,iTOW,small1,small2,two,rest,note"]
    for single, large, itow, two in zip(SINGLES, LARGES, ITOWS, TWOS):
        rows.append(f"numbers,1,{str(single).replace('nan', 'NaN')},{large},{itow},-0.01,327.67,{two},{two}{two[1:]},")
        rows.append("text,2,,,,,,,,ab")
    return "\n".join(rows).encode()


def number(cell):
    """Returns the value of a CSV cell: None if the cell is empty, a number if the text is one, otherwise the text."""
    if cell == "":
        return None
    try:
        return float(cell) if any(c in cell for c in ".eEnN") else int(cell)
    except ValueError:
        return cell


def same(expected, read, where):
    if expected is None or read is None or read is pandas.NA:
        # pandas does not distinguish a missing value from NaN.
        gone = read is None or read is pandas.NA or isinstance(read, float) and math.isnan(read)
        assert gone and (expected is None or isinstance(expected, float) and math.isnan(expected)), where
    elif isinstance(expected, float) and isinstance(read, float) and math.isnan(expected):
        assert math.isnan(read), where
    elif isinstance(expected, str):
        assert read == expected, where
    else:
        assert not isinstance(read, str) and float(read) == float(expected), (where, expected, read)


def compare(rows, columns, read, where):
    """Compares the rows with a table that was read as a list of objects."""
    assert len(rows) == len(read), where
    for row, own in zip(rows, read):
        for column in columns:
            same(row.get(column), own.get(column), (*where, column))


def records(table):
    if isinstance(table, polars.DataFrame):
        return table.to_dicts()
    return [{k: None if v is pandas.NA else v for k, v in row.items()} for row in table.astype(object).to_dict("records")]


def check(frame, stream):
    table = framelock(["decode", "--frame", frame, "--format", "csv"], stream)
    reader = csv.DictReader(io.StringIO(table.decode(), newline=""))
    rows = [{name: number(cell) for name, cell in row.items()} for row in reader]
    assert rows, frame
    columns = reader.fieldnames
    again = framelock(["encode", "--frame", frame], table)
    assert again == stream, (frame, again.hex(), stream.hex())
    lines = framelock(["decode", "--frame", frame], stream)
    assert framelock(["encode", "--frame", frame], lines) == stream, frame
    nullable = pandas.read_csv(io.BytesIO(table), dtype_backend="numpy_nullable")
    inferred = polars.read_csv(io.BytesIO(table), infer_schema_length=None)
    for name, read in [
        ("pandas", pandas.read_csv(io.BytesIO(table))),
        ("pandas, nullable", nullable),
        ("polars", inferred),
    ]:
        compare(rows, columns, records(read), (frame, name, "csv"))
    # framelock encodes the table that polars writes. polars reads the decimals of large.toml as floats, which lose
    # digits.
    if frame != "large.toml":
        back = framelock(["encode", "--frame", frame], inferred.write_csv().encode())
        assert back == stream, frame
    if not frame.endswith(".toml"):
        back = framelock(["encode", "--frame", frame], nullable.to_csv(index=False).encode())
        assert back == stream, frame

    objects = [json.loads(line) for line in lines.splitlines()]
    for row, own in zip(rows, objects):
        for column in columns:
            if column in own and not isinstance(own[column], (str, type(None))) and abs(own[column]) < 1e39:
                same(row[column], own[column], (frame, "json", column))
    names = {name for own in objects for name in own}
    for name, read in [
        ("pandas", pandas.read_json(io.BytesIO(lines), lines=True, precise_float=True)),
        ("polars", polars.read_ndjson(io.BytesIO(lines), infer_schema_length=None)),
    ]:
        own = records(read)
        for column in names:
            values = [row[column] for row in objects if row.get(column) is not None]
            if any(isinstance(value, list) for value in values):
                continue
            is_text = any(isinstance(value, str) for value in values)
            for row, value in zip(objects, own):
                same(row.get(column), value.get(column), (frame, name, "json", column))
            kind = str(read[column].dtype).lower()
            assert (kind in ("str", "string", "object")) == is_text or not values, (frame, name, column, kind)
    for column in columns:
        cells = [row[column] for row in rows if row[column] is not None]
        is_text = any(isinstance(cell, str) for cell in cells)
        for kind in (str(nullable[column].dtype).lower(), str(inferred[column].dtype).lower()):
            # A column without any value has no type.
            assert not cells or is_text == (kind in ("str", "string")), (frame, column, kind)
    return len(rows)


def main():
    streams = {}
    with open(RECORDINGS) as recordings:
        for line in recordings:
            frame, found, digits = line.partition(": ")
            if found and not line.startswith(("#", "{")):
                streams[frame] = streams.get(frame, b"") + bytes.fromhex(digits)
    for frame in ("bin", "bin-crc8"):
        streams[frame] = framelock(["encode", "--frame", frame], b"127,200,74\n0,255,1\n")
    streams["crsf"] += framelock(["encode", "--frame", "crsf"], CRSF)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        with open("odd.toml", "w") as file:
            file.write(ODD)
        streams["odd.toml"] = framelock(["encode", "--frame", "odd.toml"], odd_rows())
        with open("large.toml", "w") as file:
            file.write("sync='24'\nlength=17\nfields=[{ name='large', at=1, type='u64le' }, { name='scaled', at=9, type='i64le', scale=0.001, offset=-1000 }]")
        # This stream has no missing values, because pandas would read a column with missing values as text.
        streams["large.toml"] = framelock(["encode", "--frame", "large.toml"], b"18446744073709551615,9223372036853775.807\n0,-9223372036855775.808\n")
        rows = sum(check(frame, stream) for frame, stream in streams.items())
    print(f"{rows} rows of {len(streams)} kinds of frames, by pandas {pandas.__version__} and polars {polars.__version__}")


main()

"""What `grideye convert` writes, as numpy, pandas, pyarrow, Polars, DuckDB, Pillow and the mcap package read it, beside the
recording's own text; and what it reads of files of temperatures alone.

Arguments: the program, a folder to write into.
"""

import base64
import csv
import json
import math
import subprocess
import sys
from pathlib import Path

import duckdb
import numpy
import pandas
import polars
import pyarrow.parquet
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from PIL import Image

program, folder = sys.argv[1], Path(sys.argv[2])
GOLDEN = "recordings/golden/two-sensors.csv"
SESSION = "recordings/linaige/Session2_2021-07-01_RoomB_v2.csv"


def convert(source, name, *more):
    out = folder / name
    subprocess.run([program, "convert", source, out, *more], check=True)
    return out


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def number(text):
    return float(text) if text else math.nan


def fits(schema, value):
    """Whether a value is as a JSON schema says, as far as the schemas here go."""
    kinds = {"object": dict, "integer": int, "number": (int, float), "string": str, "null": type(None)}
    if "enum" in schema:
        return value in schema["enum"]
    names = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    return (
        any(isinstance(value, kinds[name]) for name in names)
        and all(name in value for name in schema.get("required", []))
        and all(fits(inner, value[name]) for name, inner in schema.get("properties", {}).items() if isinstance(value, dict) and name in value)
    )


def refused_or(path, pieces, read, whole):
    """Cuts a file at many places; each piece is refused by its reader, or read as `whole` says of what was read."""
    content = path.read_bytes()
    cut = folder / f"cut{path.suffix}"
    refused = 0
    for piece in range(pieces):
        cut.write_bytes(content[: piece * len(content) // pieces])
        try:
            found = read(cut)
        except Exception:
            refused += 1
            continue
        assert whole(found), (path, piece)
    assert refused > 0 or whole is not never, path
    return refused


def never(_found):
    return False


def scale_of(image, left):
    """The colors of the scale whose left edge is there, from its hot end to its cold one."""
    top = next(y for y in range(image.height) if image.getpixel((left, y)) != image.getpixel((0, 0)))
    colors = [image.getpixel((left, y)) for y in range(top, image.height)]
    return colors[: colors.index(image.getpixel((0, 0)))]


def assert_colors(image, left, places, cell, frames):
    """Reads every cell's temperature on the picture's own scale: all of them lie on one line, to less than half a step."""
    colors = numpy.array(scale_of(image, left), int)
    found, want = [], []
    for (x, y), frame in zip(places, frames, strict=True):
        for pixel, degrees in enumerate(frame.reshape(64)):
            seen = image.getpixel((x + pixel % 8 * cell + cell // 2, y + pixel // 8 * cell + cell // 2))
            found.append(numpy.abs(colors - seen).sum(axis=1).argmin())
            want.append(degrees)
    line = numpy.polyfit(found, want, 1)
    assert line[0] < 0, "the hot end is above"
    worst = numpy.abs(numpy.polyval(line, found) - want).max()
    assert worst < 0.12, worst


PIXELS = [f"pixel{pixel}" for pixel in range(1, 65)]
for source in [GOLDEN, SESSION]:
    text = rows(convert(source, "again.csv"))
    degrees = numpy.array([[number(row[pixel]) for pixel in PIXELS] for row in text])

    # numpy
    arrays = numpy.load(convert(source, "a.npz"))
    assert arrays["frames"].shape == (len(text), 8, 8) and arrays["frames"].dtype == numpy.float32
    assert numpy.array_equal(arrays["frames"].reshape(-1, 64), degrees, equal_nan=True)
    for name in ["seq", "t_boot_ns", "t_utc_ns"]:
        assert [int(value) for value in arrays[name]] == [int(row[name]) for row in text], name
    assert numpy.array_equal(arrays["thermistor_c"], [number(row["thermistor"]) for row in text], equal_nan=True)
    for name in ["clock", "missing"]:
        assert [str(value) for value in arrays[name]] == [row[name] for row in text], name
    streams = [str(arrays["streams"][index]) for index in arrays["stream"]]
    assert streams == [f"{row['device']}/{row['sensor']}/{row['boot']}" for row in text]

    # Columns: each reader's own idea of a value that is not there is made None.
    parquet = convert(source, "a.parquet")
    want = {
        name: [None if row[name] == "" else float(row[name]) if name in PIXELS + ["thermistor"] else row[name] for row in text]
        for name in text[0]
    }
    for name in ["seq", "t_boot_ns", "t_utc_ns", "t_arrival_ns"]:
        want[name] = [None if value is None else int(value) for value in want[name]]
    arrow = pyarrow.parquet.read_table(parquet)
    table = folder / "again.csv"
    got_of_text = {
        "pandas": {
            name: [None if pandas.isna(value) else value for value in column]
            for name, column in pandas.read_csv(table, dtype_backend="pyarrow").items()
        },
        "polars": polars.read_csv(table, infer_schema_length=None).to_dict(as_series=False),
        "duckdb": dict(zip(text[0], map(list, zip(*duckdb.sql(f"select * from read_csv('{table}', sample_size=-1)").fetchall())))),
    }
    got = {
        "pyarrow": arrow.to_pydict(),
        "polars": polars.read_parquet(parquet).to_dict(as_series=False),
        "duckdb": dict(zip(arrow.column_names, map(list, zip(*duckdb.sql(f"select * from '{parquet}'").fetchall())))),
        "pandas": {
            name: [None if pandas.isna(value) else value for value in column]
            for name, column in pandas.read_parquet(parquet, dtype_backend="pyarrow").items()
        },
    }
    for reader, table in [*got.items(), *got_of_text.items()]:
        assert list(table) == list(want), (reader, list(table))
        for name in want:
            # Of texts alone a reader of CSV makes numbers.
            if name == "people_number":
                table[name] = [str(value) for value in table[name]]
            assert table[name] == want[name], (reader, name, table[name][:5], want[name][:5])

    # Messages
    with open(convert(source, "a.mcap"), "rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        schemas = {schema.name: schema for schema in summary.schemas.values()}
        assert set(schemas) == {"foxglove.RawImage", "grideye.State"}, schemas
        declared = {name: json.loads(schema.data) for name, schema in schemas.items()}
        # As foxglove/schemas has them, schemas/jsonschema/RawImage.json.
        fields = declared["foxglove.RawImage"]["properties"]
        assert {name: field["type"] for name, field in fields.items()} == {
            "timestamp": "object", "frame_id": "string", "width": "integer", "height": "integer",
            "encoding": "string", "step": "integer", "data": "string",
        }  # fmt: skip
        assert fields["data"]["contentEncoding"] == "base64"
        assert {name: field["type"] for name, field in fields["timestamp"]["properties"].items()} == {"sec": "integer", "nsec": "integer"}
        assert summary.statistics.message_count == len(text) + sum(row["missing"] == "" for row in text)
        states, images = [], {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            place, what = channel.topic.rsplit("/", 1)
            body = json.loads(message.data)
            assert fits(declared[schema.name], body), (schema.name, body)
            if what == "state":
                states.append((place, body, message.log_time))
            else:
                assert (schema.name, channel.message_encoding) == ("foxglove.RawImage", "json")
                images[message.log_time, place] = body
    assert len(states) == len(text)
    for row, (place, state, at_ns) in zip(text, states):
        assert place == f"/{row['device']}/{row['sensor']}"
        assert (state["boot"], state["seq"], state["clock"]) == (row["boot"], int(row["seq"]), row["clock"])
        assert (state["missing"] or "") == row["missing"]
        image = images.get((at_ns, place))
        if row["missing"]:
            assert state["thermistor_celsius"] is None
            continue
        assert state["thermistor_celsius"] == float(row["thermistor"])
        assert (image["width"], image["height"], image["encoding"], image["step"]) == (8, 8, "32FC1", 32)
        assert image["timestamp"]["sec"] * 10**9 + image["timestamp"]["nsec"] == at_ns
        pixels = numpy.frombuffer(base64.b64decode(image["data"]), "<f4")
        assert numpy.array_equal(pixels, [float(row[pixel]) for pixel in PIXELS])
    print(f"{source}: {len(text)} rows equal in numpy, pandas, pyarrow, Polars, DuckDB and mcap")

# Pictures
sheet = Image.open(convert(SESSION, "a.png"))
sheet.load()
film = Image.open(convert(SESSION, "a.gif"))
frames, length_ms = 0, 0
while True:
    try:
        film.seek(frames)
    except EOFError:
        break
    frames, length_ms = frames + 1, length_ms + film.info["duration"]
session = rows(folder / "again.csv")
assert frames == len(session), (frames, len(session))
median_ns = numpy.median(numpy.diff([int(row["t_boot_ns"]) for row in session]))
assert abs(length_ms / 1000 - frames * median_ns * 1e-9) < 0.02 * frames * median_ns * 1e-9
print(f"a sheet of {sheet.width} x {sheet.height} dots, and a film of {frames} frames and {length_ms / 1000:.1f} s")

degrees = numpy.array([[number(row[pixel]) for pixel in PIXELS] for row in session])
for number_of_frame in range(0, frames, 97):
    film.seek(number_of_frame)
    # From the film's own size: eight cells between margins, and the scale right of them.
    assert_colors(film.convert("RGB"), 350, [(12, 12)], 40, degrees[number_of_frame : number_of_frame + 1])
shown = degrees[::16]
places = [(12 + 172 * (index % 10), 12 + 192 * (index // 10)) for index in range(len(shown))]
assert_colors(sheet.convert("RGB"), 1740, places, 20, shown)
print(f"{len(shown)} frames of the sheet and {len(range(0, frames, 97))} of the film have the colors of their temperatures")

# Files that were cut off: nothing wrong is read.
def film_of(path):
    image, found = Image.open(path), []
    try:
        while True:
            image.seek(len(found))
            found.append(image.convert("RGB").tobytes())
    except EOFError:
        return found


def messages_of(path):
    found = []
    with open(path, "rb") as file:
        try:
            for record in StreamReader(file, emit_chunks=False, validate_crcs=True).records:
                if type(record).__name__ == "Message":
                    found.append(record.data)
        except Exception:
            pass
    return found


brief = folder / "brief.csv"
with open(folder / "again.csv") as source:
    brief.write_text("".join(line for line, _ in zip(source, range(61))))
made = {name: convert(brief, f"brief.{name}") for name in ["npz", "parquet", "png", "gif", "mcap"]}
refused_or(made["npz"], 97, lambda path: {name: array for name, array in numpy.load(path).items()}, never)
refused_or(made["parquet"], 97, pyarrow.parquet.read_table, never)
sheet_bytes = Image.open(made["png"]).convert("RGB").tobytes()
refused_or(made["png"], 97, lambda path: Image.open(path).convert("RGB").tobytes(), lambda found: found == sheet_bytes)
film_frames = film_of(made["gif"])
assert len(film_frames) == 60
refused_or(made["gif"], 97, film_of, lambda found: found == film_frames[: len(found)])
messages = messages_of(made["mcap"])
assert len(messages) == 120
refused_or(made["mcap"], 97, messages_of, lambda found: found == messages[: len(found)])
print("files cut at 97 places are refused by their readers, or read up to the cut")

# What others wrote: arrays, texts and tables of numpy, pandas and polars.
frames = numpy.load(folder / "a.npz")["frames"][:50]
flat = frames.reshape(-1, 64)
names = [f"p{pixel}" for pixel in range(64)]
times = [1_625_163_247_274_925_001 + index * 100_000_000 for index in range(50)]
table = pandas.DataFrame(flat.astype("f8"), columns=names)
timed = table.assign(when=pandas.to_datetime(times, unit="ns", utc=True), people=3)
numpy.save(folder / "bare.npy", frames)
numpy.save(folder / "words.npy", (flat * 4).astype("i2"))
numpy.savez_compressed(folder / "bare.npz", pictures=frames, when=numpy.array(times), people=numpy.full(50, 3))
numpy.savetxt(folder / "bare.txt", flat)
numpy.savetxt(folder / "bare.csv", flat, delimiter=",", fmt="%.2f")
(folder / "lists.txt").write_text("".join(f"{frame}\n" for frame in frames))
(folder / "lists.jsonl").write_text("".join(json.dumps({"frame": frame.tolist()}) + "\n" for frame in frames))
table.to_csv(folder / "indexed.csv")
timed.to_csv(folder / "timed.csv", index=False)
timed.to_parquet(folder / "snappy.parquet")
polars.from_pandas(timed).write_parquet(folder / "zstd.parquet")
# pandas' own to_json rounds nanoseconds.
stamped = timed.assign(when=[stamp.isoformat(timespec="nanoseconds") for stamp in timed["when"]])
stamped.to_json(folder / "records.json", orient="records")
WITH_TIMES = ["bare.npz", "timed.csv", "snappy.parquet", "zstd.parquet", "records.json"]
UNTIMED = ["bare.npy", "words.npy", "bare.txt", "bare.csv", "lists.txt", "lists.jsonl", "indexed.csv"]
for name in UNTIMED + WITH_TIMES:
    found = rows(convert(folder / name, f"from-{name}.csv"))
    degrees = numpy.array([[float(row[pixel]) for pixel in PIXELS] for row in found])
    assert numpy.array_equal(degrees, flat), name
    assert {row["thermistor"] for row in found} == {""}, name
    assert [int(row["t_boot_ns"]) for row in found] == [index * 100_000_000 for index in range(50)], name
    if name in WITH_TIMES:
        assert [int(row["t_utc_ns"]) for row in found] == times, name
        assert {row["people"] for row in found} == {"3"}, name
print(f"50 frames that numpy, pandas and polars saved in {len(UNTIMED + WITH_TIMES)} ways are imported as they were")

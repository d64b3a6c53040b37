"""What `grideye convert` writes, as numpy, pandas, pyarrow, Polars, DuckDB, Pillow, mcap-ros2-support and rosbags read it, beside the
recording's own text; and what it reads of files of temperatures alone.

Arguments: the program, a folder to write into.
"""

import csv
import json
import math
import re
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
from mcap_ros2.decoder import DecoderFactory
from PIL import Image
from rosbags.typesys import Stores, get_typestore

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


def equal(one, other):
    """Whether two decoders found the same in a message."""
    if isinstance(one, (str, int, float)):
        return one == other
    if isinstance(one, (bytes, list, tuple, numpy.ndarray)):
        return len(one) == len(other) and all(equal(*pair) for pair in zip(one, other))
    return all(equal(getattr(one, name), getattr(other, name)) for name in one.__slots__ if not name.startswith("_"))


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

    # Messages: the file as MCAP's own reader checks it, and its messages as two decoders of ROS 2 read them, the one by the file's
    # definitions, the other by those that ROS 2 Humble ships.
    path = convert(source, "a.mcap")
    humble = get_typestore(Stores.ROS2_HUMBLE)
    states, images, thermistors = [], {}, {}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        whole = sum(row["missing"] == "" for row in text)
        measured = sum(row["thermistor"] != "" for row in text)
        assert reader.get_summary().statistics.message_count == len(text) + whole + measured
        for schema, channel, message, body in reader.iter_decoded_messages(log_time_order=False):
            assert (channel.message_encoding, schema.encoding) == ("cdr", "ros2msg")
            again = humble.deserialize_cdr(message.data, schema.name)
            assert equal(body, again), (schema.name, body, again)
            # Its own encoder pads the end to what a buffer is aligned to.
            assert bytes(humble.serialize_cdr(again, schema.name)).rstrip(b"\0") == message.data.rstrip(b"\0")
            assert body.header.stamp.sec * 10**9 + body.header.stamp.nanosec == message.log_time == message.publish_time
            place, what = channel.topic.rsplit("/", 1)
            if what == "state":
                states.append((place, message.log_time, body))
            else:
                {"image": images, "thermistor": thermistors}[what][message.log_time, place] = (schema.name, body)
    assert len(states) == len(text)
    for row, (place, at_ns, body) in zip(text, states, strict=True):
        name = f"{row['device']}/{row['sensor']}"
        assert place == "/" + re.sub("[^A-Za-z0-9/]", "_", name)
        (state,) = body.status
        values = {pair.key: pair.value for pair in state.values}
        assert (state.name, state.hardware_id, body.header.frame_id) == (name, row["device"], name)
        assert (state.level, state.message) == (2 if row["missing"] else 0, row["missing"])
        labels = list(row)[list(row).index("pixel64") + 1 :]
        for key in ["boot", "seq", "t_boot_ns", "clock", *labels]:
            assert values[key] == row[key], (key, values)
        schema, image = images.pop((at_ns, place), (None, None))
        assert (image is None) == (row["missing"] != "")
        if image is not None:
            assert (schema, image.header.frame_id) == ("sensor_msgs/msg/Image", name)
            assert (image.width, image.height, image.encoding, image.step, image.is_bigendian) == (8, 8, "32FC1", 32, 0)
            pixels = numpy.frombuffer(bytes(image.data), "<f4")
            assert numpy.array_equal(pixels, [float(row[pixel]) for pixel in PIXELS])
        schema, thermistor = thermistors.pop((at_ns, place), (None, None))
        assert (thermistor is None) == (row["thermistor"] == "")
        if thermistor is not None:
            assert schema == "sensor_msgs/msg/Temperature"
            assert (thermistor.temperature, thermistor.variance) == (float(row["thermistor"]), 0)
    assert not images and not thermistors
    print(f"{source}: {len(text)} rows equal in numpy, pandas, pyarrow, Polars, DuckDB, mcap-ros2-support and rosbags")

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
assert len(messages) == 180
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

"""What both peers do with a batch: one row a frame with a blob of words, a frame sent again changes nothing, and the answer
after a commit with `synchronous = FULL`.

    python table.py      lays the file out, with INGEST_STORE=FILE
"""

import os
import sqlite3
import threading

LOCAL = threading.local()

TABLE = """
CREATE TABLE IF NOT EXISTS frames (
    device TEXT NOT NULL, sensor TEXT NOT NULL, boot TEXT NOT NULL, seq INTEGER NOT NULL, t_boot_ns INTEGER NOT NULL,
    t_utc_ns INTEGER NOT NULL, clock TEXT NOT NULL, thermistor INTEGER NOT NULL, pixels BLOB NOT NULL,
    PRIMARY KEY (device, sensor, boot, seq)
) WITHOUT ROWID"""


def connected():
    return sqlite3.connect(os.environ["INGEST_STORE"], timeout=30, isolation_level=None)


def lay_out():
    """Before a server has many threads: who turns to the log while another does is refused at once, whatever the timeout."""
    database = connected()
    database.execute("PRAGMA journal_mode = WAL")
    database.execute(TABLE)
    database.close()


def connection():
    if not hasattr(LOCAL, "connection"):
        LOCAL.connection = connected()
        LOCAL.connection.execute("PRAGMA synchronous = FULL")
    return LOCAL.connection


def keep(batch, pack):
    database = connection()
    durable_through = {}
    database.execute("BEGIN IMMEDIATE")
    for sensor in batch["sensors"]:
        database.executemany(
            "INSERT INTO frames VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING",
            [
                (
                    batch["device"], sensor["sensor"], batch["boot"], frame["seq"], frame["t_boot_ns"], frame["t_utc_ns"],
                    frame["clock"], frame["thermistor_raw"], pack("<64H", *frame["pixels_raw"]),
                )
                for frame in sensor["frames"]
            ],
        )
        if sensor["frames"]:
            durable_through[sensor["sensor"]] = sensor["frames"][-1]["seq"]
    database.execute("COMMIT")
    return {"durable_through": durable_through, "gaps": []}


if __name__ == "__main__":
    lay_out()

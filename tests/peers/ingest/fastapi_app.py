"""FastAPI behind uvicorn, SQLite: checked by pydantic, one row a frame, a commit that is synced before the answer.

    uvicorn --workers 2 --port PORT fastapi_app:app      with INGEST_STORE=FILE
"""

import struct
from typing import Annotated, Literal

from fastapi import FastAPI
from pydantic import BaseModel, Field

import table

Word = Annotated[int, Field(ge=0, le=65535)]
Count = Annotated[int, Field(ge=0)]


class Frame(BaseModel):
    seq: Count
    t_boot_ns: Count
    t_utc_ns: int
    clock: Literal["unsynced", "synced", "stepped"]
    thermistor_raw: Word
    pixels_raw: Annotated[list[Word], Field(min_length=64, max_length=64)]


class Sensor(BaseModel):
    sensor: str
    frames: list[Frame]


class Batch(BaseModel):
    device: str
    boot: str
    t_sent_boot_ns: Count
    sensors: list[Sensor]


app = FastAPI()


@app.post("/v1/frames")
def frames(batch: Batch):
    return table.keep(batch.model_dump(), struct.pack)

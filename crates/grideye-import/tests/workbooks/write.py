"""Writes the workbooks beside it with openpyxl 3.1.5, which shares no code with what reads them.

python3 -m venv v && v/bin/pip install openpyxl==3.1.5 && v/bin/python write.py
"""

import datetime
import zipfile
from pathlib import Path

import openpyxl

FOLDER = Path(__file__).parent
START = datetime.datetime(2021, 7, 1, 18, 14, 7, 274925)


def celsius(frame):
    """As tests/suite/support.rs."""
    return [20 + (13 * pixel + 29 * frame + 7 * frame * frame) % 41 / 4 for pixel in range(64)]


def fill(sheet, rows):
    for row in rows:
        sheet.append(row)


def stamp(frame):
    return START + datetime.timedelta(milliseconds=100 * frame)


def save(book, name):
    # The same bytes each time but for the time of writing, which openpyxl sets.
    book.save(FOLDER / name)


names = [f"p{pixel}" for pixel in range(64)]

# A caption, dates as cells, a count of people that is empty at times, and notes in another sheet.
book = openpyxl.Workbook()
sheet = book.active
sheet.title = "Evening"
sheet.append(["Corridor, ceiling 2.5 m"])
sheet.append(["when", *names, "people"])
fill(sheet, ([stamp(frame), *celsius(frame), frame or None] for frame in range(6)))
notes = book.create_sheet("Notes")
notes["B3"] = 'the "warm" cup\nis on the table'
save(book, "evening.xlsx")

# Two sheets with frames; days and times of day apart; dates counted from 1904, as Excel for Mac did.
book = openpyxl.Workbook()
book.epoch = openpyxl.utils.datetime.CALENDAR_MAC_1904
for title, first in (("Morning", 0), ("Late, too", 1)):
    sheet = book.create_sheet(title)
    sheet.append(["date", "time", *names])
    fill(sheet, ([stamp(frame).date(), stamp(frame).time(), *celsius(frame)] for frame in range(first, first + 4)))
book.remove(book.worksheets[0])
save(book, "two.xlsx")

# What a formula that failed and a row that was cleared leave; elapsed time.
book = openpyxl.Workbook()
sheet = book.active
fill(sheet, ([datetime.timedelta(milliseconds=250 * frame), *celsius(frame)] for frame in range(5)))
sheet["K3"] = "#DIV/0!"
for cell in sheet[4]:
    cell.value = None
save(book, "damaged.xlsx")

# Another sensor, and sheets that are too wide and too tall for any.
book = openpyxl.Workbook()
fill(book.active, ([frame + 0.5] * 768 for frame in range(3)))
save(book, "other.xlsx")
book = openpyxl.Workbook()
book.active.cell(1, 2049, 1)
save(book, "wide.xlsx")
with zipfile.ZipFile(FOLDER / "wide.xlsx") as wide, zipfile.ZipFile(FOLDER / "tall.xlsx", "w", zipfile.ZIP_DEFLATED) as tall:
    for name in wide.namelist():
        # openpyxl writes no row that Excel lacks.
        tall.writestr(name, wide.read(name).replace(b'"BZU1"', b'"A1048577"'))

"""Of the rows that `cargo bench --bench ingest` prints, several of each server: the medians, and how many times Flask's.

    medians.py < ROWS
"""

import collections
import statistics
import sys

NAME_CHARS = 20
# Those of a row's figures that are told: frames/s, frames/CPU s, p50, p99. Before them is the number of agents.
FIGURES = slice(1, 5)

rows = collections.defaultdict(list)
for line in sys.stdin:
    name, figures = line[:NAME_CHARS].strip(), line[NAME_CHARS:].split()
    if name != "server":
        rows[name, int(figures[0])].append([float(figure) for figure in figures[FIGURES]])
medians = {key: [statistics.median(column) for column in zip(*of_server)] for key, of_server in rows.items()}

print(f"{'server':<20} {'agents':>6} {'frames/s':>10} {'frames/CPU s':>12} {'p50 ms':>9} {'p99 ms':>9} {'times by wall':>14} {'by CPU':>7}")
for (name, agents), (wall, cpu, p50, p99) in medians.items():
    flask_wall, flask_cpu, _, _ = medians["Flask, gunicorn", agents]
    print(
        f"{name:<20} {agents:>6} {wall:>10.0f} {cpu:>12.0f} {p50:>9.2f} {p99:>9.2f}"
        f" {wall / flask_wall:>14.1f} {cpu / flask_cpu:>7.1f}"
    )

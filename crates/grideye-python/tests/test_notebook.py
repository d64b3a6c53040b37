"""The notebook, cell by cell, and that it was committed without what it printed."""

import json
import os
from pathlib import Path

import matplotlib
from conftest import PROGRAM, ROOT

NOTEBOOK = ROOT / "crates/grideye-python/examples/scene-to-training-data.ipynb"


def test_from_a_scene_to_a_verdict_to_training_data(monkeypatch):
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    monkeypatch.chdir(NOTEBOOK.parent)
    monkeypatch.setenv("PATH", f"{Path(PROGRAM).parent}:{os.environ['PATH']}")
    seen, plots = {}, 0
    for cell in json.loads(NOTEBOOK.read_text())["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None
            exec("".join(cell["source"]), seen)
            plots += len(plt.get_fignums())
            plt.close("all")
    assert plots == 3
    assert (seen["result"].verdict, seen["other"].verdict) == ("agrees", "disagrees")
    assert seen["accuracy"] > 0.65

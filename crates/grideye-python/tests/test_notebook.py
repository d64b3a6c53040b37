"""The notebooks, cell by cell: what they print is what was committed with them.

GRIDEYE_WRITE_NOTEBOOKS=1 commits what they print and draw now.
"""

import ast
import base64
import contextlib
import io
import json
import os
import re

import matplotlib
import pytest
from conftest import ROOT

EXAMPLES = ROOT / "crates/grideye-python/examples"
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def outputs(source, names, plt):
    """Of a cell: what it prints, the value of its last line and its figures, as Jupyter keeps them."""
    printed, tree, found = io.StringIO(), ast.parse(source), []
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    with contextlib.redirect_stdout(printed):
        exec(compile(tree, "cell", "exec"), names)
        value = None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    if printed.getvalue():
        found.append({"name": "stdout", "output_type": "stream", "text": printed.getvalue().splitlines(keepends=True)})
    if hasattr(value, "_repr_html_"):
        data = {"text/html": value._repr_html_().splitlines(keepends=True), "text/plain": repr(value).splitlines(keepends=True)}
        found.append({"data": data, "execution_count": None, "metadata": {}, "output_type": "execute_result"})
    for number in plt.get_fignums():
        image = io.BytesIO()
        plt.figure(number).savefig(image, dpi=60, bbox_inches="tight")
        png = base64.b64encode(image.getvalue()).decode()
        found.append({"data": {"image/png": png}, "metadata": {}, "output_type": "display_data"})
    plt.close("all")
    return found


def texts(cells):
    """All that was printed; of pictures only that they are there, since their bytes are of one version of matplotlib."""
    told = []
    for output in (output for cell in cells for output in cell.get("outputs", [])):
        data = output.get("data", {})
        told.append("picture" if "image/png" in data else "".join(output.get("text", data.get("text/plain", []))))
    return "\n".join(told)


@pytest.mark.parametrize("name", ["scene-to-training-data", "own-csv-to-counter"])
def test_a_notebook_prints_what_was_committed(monkeypatch, name):
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.close("all")
    monkeypatch.chdir(EXAMPLES)
    path = EXAMPLES / f"{name}.ipynb"
    notebook, names = json.loads(path.read_text()), {}
    assert "subprocess" not in path.read_text()
    code = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    made = [{**cell, "outputs": outputs("".join(cell["source"]), names, plt)} for cell in code]
    if os.environ.get("GRIDEYE_WRITE_NOTEBOOKS"):
        for cell, new in zip(code, made):
            cell["outputs"] = new["outputs"]
        path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n")
    committed, now = texts(code), texts(made)
    assert NUMBER.sub("#", committed) == NUMBER.sub("#", now)
    # Sums in another order round otherwise, on another processor.
    for old, new in zip(NUMBER.findall(committed), NUMBER.findall(now)):
        assert float(new) == pytest.approx(float(old), rel=0.02, abs=0.05), (old, new)
    assert path.stat().st_size < 200_000
    if name == "scene-to-training-data":
        assert (names["result"].verdict, names["other"].verdict) == ("agrees", "disagrees")
    else:
        assert names["accuracy"] > 0.6

"""The documented Keras loader, run as it is printed, feeds a network for one epoch.

Arguments: the program, a folder to write into.
"""

import subprocess
import sys
from pathlib import Path

program, folder = sys.argv[1], Path(sys.argv[2])
FRAMES, PER_PART, BATCH = 2000, 500, 50

vary = [f"--vary=agent.{name}.present=on,off" for name in ("standing", "sitting", "lying")]
arguments = ["--frames", str(FRAMES), "--frames-per-part", str(PER_PART), "--format", "npy", "--out", folder / "people"]
subprocess.run([program, "dataset", "scenes/people.toml", *vary, *arguments], check=True, stdout=subprocess.DEVNULL)

(block,) = [
    text for text in Path("crates/grideye/DATASET.md").read_text().split("```python\n")[1:] if text.startswith('import os; os.environ["KERAS')
]
documented = {}
exec(block.split("```")[0], documented)
keras, batches = documented["keras"], documented["Batches"](folder / "people", size=BATCH)
assert keras.backend.backend() == "jax", keras.backend.backend()

keras.utils.set_random_seed(1)
layers = keras.layers
network = keras.Sequential([keras.Input((8, 8, 1)), layers.Flatten(), layers.LayerNormalization(), layers.Dense(5, activation="softmax")])
network.compile(keras.optimizers.Adam(0.01), "sparse_categorical_crossentropy", metrics=["accuracy"])
before = network.evaluate(batches, verbose=0, return_dict=True)
network.fit(batches, verbose=0)
after = network.evaluate(batches, verbose=0, return_dict=True)
assert int(network.optimizer.iterations) == len(batches) == FRAMES // BATCH
# One constant answer is right in half of the frames; labels of other frames teach no more.
assert after["accuracy"] > 0.6 > before["accuracy"], (before, after)
print(f"accuracy {before['accuracy']:.2f} before and {after['accuracy']:.2f} after one epoch of {FRAMES} frames")

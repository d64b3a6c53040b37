"""The frames of a scene once more, by ray casting in numpy and in Embree, beside those that `grideye` wrote.

    python ray_casting.py SCENE.toml FRAMES.npz [--every N] [--ours NAME=MICROSECONDS]... [--rounds N] [--json]

Written from the paper's text, MATLAB's definition of `imresize` and the description of the scene format. It reads the
scene itself: boxes that stand or walk, one sensor, law B. Every point of the sampling grid is a ray; numpy tests every
ray against every box (slabs, in single precision as one would for speed, and once in double precision as the
reference), Embree finds the first triangle. One core each.
"""

import argparse
import csv
import json
import os
import sys
import time
import tomllib
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

KELVIN = 273.15
PRESETS = {"grid-eye": dict(resolution=[8, 8], fov_deg=[60, 60], pixels_per_degree=5)}
EMISSIVITY = 0.8
LINEAR_BELOW_M = 0.01


class Box:
    """A cuboid that stands on its position and may be turned about the vertical."""

    def __init__(self, table, ambient_c):
        self.base_m = np.array(table.get("position_mm", [0, 0, 0]), float) / 1000
        self.size_m = np.array(table["size_mm"], float) / 1000
        yaw = np.radians(table.get("yaw_deg", 0.0))
        self.world_from_box = np.array(
            [[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]]
        )
        self.celsius = float(table.get("temperature_c", ambient_c))
        self.emissivity = float(table.get("emissivity", EMISSIVITY))

    def corners_m(self):
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (0, 2)], float)
        return self.base_m + (signs * self.size_m / 2) @ self.world_from_box.T


# The corners of a box, as `corners_m` counts them, of the two triangles of each of its faces.
TRIANGLES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)


class Scene:
    def __init__(self, path):
        text = tomllib.loads(path.read_text())
        if text.get("law", "B") != "B":
            sys.exit("only law B is known here")
        self.ambient_c = float(text["room"]["ambient_c"])
        self.objects = [Box(table, self.ambient_c) for table in text.get("object", [])]
        (agent,), (sensor,) = text["agent"], text["sensor"]
        self.agent = Box(agent, self.ambient_c)
        self.speed_m = agent["speed_mm_per_s"] / 1000
        rows = list(csv.DictReader((path.parent / agent["trajectory"]).open()))
        self.way_m = np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows]) / 1000
        self.sensor = Sensor({**PRESETS[sensor.get("preset", "grid-eye")], **sensor})

    def boxes(self, time_s):
        """Who walks stands at the arc length that its speed has brought it to."""
        legs_m = np.linalg.norm(np.diff(self.way_m, axis=0), axis=1)
        arc_m = np.concatenate([[0], np.cumsum(legs_m)])
        at_m = min(self.speed_m * time_s, arc_m[-1])
        self.agent.base_m = np.array([np.interp(at_m, arc_m, self.way_m[:, axis]) for axis in range(3)])
        return [*self.objects, self.agent]


class Sensor:
    def __init__(self, table):
        self.position_m = np.array(table["position_mm"], float) / 1000
        elevation, azimuth, roll = (np.radians(table.get(f"{name}_deg", 0.0)) for name in ("elevation", "azimuth", "roll"))
        forward = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), -np.sin(elevation)])
        level = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        upright = np.cross(forward, level)
        left = np.cos(roll) * level + np.sin(roll) * upright
        up = np.cos(roll) * upright - np.sin(roll) * level
        self.operating_m = table.get("operating_distance_mm", 5000) / 1000
        columns, rows = (round(fov * table["pixels_per_degree"]) for fov in table["fov_deg"])
        across, down = (
            (np.arange(points) + 0.5 - points / 2) / (points / 2) * np.tan(np.radians(fov) / 2)
            for points, fov in zip((columns, rows), table["fov_deg"])
        )
        rays = forward - across[None, :, None] * left - down[:, None, None] * up
        self.rays = (rays / np.linalg.norm(rays, axis=2, keepdims=True)).reshape(-1, 3)
        self.points = (rows, columns)
        pixel_columns, pixel_rows = table["resolution"]
        self.across = imresize_weights(columns, pixel_columns)
        self.down = imresize_weights(rows, pixel_rows)

    def pixels(self, picture):
        return self.down @ picture.reshape(self.points) @ self.across.T


def imresize_weights(inputs, outputs):
    """MATLAB's `contributions` of the triangle kernel, as a matrix of outputs by inputs."""
    scale = outputs / inputs
    shrink = min(scale, 1.0)
    width = 2.0 / shrink
    centers = np.arange(1, outputs + 1) / scale + 0.5 * (1 - 1 / scale)
    positions = np.floor(centers - width / 2)[:, None] + np.arange(int(np.ceil(width)) + 2)
    weights = shrink * np.maximum(0, 1 - np.abs(shrink * (centers[:, None] - positions)))
    weights /= weights.sum(axis=1, keepdims=True)
    mirrored = np.concatenate([np.arange(inputs), np.arange(inputs)[::-1]])
    matrix = np.zeros((outputs, inputs))
    for output in range(outputs):
        np.add.at(matrix[output], mirrored[(positions[output].astype(int) - 1) % (2 * inputs)], weights[output])
    return matrix


class Law:
    """Law B of each box, and of what no ray meets, which comes last; linear below a centimeter."""

    def __init__(self, scene, kind):
        self.kind, self.operating_m, self.ambient_c = kind, kind(scene.sensor.operating_m), kind(scene.ambient_c)
        boxes = scene.boxes(0.0)
        self.celsius = np.array([box.celsius for box in boxes] + [scene.ambient_c], kind)
        self.emissivity = np.array([box.emissivity for box in boxes] + [EMISSIVITY], kind)
        self.ambient4 = kind((scene.ambient_c + KELVIN) ** 4)
        kelvin = self.celsius.astype(float) + KELVIN
        self.excess4 = (kelvin**4 - float(self.ambient4)).astype(kind)

    def perceived(self, distance_m, box):
        emissivity = self.emissivity[box]
        weight = emissivity / (emissivity + distance_m * distance_m)
        seen = np.sqrt(np.sqrt(self.ambient4 + weight * self.excess4[box])) - self.kind(KELVIN)
        near = distance_m < self.kind(LINEAR_BELOW_M)
        if near.any():
            celsius = self.celsius[box]
            linear = celsius - (celsius - self.ambient_c) * distance_m / self.operating_m
            seen = np.where(near, linear, seen)
        return seen


class ByNumpy:
    """Slabs: a ray is in a box while it is between all three pairs of faces.

    What does not change from frame to frame, one over the rays as each box has them, is kept.
    """

    def __init__(self, scene, kind):
        self.scene, self.kind, self.law = scene, kind, Law(scene, kind)
        with np.errstate(divide="ignore"):
            self.inverse_rays = [
                np.ascontiguousarray(1 / (scene.sensor.rays @ box.world_from_box).T).astype(kind)
                for box in scene.boxes(0.0)
            ]

    def frame(self, time_s):
        boxes = self.scene.boxes(time_s)
        nearest = np.full(len(self.scene.sensor.rays), np.inf, self.kind)
        seen = np.full(len(nearest), len(boxes), np.intp)
        for index, box in enumerate(boxes):
            enters, is_hit = self.meets(box, self.inverse_rays[index])
            is_hit &= enters < nearest
            np.copyto(nearest, enters, where=is_hit)
            np.copyto(seen, index, where=is_hit)
        return self.scene.sensor.pixels(self.law.perceived(nearest, seen))

    def meets(self, box, inverse_rays):
        middle_m = box.base_m + [0, 0, box.size_m[2] / 2]
        origin = (self.scene.sensor.position_m - middle_m) @ box.world_from_box
        low = (-box.size_m / 2 - origin).astype(self.kind)[:, None] * inverse_rays
        high = (box.size_m / 2 - origin).astype(self.kind)[:, None] * inverse_rays
        enters = np.maximum.reduce(np.minimum(low, high))
        leaves = np.minimum.reduce(np.maximum(low, high, out=high))
        is_hit = (leaves >= enters) & (leaves > 0)
        return np.maximum(enters, 0, out=enters), is_hit


class ByEmbree:
    """A new scene of twelve triangles a box for every frame, as somebody has moved."""

    def __init__(self, scene):
        self.scene, self.law = scene, Law(scene, np.float32)
        self.rays = scene.sensor.rays.astype(np.float32)
        self.origins = np.broadcast_to(scene.sensor.position_m.astype(np.float32), self.rays.shape).copy()

    def frame(self, time_s):
        scene = self.scene
        boxes = scene.boxes(time_s)
        embree = EmbreeScene()
        corners = np.concatenate([box.corners_m() for box in boxes]).astype(np.float32)
        triangles = np.concatenate([TRIANGLES + 8 * index for index in range(len(boxes))]).astype(np.int32)
        # Kept for as long as the scene: it does not hold the mesh itself.
        mesh = TriangleMesh(embree, corners, triangles)
        hits = embree.run(self.origins, self.rays, output=1)
        del mesh
        is_hit = hits["primID"] >= 0
        distance = np.where(is_hit, hits["tfar"], np.float32(np.inf))
        seen = np.where(is_hit, hits["primID"] // len(TRIANGLES), len(boxes))
        return scene.sensor.pixels(self.law.perceived(distance, seen))


def best_us(caster, times_s, rounds):
    """Microseconds a frame in the fastest of several rounds, so that other work counts little."""
    fastest = float("inf")
    for _ in range(rounds):
        start = time.perf_counter()
        for time_s in times_s:
            caster.frame(time_s)
        fastest = min(fastest, time.perf_counter() - start)
    return 1e6 * fastest / len(times_s)


def measured(text):
    name, _, microseconds = text.partition("=")
    return name, float(microseconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=Path)
    parser.add_argument("frames", type=Path)
    parser.add_argument("--every", type=int, default=1, help="look at every Nth frame only")
    parser.add_argument("--ours", type=measured, action="append", default=[], metavar="NAME=MICROSECONDS")
    parser.add_argument("--rounds", type=int, default=0, help="rounds in which the peers are timed; 0: not at all")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()

    scene = Scene(options.scene)
    with np.load(options.frames) as archive:
        frames, times_s = archive["frames"][:: options.every], archive["time_s"][:: options.every]
    reference = ByNumpy(scene, np.float64)
    casters = {"numpy f64": reference, "numpy f32": ByNumpy(scene, np.float32), "embreex": ByEmbree(scene)}
    pictures = {name: np.array([caster.frame(time_s) for time_s in times_s]) for name, caster in casters.items()}
    report = {
        "frames": len(frames),
        "contrast_c": float(np.ptp(frames)),
        "largest_difference_c": {name: float(np.abs(picture - frames).max()) for name, picture in pictures.items()},
        "microseconds": dict(options.ours),
    }
    if options.rounds:
        for name, caster in casters.items():
            report["microseconds"][name] = best_us(caster, times_s, options.rounds)
    if options.json:
        print(json.dumps(report))
        return
    print(f"{report['frames']} frames of {options.scene.name}, {report['contrast_c']:.2f} degrees between their extremes")
    print(f"{'':14}{'us a frame':>12}{'ratio':>10}   largest difference, degrees")
    times = report["microseconds"]
    first = next(iter(times.values()), None)
    for name in [*dict(options.ours), *casters]:
        cost = f"{times[name]:12.1f}{times[name] / first:10.1f}" if name in times else " " * 22
        difference = report["largest_difference_c"].get(name)
        print(f"{name:14}{cost}   " + ("" if difference is None else f"{difference:.2e}"))


main()

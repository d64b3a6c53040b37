"""The counter in integers: rounds a trained network, counts with it, and writes its weights and test vectors.

All activations are in units of 1/256. A layer has weights of 8 bits in units of 2^-shift and biases in units of
2^-(8 + shift); it gives (bias + sum of weight * input) >> shift, which a half in the bias rounds.
"""

import struct

import numpy as np

ONE = 256
MOST = 32767


def rounded(layers):
    """(shift, biases, weights) of each layer, the weights as [out][in][row][column] or [out][in]."""
    whole = []
    for number, (weights, biases) in enumerate(layers):
        weights = np.asarray(weights, float).T
        if number < 2:
            # In the network's order: row, column, in.
            weights = weights.reshape(len(weights), 3, 3, -1).transpose(0, 3, 1, 2)
        shift = int(np.clip(np.floor(np.log2(127 / np.abs(weights).max())), 1, 15))
        biases = np.round(np.asarray(biases, float) * ONE * 2.0**shift) + 2 ** (shift - 1)
        whole.append((shift, biases.astype(np.int64), np.round(weights * 2**shift).astype(np.int64)))
    return whole


def inputs(excess_c):
    """Frames less background and median, in integers."""
    return np.clip(np.round(np.asarray(excess_c, float) * ONE), -MOST, MOST).astype(np.int64)


def logits(layers, frames):
    """Of frames (N, 8, 8) in integers: four integers each."""
    images = frames[:, None]
    for shift, biases, weights in layers[:2]:
        padded = np.pad(images, ((0, 0), (0, 0), (1, 1), (1, 1)))
        windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), (2, 3))
        sums = np.einsum("nirckl,oikl->norc", windows, weights, optimize=True) + biases[:, None, None]
        images = np.clip(sums >> shift, 0, MOST)
    n, channels = images.shape[:2]
    pooled = images.reshape(n, channels, 4, 2, 4, 2).max((3, 5))
    flat = pooled.transpose(0, 2, 3, 1).reshape(n, -1)
    (shift, biases, weights), (last_shift, last_biases, last_weights) = layers[2:]
    hidden = np.clip((flat @ weights.T + biases) >> shift, 0, MOST)
    return (hidden @ last_weights.T + last_biases) >> last_shift


def calibrated(layers, found, people):
    """The network whose logits have the temperature of the best likelihood of these frames, whose logits are `found`."""

    def surprise(temperature):
        scaled = found / temperature
        scaled -= scaled.max(axis=1, keepdims=True)
        return np.mean(np.log(np.exp(scaled).sum(axis=1)) - scaled[np.arange(len(people)), people])

    temperature = min(np.arange(0.5, 2.0, 0.01), key=surprise)
    weights, biases = layers[-1]
    return [*layers[:-1], (weights / temperature, biases / temperature)], temperature


def write_weights(path, layers):
    sizes = [len(biases) for _, biases, _ in layers]
    parts = [b"GEC1", bytes(sizes)]
    for shift, biases, weights in layers:
        parts += [struct.pack("<B", shift), biases.astype("<i4").tobytes(), weights.astype("i1").tobytes()]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"".join(parts))


def write_vectors(path, layers, frames):
    """A line a frame: its 64 integers, then the logits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path, np.hstack([frames.reshape(len(frames), 64), logits(layers, frames)]), "%d", ",")

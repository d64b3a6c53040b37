"""The counter's network in JAX: two convolutions of 3 x 3, a maximum of 2 x 2, one hidden layer."""

import os
from functools import partial

# Threads cost more than they save on a network this small.
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")

import jax
import jax.numpy as jnp
import numpy as np
from frames import symmetries

CHANNELS, HIDDEN = (12, 24), 24
STEPS, BATCH, RATE = 1500, 256, 2e-3
# The mean of the last weights: seeds differ less.
LAST = 0.995


def begin(seed, outputs):
    """Pairs of weights and biases, by Glorot."""
    inner, (one, two) = 9, CHANNELS
    shapes = [(inner, one), (inner * one, two), (16 * two, HIDDEN), (HIDDEN, outputs)]
    keys = jax.random.split(jax.random.PRNGKey(seed), 4)
    limits = [(6 / ((9 if layer < 2 else 1) * shape[1] + shape[0])) ** 0.5 for layer, shape in enumerate(shapes)]
    return [(jax.random.uniform(key, shape, minval=-limit, maxval=limit), jnp.zeros(shape[1])) for key, shape, limit in zip(keys, shapes, limits)]


def convolved(images, weights, biases):
    padded = jnp.pad(images, ((0, 0), (1, 1), (1, 1), (0, 0)))
    shifted = [padded[:, y : y + 8, x : x + 8] for y in range(3) for x in range(3)]
    return jax.nn.relu(jnp.concatenate(shifted, axis=-1) @ weights + biases)


@jax.jit
def logits(layers, frames):
    images = convolved(convolved(frames[..., None], *layers[0]), *layers[1])
    pooled = images.reshape(len(images), 4, 2, 4, 2, -1).max(axis=(2, 4)).reshape(len(images), -1)
    hidden = jax.nn.relu(pooled @ layers[2][0] + layers[2][1])
    return hidden @ layers[3][0] + layers[3][1]


@partial(jax.jit, static_argnames="steps")
def fitted(layers, frames, classes, steps):
    """By Adam, the rate falling to 0 by a cosine."""

    def loss(layers, frames, classes):
        return -jnp.mean(jax.nn.log_softmax(logits(layers, frames))[jnp.arange(len(classes)), classes])

    def step(state, batch):
        layers, mean, square, last, number = state
        slope = jax.grad(loss)(layers, *batch)
        mean = jax.tree.map(lambda old, new: 0.9 * old + 0.1 * new, mean, slope)
        square = jax.tree.map(lambda old, new: 0.999 * old + 0.001 * new * new, square, slope)
        rate = RATE * 0.5 * (1 + jnp.cos(jnp.pi * number / steps)) * jnp.sqrt(1 - 0.999 ** (number + 1)) / (1 - 0.9 ** (number + 1))
        layers = jax.tree.map(lambda old, up, over: old - rate * up / (jnp.sqrt(over) + 1e-7), layers, mean, square)
        last = jax.tree.map(lambda old, new: LAST * old + (1 - LAST) * new, last, layers)
        return (layers, mean, square, last, number + 1), None

    zeros = jax.tree.map(jnp.zeros_like, layers)
    return jax.lax.scan(step, (layers, zeros, zeros, layers, 0.0), (frames, classes))[0][3]


def train(frames, classes, groups, seed, steps=STEPS):
    """Draws batches from (members, share) of each group, in all eight symmetries and with up to 18 % more or less contrast."""
    random = np.random.default_rng(seed)
    shares = np.array([share for _, share in groups])
    group = random.choice(len(groups), steps * BATCH, p=shares / shares.sum())
    drawn = np.empty(steps * BATCH, int)
    for number, (members, _) in enumerate(groups):
        drawn[group == number] = random.choice(members, (group == number).sum())
    batches = frames[drawn] * random.uniform(0.82, 1.18, (len(drawn), 1, 1)).astype(np.float32)
    for turn in range(8):
        batches[turn::8] = symmetries(batches[turn::8])[turn]
    outputs = int(classes.max()) + 1 if classes.max() < 2 else 4
    shape = (steps, BATCH)
    return fitted(begin(seed, outputs), batches.reshape(*shape, 8, 8), classes[drawn].reshape(shape), steps)


def read(layers, frames):
    """Logits of any number of frames."""
    return np.concatenate([np.asarray(logits(layers, part)) for part in np.array_split(frames, max(1, len(frames) // 4096))])

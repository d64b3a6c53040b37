"""How a person looks in frames, and how alike two films are, by where the tracker says the person is."""

import numpy as np

ROW, COLUMN = np.arange(64) // 8, np.arange(64) % 8


def distances(walk, center=3.7, pixels_per_m=(4.3, 4.2)):
    """Each pixel's distance in pixels from the person, and the person's pixel, per row; defaults as measured on the set."""
    place = center + walk.place_m * (-pixels_per_m[0], pixels_per_m[1])
    return np.hypot(ROW - place[:, :1], COLUMN - place[:, 1:]), place


def above_far(frames, distance):
    """Frames less the median of their pixels away from the person: the level drifts by up to 1 °C."""
    return frames - np.nanmedian(np.where(distance > 3, frames, np.nan), axis=1, keepdims=True)


def looks(frames, walk, *mapping):
    """Peak, sum, width, and how far outward the warmth's center is, per frame, of the pixels within 3 of the person."""
    distance, place = distances(walk, *mapping)
    warmth = np.where(distance < 3, above_far(frames, distance), 0.0)
    total = warmth.sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        middle = np.stack([(warmth * ROW).sum(axis=1), (warmth * COLUMN).sum(axis=1)], axis=1) / total[:, None]
        square = (ROW - middle[:, :1]) ** 2 + (COLUMN - middle[:, 1:]) ** 2
        width = np.sqrt(np.maximum((warmth * square).sum(axis=1) / total / 2, 0))
        away = place - mapping[0]
        outward = ((middle - place) * away).sum(axis=1) / np.hypot(*away.T)
    found = np.stack([warmth.max(axis=1), total, width, outward], axis=1)
    found[total < 0.05, 2:] = np.nan
    return found


def likeness(real, simulated, distance):
    """C of all pixels, C of those within 3 of the person, RMSE of those within 2, per frame."""
    near = distance < 2
    with np.errstate(invalid="ignore", divide="ignore"):
        # Not a number where the person stands outside the image.
        rmse = np.sqrt(np.where(near, (real - simulated) ** 2, 0).sum(axis=1) / near.sum(axis=1))
        found = []
        for mask in (distance > -1, distance < 3):
            x, y = (np.where(mask, film, 0) for film in (real, simulated))
            x, y = (np.where(mask, film - (film.sum(axis=1) / mask.sum(axis=1))[:, None], 0) for film in (x, y))
            found.append((x * y).sum(axis=1) / np.sqrt((x * x).sum(axis=1) * (y * y).sum(axis=1)))
    return np.stack([*found, rmse], axis=1)

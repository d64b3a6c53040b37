"""Finds people below a Grid-EYE: pixels much warmer than the room."""

from statistics import median

CONTRAST_C = 5.0


def room_c(picture):
    """The room's temperature in °C: the median pixel."""
    return median(pixel for row in picture for pixel in row)


def somebody(picture):
    """Row and column, from 0, of each pixel that shows a person; empty if nobody is there."""
    threshold_c = room_c(picture) + CONTRAST_C
    return {
        (row, column)
        for row, pixels in enumerate(picture)
        for column, pixel in enumerate(pixels)
        if pixel > threshold_c
    }

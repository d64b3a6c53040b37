"""Who is below a Grid-EYE: the pixels that are much warmer than the room."""

from statistics import median

CONTRAST_C = 5.0


def room_c(picture):
    """The room's temperature in °C: that of the pixel in the middle of all."""
    return median(pixel for row in picture for pixel in row)


def somebody(picture):
    """Row and column, from 0, of each pixel that shows somebody; none when nobody is there."""
    threshold_c = room_c(picture) + CONTRAST_C
    return {
        (row, column)
        for row, pixels in enumerate(picture)
        for column, pixel in enumerate(pixels)
        if pixel > threshold_c
    }

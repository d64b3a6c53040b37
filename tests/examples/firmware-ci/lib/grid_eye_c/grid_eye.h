/* A small AMG8833 driver in plain C, for any microcontroller: the board gives it two functions for its I2C. */
#ifndef GRID_EYE_H
#define GRID_EYE_H

#include <stddef.h>
#include <stdint.h>

/* Both return 0, or the board's error. */
typedef struct grid_eye {
  int (*write)(void *bus, uint8_t address, const uint8_t *bytes, size_t count);
  int (*write_read)(void *bus, uint8_t address, const uint8_t *written, size_t written_count, uint8_t *read, size_t read_count);
  void *bus;
  uint8_t address;
} grid_eye;

/* Normal mode, and a reset; the first frames come 0.2 s later. */
int grid_eye_begin(const grid_eye *sensor);

/* All 64 pixels in °C, in one transaction, so that they are of one frame. */
int grid_eye_read_pixels(const grid_eye *sensor, float pixels_c[64]);

/* The sensor's own temperature in °C. */
int grid_eye_read_thermistor(const grid_eye *sensor, float *c);

#endif

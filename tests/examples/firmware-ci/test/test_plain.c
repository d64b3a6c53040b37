/* The driver in C on the emulated sensor, in this process: no program beside it, and no board. */
#include "board.h"
#include <assert.h>

int main(void) {
  float pixels_c[64], thermistor_c;
  const grid_eye sensor = board_with_a_sensor_at(-0.25f, -20.0f);
  assert(grid_eye_begin(&sensor) == 0);
  board_wait_ms(200);
  assert(grid_eye_read_pixels(&sensor, pixels_c) == 0);
  assert(pixels_c[0] == -0.25f && pixels_c[63] == -0.25f);
  assert(grid_eye_read_thermistor(&sensor, &thermistor_c) == 0);
  assert(thermistor_c == -20.0f);
}

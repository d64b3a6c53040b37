/* The board of the tests: the emulated sensor's bus behind the two functions that the driver asks for. */
#include <amg8833.h>

#ifdef __cplusplus
extern "C" {
#endif
#include "grid_eye.h"
#ifdef __cplusplus
}
#endif

static amg8833_bus board;

static int board_write(void *bus, uint8_t address, const uint8_t *bytes, size_t count) {
  return amg8833_write((amg8833_bus *)bus, address, bytes, count);
}

static int board_write_read(void *bus, uint8_t address, const uint8_t *written, size_t written_count, uint8_t *read,
                            size_t read_count) {
  return amg8833_write_read((amg8833_bus *)bus, address, written, written_count, read, read_count);
}

static inline void board_wait_ms(unsigned ms) { amg8833_advance_ns(&board, ms * AMG8833_MS); }

/* A sensor that powers on now, and sees one temperature. */
static inline grid_eye board_with_a_sensor_at(float pixels_c, float thermistor_c) {
  const grid_eye sensor = {board_write, board_write_read, &board, 0x69};
  amg8833_init(&board, sizeof board, 400000);
  amg8833_plug_celsius(&board, 0x69, pixels_c, thermistor_c);
  return sensor;
}

// The same driver with a test framework, from freezer to stove; and what it does when the sensor does not answer.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
#include "board.h"

TEST_CASE("pixels are what the sensor sees, below zero too") {
  for (float c : {-20.5f, -0.25f, 0.0f, 21.5f, 120.0f}) {
    float pixels_c[64];
    const grid_eye sensor = board_with_a_sensor_at(c, 25.0f);
    board_wait_ms(200);
    REQUIRE(grid_eye_read_pixels(&sensor, pixels_c) == 0);
    CHECK(pixels_c[0] == c);
    const amg8833_fault loose_wire = amg8833_fault_of(AMG8833_FAULT_NACK_ADDRESS);
    amg8833_set_fault(&board, 0x69, &loose_wire);
    CHECK(grid_eye_read_pixels(&sensor, pixels_c) == AMG8833_NACK_ADDRESS);
  }
}

/* Every misuse that can be noticed is an error, and leaves the bus as it was. Prints nothing unless something is wrong. */
#include "check.h"

#include <math.h>
#include <stdlib.h>

static amg8833_error inner;

static void calls_its_own_bus(void *bus, uint64_t now_ns, amg8833_frame *frame) {
  (void)now_ns, (void)frame;
  inner = amg8833_advance_ns((amg8833_bus *)bus, 1);
}

/* Nothing but the address of the bus says that these are errors. */
static void every_call(amg8833_bus *bus, amg8833_error expected) {
  uint8_t bytes[2] = {0};
  amg8833_frame frame = {{0}, 0};
  amg8833_fault fault = amg8833_fault_of(AMG8833_FAULT_FREEZE);
  amg8833_counts counts;
  amg8833_scene scene = {"", NULL, 0, NULL, 0};
  uint64_t number;
  bool is_low;
  CHECK_IS(expected, amg8833_plug_celsius(bus, 0x69, 20, 25));
  CHECK_IS(expected, amg8833_plug_frame(bus, 0x69, &frame));
  CHECK_IS(expected, amg8833_plug_recording(bus, 0x69, &frame, 1));
  CHECK_IS(expected, amg8833_plug_callback(bus, 0x69, calls_its_own_bus, NULL));
  CHECK_IS(expected, amg8833_plug_scene(bus, 0x69, &scene, NULL, 0));
  CHECK_IS(expected, amg8833_unplug(bus, 0x69));
  CHECK_IS(expected, amg8833_write(bus, 0x69, bytes, 2));
  CHECK_IS(expected, amg8833_read(bus, 0x69, bytes, 2));
  CHECK_IS(expected, amg8833_write_read(bus, 0x69, bytes, 1, bytes + 1, 1));
  CHECK_IS(expected, amg8833_start(bus, 0x69, 1));
  CHECK_IS(expected, amg8833_send(bus, 0));
  CHECK_IS(expected, amg8833_receive(bus, bytes));
  CHECK_IS(expected, amg8833_stop(bus));
  CHECK_IS(expected, amg8833_now_ns(bus, &number));
  CHECK_IS(expected, amg8833_advance_ns(bus, 1));
  CHECK_IS(expected, amg8833_next_frame_ns(bus, 0x69, &number));
  CHECK_IS(expected, amg8833_int_is_low(bus, 0x69, &is_low));
  CHECK_IS(expected, amg8833_wait_int(bus, 0x69, 1, 1));
  CHECK_IS(expected, amg8833_set_fault(bus, 0x69, &fault));
  CHECK_IS(expected, amg8833_clear_faults(bus, 0));
  CHECK_IS(expected, amg8833_fault_count(bus, AMG8833_FAULT_FREEZE, &number));
  CHECK_IS(expected, amg8833_set_seed(bus, 1));
  CHECK_IS(expected, amg8833_count(bus, 0, &counts));
  CHECK_IS(expected, amg8833_end(bus));
}

static void no_bus(void) {
  amg8833_bus bus, copy;
  char *odd = (char *)calloc(1, sizeof bus + 16);
  memset(&bus, 0, sizeof bus);
  every_call(NULL, AMG8833_NULL);
  every_call(&bus, AMG8833_NOT_A_BUS);
  CHECK_IS(AMG8833_NULL, amg8833_init(NULL, sizeof bus, 0));
  CHECK_IS(AMG8833_SIZE, amg8833_init(&bus, sizeof bus - 8, 0));
  OK(amg8833_init(&bus, sizeof bus, 0));
  memcpy(&copy, &bus, sizeof copy);
  every_call(&copy, AMG8833_NOT_A_BUS);
  OK(amg8833_end(&bus));
  every_call(&bus, AMG8833_NOT_A_BUS);
  /* Memory from a pool, which knows no alignment. */
  amg8833_bus *somewhere;
  char *pool = odd + 4;
  memcpy(&somewhere, &pool, sizeof somewhere);
  OK(amg8833_init(somewhere, sizeof bus, 0));
  OK(amg8833_plug_celsius(somewhere, 0x69, 20, 25));
  OK(amg8833_end(somewhere));
  free(odd);
}

static void wrong_arguments(amg8833_bus *bus) {
  uint8_t bytes[4] = {0x80};
  amg8833_frame frame = {{0}, 0};
  amg8833_fault fault = amg8833_fault_of(AMG8833_FAULT_FREEZE);
  amg8833_scene scene = {NULL, NULL, 0, NULL, 0};
  const size_t too_many = SIZE_MAX;
  CHECK_IS(AMG8833_ADDRESS, amg8833_plug_celsius(bus, 0x6A, 20, 25));
  CHECK_IS(AMG8833_ADDRESS, amg8833_unplug(bus, 0));
  CHECK_IS(AMG8833_NO_SENSOR, amg8833_unplug(bus, 0x68));
  CHECK_IS(AMG8833_NO_SENSOR, amg8833_set_fault(bus, 0x68, &fault));
  CHECK_IS(AMG8833_NO_SENSOR, amg8833_clear_faults(bus, 0x68));
  CHECK_IS(AMG8833_NO_SENSOR, amg8833_int_is_low(bus, 0x68, &(bool){false}));
  CHECK_IS(AMG8833_NO_SENSOR, amg8833_wait_int(bus, 0x68, 1, 1));
  CHECK_IS(AMG8833_NULL, amg8833_plug_frame(bus, 0x69, NULL));
  CHECK_IS(AMG8833_NULL, amg8833_plug_recording(bus, 0x69, NULL, 1));
  CHECK_IS(AMG8833_VALUE, amg8833_plug_recording(bus, 0x69, &frame, 0));
  CHECK_IS(AMG8833_VALUE, amg8833_plug_recording(bus, 0x69, &frame, too_many));
  CHECK_IS(AMG8833_NULL, amg8833_plug_callback(bus, 0x69, NULL, NULL));
  CHECK_IS(AMG8833_NULL, amg8833_plug_scene(bus, 0x69, NULL, NULL, 0));
  CHECK_IS(AMG8833_NULL, amg8833_plug_scene(bus, 0x69, &scene, NULL, 0));
  CHECK_IS(AMG8833_NULL, amg8833_write(bus, 0x69, NULL, 1));
  OK(amg8833_write(bus, 0x69, NULL, 0));
  CHECK_IS(AMG8833_NULL, amg8833_read(bus, 0x69, NULL, 1));
  CHECK_IS(AMG8833_VALUE, amg8833_read(bus, 0x69, bytes, too_many));
  CHECK_IS(AMG8833_VALUE, amg8833_read(bus, 0x80, bytes, 1));
  CHECK_IS(AMG8833_OVERLAP, amg8833_write_read(bus, 0x69, bytes, 2, bytes + 1, 2));
  CHECK_IS(AMG8833_OVERLAP, amg8833_read(bus, 0x69, (uint8_t *)bus, 64));
  CHECK_IS(AMG8833_OVERLAP, amg8833_write(bus, 0x69, (uint8_t *)bus + 64, 64));
  CHECK_IS(AMG8833_NULL, amg8833_now_ns(bus, NULL));
  CHECK_IS(AMG8833_NULL, amg8833_next_frame_ns(bus, 0x69, NULL));
  CHECK_IS(AMG8833_NULL, amg8833_int_is_low(bus, 0x69, NULL));
  CHECK_IS(AMG8833_NULL, amg8833_set_fault(bus, 0x69, NULL));
  CHECK_IS(AMG8833_NULL, amg8833_fault_count(bus, AMG8833_FAULT_FREEZE, NULL));
  CHECK_IS(AMG8833_VALUE, amg8833_fault_count(bus, AMG8833_FAULT_KINDS, &(uint64_t){0}));
  CHECK_IS(AMG8833_NULL, amg8833_count(bus, 0, NULL));
  CHECK_IS(AMG8833_NO_SENSOR, amg8833_count(bus, 0x68, &(amg8833_counts){0}));
  CHECK_IS(AMG8833_NOT_OPEN, amg8833_send(bus, 0));
  CHECK_IS(AMG8833_NOT_OPEN, amg8833_stop(bus));
  CHECK_IS(AMG8833_NULL, amg8833_receive(bus, NULL));
}

static void wrong_faults(amg8833_bus *bus) {
  static const struct {
    amg8833_fault_kind kind;
    int32_t byte, bit, reg, pixel, value;
    double chance;
  } WRONG[] = {
      {AMG8833_FAULT_KINDS, 0, 0, 0, 0, 0, 1},
      {AMG8833_FAULT_NACK_BYTE, -1, 0, 0, 0, 0, 1},
      {AMG8833_FAULT_NACK_BYTE, 65536, 0, 0, 0, 0, 1},
      {AMG8833_FAULT_SHORT_CLOCK, 0, -1, 0, 0, 0, 1},
      {AMG8833_FAULT_BIT_FLIP, 0, 8, 0, 0, 0, 1},
      {AMG8833_FAULT_BIT_FLIP, 0, 0, 256, 0, 0, 1},
      {AMG8833_FAULT_TORN, 0, 0, 0, 64, 0, 1},
      {AMG8833_FAULT_PIXEL_GLITCH, 0, 0, 0, 0, 0x1000, 1},
      {AMG8833_FAULT_THERMISTOR_FAILURE, 0, 0, 0, 0, -1, 1},
      {AMG8833_FAULT_CLOCK_ERROR, 0, 0, 0, 0, INT32_MIN, 1},
      {AMG8833_FAULT_SCL_SPEED, 0, 0, 0, 0, 0, 1},
      {AMG8833_FAULT_FREEZE, 0, 0, 0, 0, 0, -0.1},
      {AMG8833_FAULT_FREEZE, 0, 0, 0, 0, 0, 1.1},
      {AMG8833_FAULT_FREEZE, 0, 0, 0, 0, 0, NAN}};
  for (size_t at = 0; at < sizeof WRONG / sizeof WRONG[0]; at++) {
    amg8833_fault fault = amg8833_fault_of(WRONG[at].kind);
    fault.byte = WRONG[at].byte;
    fault.bit = WRONG[at].bit;
    fault.reg = WRONG[at].reg;
    fault.pixel = WRONG[at].pixel;
    fault.value = WRONG[at].value;
    fault.chance = WRONG[at].chance;
    CHECK_IS(AMG8833_VALUE, amg8833_set_fault(bus, 0x69, &fault));
  }
}

static void while_a_transaction_is_open(amg8833_bus *bus) {
  uint8_t byte = 0x80;
  amg8833_fault fault = amg8833_fault_of(AMG8833_FAULT_FREEZE);
  OK(amg8833_start(bus, 0x69, 1));
  CHECK_IS(AMG8833_OPEN, amg8833_plug_celsius(bus, 0x69, 20, 25));
  CHECK_IS(AMG8833_OPEN, amg8833_unplug(bus, 0x69));
  CHECK_IS(AMG8833_OPEN, amg8833_write(bus, 0x69, &byte, 1));
  CHECK_IS(AMG8833_OPEN, amg8833_read(bus, 0x69, &byte, 1));
  CHECK_IS(AMG8833_OPEN, amg8833_wait_int(bus, 0x69, 1, 1));
  CHECK_IS(AMG8833_OPEN, amg8833_set_fault(bus, 0x69, &fault));
  CHECK_IS(AMG8833_OPEN, amg8833_clear_faults(bus, 0));
  OK(amg8833_receive(bus, &byte));
  OK(amg8833_stop(bus));
}

int main(void) {
  amg8833_bus bus;
  uint8_t bytes[128];
  no_bus();
  OK(amg8833_init(&bus, sizeof bus, 100000));
  OK(amg8833_plug_celsius(&bus, 0x69, -0.25f, 25));
  wrong_arguments(&bus);
  wrong_faults(&bus);
  while_a_transaction_is_open(&bus);
  OK(amg8833_advance_ns(&bus, 100 * AMG8833_MS));
  OK(READ(&bus, 0x80, bytes));
  CHECK(bytes[0] == 0xFF && bytes[1] == 0x0F && bytes[127] == 0x0F);

  OK(amg8833_plug_callback(&bus, 0x68, calls_its_own_bus, &bus));
  OK(amg8833_advance_ns(&bus, 100 * AMG8833_MS));
  CHECK(inner == AMG8833_BUSY);
  /* Time ends after 584 years. */
  OK(amg8833_init(&bus, sizeof bus, 100000));
  OK(amg8833_advance_ns(&bus, UINT64_MAX));
  OK(amg8833_advance_ns(&bus, UINT64_MAX));
  CHECK_IS(AMG8833_NACK_ADDRESS, READ(&bus, 0x80, bytes));
  for (int number = -1; number < 40; number++) CHECK(strlen(amg8833_error_text((amg8833_error)number)) >= 4);
  return failures > 0;
}

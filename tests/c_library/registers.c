/* The library beside the AMG88 specification of 2016 (chapters in brackets) and that of 2011. */
#include "check.h"

/* 4-11-11: every printed word of a pixel. */
static const struct {
  float c;
  unsigned word;
} PIXELS[] = {{125, 0x1F4}, {25, 0x064}, {0.25f, 0x001}, {0, 0x000}, {-0.25f, 0xFFF}, {-25, 0xF9C}, {-55, 0xF24}};

/* 4-11-9, and 2011 4-10(9): of the thermistor, sign and magnitude. */
static const struct {
  float c;
  unsigned word;
} THERMISTOR[] = {{127.9375f, 0x7FF}, {125, 0x7D0}, {25, 0x190}, {0.25f, 0x004}, {0, 0x000}, {-0.25f, 0x804}, {-59.6875f, 0xBBB}, {-20, 0x940}};

#define COUNT(of) (sizeof(of) / sizeof(of)[0])

static unsigned word(const uint8_t *bytes) { return bytes[0] | (unsigned)bytes[1] << 8; }

static void words_of_the_datasheet(void) {
  amg8833_bus bus;
  amg8833_frame frame;
  uint8_t pixels[128], thermistor[2];
  OK(amg8833_init(&bus, sizeof bus, 100000));
  for (size_t row = 0; row < COUNT(THERMISTOR); row++) {
    frame.thermistor_c = THERMISTOR[row].c;
    for (size_t pixel = 0; pixel < 64; pixel++) frame.pixels_c[pixel] = PIXELS[pixel % COUNT(PIXELS)].c;
    OK(amg8833_plug_frame(&bus, 0x69, &frame));
    OK(amg8833_advance_ns(&bus, 100 * AMG8833_MS));
    OK(READ(&bus, 0x0E, thermistor));
    CHECK(word(thermistor) == THERMISTOR[row].word);
    OK(READ(&bus, 0x80, pixels));
    for (size_t pixel = 0; pixel < 64; pixel++) CHECK(word(&pixels[2 * pixel]) == PIXELS[pixel % COUNT(PIXELS)].word);
  }
}

/* The same bytes in one transfer, in two, and byte by byte; and the time of each bit: 9 a byte, and START, Sr, STOP. */
static void ways_to_read(void) {
  amg8833_bus bus;
  uint8_t once[128], apart[128], singly[128], reg = 0x80;
  uint64_t before, after;
  amg8833_counts counts;
  OK(amg8833_init(&bus, sizeof bus, 400000));
  OK(amg8833_plug_celsius(&bus, 0x69, -25, 20));
  OK(amg8833_advance_ns(&bus, 150 * AMG8833_MS));
  OK(amg8833_now_ns(&bus, &before));
  OK(READ(&bus, 0x80, once));
  OK(amg8833_now_ns(&bus, &after));
  CHECK(after - before == (uint64_t)(3 + 9 * (3 + 128)) * 2500);
  CHECK(word(once) == 0xF9C && word(&once[126]) == 0xF9C);
  OK(amg8833_write(&bus, 0x69, &reg, 1));
  OK(amg8833_read(&bus, 0x69, apart, sizeof apart));
  OK(amg8833_start(&bus, 0x69, 0));
  OK(amg8833_send(&bus, 0x80));
  OK(amg8833_start(&bus, 0x69, 1));
  for (size_t at = 0; at < sizeof singly; at++) OK(amg8833_receive(&bus, &singly[at]));
  OK(amg8833_stop(&bus));
  CHECK(memcmp(once, apart, sizeof once) == 0 && memcmp(once, singly, sizeof once) == 0);
  OK(amg8833_count(&bus, 0, &counts));
  CHECK(counts.transactions == 4 && counts.bytes == 3 * 128 + 3 + 3 + 3 && counts.nacks == 0);
  CHECK(counts.bits == 9 * counts.bytes + 4 * 2 + 2);
}

/* 4-11-11: registers stand still from START to STOP. A repeated START to write begins with a register address again. */
static void byte_by_byte(void) {
  amg8833_bus bus;
  amg8833_frame frames[3];
  uint8_t low, high;
  for (int at = 0; at < 3; at++) {
    frames[at].thermistor_c = 25;
    for (int pixel = 0; pixel < 64; pixel++) frames[at].pixels_c[pixel] = 20.0f + (float)at;
  }
  OK(amg8833_init(&bus, sizeof bus, 0));
  OK(amg8833_plug_recording(&bus, 0x69, frames, 3));
  OK(amg8833_advance_ns(&bus, 110 * AMG8833_MS));
  OK(amg8833_start(&bus, 0x69, 0));
  OK(amg8833_send(&bus, 0x02));
  OK(amg8833_start(&bus, 0x69, 0));
  OK(amg8833_send(&bus, 0x80));
  OK(amg8833_start(&bus, 0x69, 1));
  OK(amg8833_receive(&bus, &low));
  OK(amg8833_advance_ns(&bus, 500 * AMG8833_MS));
  OK(amg8833_receive(&bus, &high));
  CHECK(low == 0x50 && high == 0);
  CHECK_IS(AMG8833_NOT_OPEN, amg8833_send(&bus, 0));
  OK(amg8833_stop(&bus));
  uint8_t after[2];
  OK(READ(&bus, 0x80, after));
  CHECK(word(after) == 22 * 4);
  /* Nobody is at 0x20; to another address, a repeated START is STOP and START. */
  CHECK_IS(AMG8833_NACK_ADDRESS, amg8833_start(&bus, 0x20, 0));
  OK(amg8833_start(&bus, 0x69, 0));
  OK(amg8833_stop(&bus));
}

/* 4-11-1, 4-11-2, 4-11-6, 4-11-7 and 4-10: what the sensor refuses, it counts. */
static void refusals(void) {
  amg8833_bus bus;
  amg8833_counts counts;
  uint8_t mode[1];
  OK(amg8833_init(&bus, sizeof bus, 0));
  OK(amg8833_plug_celsius(&bus, 0x69, 20, 25));
  OK(set_register(&bus, 0x07, 0x20)); /* without its key */
  OK(set_register(&bus, 0x0E, 0x01));
  OK(set_register(&bus, 0x20, 0x01));
  OK(set_register(&bus, 0x01, 0x55));
  OK(set_register(&bus, 0x00, 0x10)); /* sleep */
  OK(set_register(&bus, 0x02, 0x01));
  OK(READ(&bus, 0x00, mode));
  CHECK(mode[0] == 0x10);
  OK(amg8833_count(&bus, 0x69, &counts));
  CHECK(counts.refused_without_key == 1 && counts.refused_read_only == 1 && counts.refused_reserved == 1 && counts.refused_commands == 1 && counts.refused_asleep == 1);
  uint64_t at;
  OK(amg8833_next_frame_ns(&bus, 0x69, &at));
  CHECK(at == UINT64_MAX);
  OK(set_register(&bus, 0x00, 0x00));
  OK(amg8833_next_frame_ns(&bus, 0x69, &at));
  CHECK(at == 100 * AMG8833_MS);
}

static void warm_in_the_third(void *calls, uint64_t now_ns, amg8833_frame *frame) {
  ++*(int *)calls;
  CHECK(now_ns == (uint64_t)*(int *)calls * 100 * AMG8833_MS);
  for (int pixel = 0; pixel < 64; pixel++) frame->pixels_c[pixel] = 20;
  if (now_ns == 300 * AMG8833_MS) frame->pixels_c[9] = 30.25f;
  frame->thermistor_c = 25;
}

/* 4-11-4, 4-11-8: absolute levels, upper 30 degrees (0x078); 4-11-10: pixel 10 is bit 1 of the table's second byte. */
static void interrupt(void) {
  amg8833_bus bus;
  amg8833_counts counts;
  uint8_t table[8], expected[8] = {0, 0x02};
  bool is_low = true;
  int calls = 0;
  uint64_t now;
  const uint8_t levels[] = {0x08, 0x78, 0x00, 0xD8, 0x0F}; /* -10 degrees is 0xFD8 */
  OK(amg8833_init(&bus, sizeof bus, 0));
  OK(amg8833_plug_callback(&bus, 0x69, warm_in_the_third, &calls));
  OK(amg8833_write(&bus, 0x69, levels, sizeof levels));
  OK(set_register(&bus, 0x03, 0x03));
  OK(amg8833_int_is_low(&bus, 0x69, &is_low));
  CHECK(!is_low);
  CHECK_IS(AMG8833_LATE, amg8833_wait_int(&bus, 0x69, 1, 250 * AMG8833_MS));
  OK(amg8833_wait_int(&bus, 0x69, 1, 1000 * AMG8833_MS));
  OK(amg8833_now_ns(&bus, &now));
  CHECK(now == 300 * AMG8833_MS && calls == 3);
  OK(READ(&bus, 0x10, table));
  CHECK(memcmp(table, expected, sizeof table) == 0);
  OK(amg8833_wait_int(&bus, 0x69, 0, 1000 * AMG8833_MS));
  OK(amg8833_count(&bus, 0x69, &counts));
  CHECK(counts.int_falls == 1 && counts.int_releases == 1 && counts.frames == 4);
}

/* A recording starts again with a reset (0x3F), after which a driver waits for two frames (4-11-2). */
static void reset(void) {
  amg8833_bus bus;
  amg8833_frame frames[9];
  uint8_t pixel[2];
  memset(frames, 0, sizeof frames);
  for (int at = 0; at < 9; at++) frames[at].pixels_c[0] = (float)at;
  OK(amg8833_init(&bus, sizeof bus, 0));
  OK(amg8833_plug_recording(&bus, 0x69, frames, 9));
  for (int round = 0; round < 2; round++) {
    OK(amg8833_advance_ns(&bus, 2000 * AMG8833_MS));
    OK(READ(&bus, 0x80, pixel));
    CHECK(word(pixel) == 8 * 4);
    OK(set_register(&bus, 0x01, 0x3F));
    OK(amg8833_advance_ns(&bus, 200 * AMG8833_MS));
    OK(READ(&bus, 0x80, pixel));
    CHECK(word(pixel) <= 1 * 4);
  }
}

static void faults(void) {
  amg8833_bus bus;
  uint8_t bytes[4], level[1];
  uint64_t count, before, after;
  OK(amg8833_init(&bus, sizeof bus, 0));
  OK(amg8833_plug_celsius(&bus, 0x69, 20, 25));
  OK(set_register(&bus, 0x08, 0x78));
  amg8833_fault fault = amg8833_fault_of(AMG8833_FAULT_NACK_BYTE);
  fault.byte = 1;
  OK(amg8833_set_fault(&bus, 0x69, &fault));
  CHECK_IS(AMG8833_NACK_BYTE, set_register(&bus, 0x08, 0x55));
  OK(amg8833_start(&bus, 0x69, 0));
  OK(amg8833_send(&bus, 0x08));
  CHECK_IS(AMG8833_NACK_BYTE, amg8833_send(&bus, 0x55));
  OK(amg8833_stop(&bus));
  OK(amg8833_fault_count(&bus, AMG8833_FAULT_NACK_BYTE, &count));
  CHECK(count == 2);
  OK(amg8833_clear_faults(&bus, 0x69));
  OK(READ(&bus, 0x08, level));
  CHECK(level[0] == 0x78);

  static const struct {
    amg8833_fault_kind kind;
    amg8833_error error;
  } ERRORS[] = {
      {AMG8833_FAULT_NACK_ADDRESS, AMG8833_NACK_ADDRESS}, {AMG8833_FAULT_BUS_ERROR, AMG8833_BUS},
      {AMG8833_FAULT_ARBITRATION_LOSS, AMG8833_ARBITRATION_LOST}, {AMG8833_FAULT_TIMEOUT, AMG8833_TIMEOUT},
      {AMG8833_FAULT_HANG, AMG8833_TIMEOUT}, {AMG8833_FAULT_UNPLUGGED, AMG8833_NACK_ADDRESS},
      {AMG8833_FAULT_ADAPTER_GONE, AMG8833_GONE}};
  for (size_t at = 0; at < COUNT(ERRORS); at++) {
    fault = amg8833_fault_of(ERRORS[at].kind);
    OK(amg8833_set_fault(&bus, 0x69, &fault));
    OK(amg8833_now_ns(&bus, &before));
    CHECK_IS(ERRORS[at].error, READ(&bus, 0x80, bytes));
    OK(amg8833_now_ns(&bus, &after));
    /* As Linux has it, a held bus is waited for a second. */
    CHECK(after - before == (ERRORS[at].error == AMG8833_TIMEOUT ? 1000 * AMG8833_MS : 0));
    CHECK_IS(ERRORS[at].error, amg8833_start(&bus, 0x69, 1));
    CHECK_IS(ERRORS[at].error == AMG8833_NACK_ADDRESS ? AMG8833_OK : AMG8833_NOT_OPEN, amg8833_stop(&bus));
    OK(amg8833_clear_faults(&bus, 0x69));
  }

  OK(amg8833_advance_ns(&bus, 1000 * AMG8833_MS));
  fault = amg8833_fault_of(AMG8833_FAULT_STUCK_HIGH);
  OK(amg8833_set_fault(&bus, 0x69, &fault));
  OK(READ(&bus, 0x80, bytes));
  CHECK(word(bytes) == 0xFFFF);
  OK(amg8833_clear_faults(&bus, 0));
  OK(amg8833_clear_faults(&bus, 0x69));
  fault = amg8833_fault_of(AMG8833_FAULT_PIXEL_GLITCH);
  fault.pixel = 1;
  fault.value = 0xFFF;
  OK(amg8833_set_fault(&bus, 0x69, &fault));
  fault = amg8833_fault_of(AMG8833_FAULT_BROWN_OUT);
  OK(amg8833_set_fault(&bus, 0x69, &fault));
  OK(amg8833_advance_ns(&bus, 100 * AMG8833_MS));
  OK(READ(&bus, 0x80, bytes));
  CHECK(word(bytes) == 80 && word(&bytes[2]) == 0xFFF);
  OK(READ(&bus, 0x08, level));
  CHECK(level[0] == 0);

  fault = amg8833_fault_of(AMG8833_FAULT_ALL_ZERO);
  fault.chance = 0.5;
  OK(amg8833_set_seed(&bus, 7));
  OK(amg8833_set_fault(&bus, 0x69, &fault));
  for (int at = 0; at < 1000; at++) OK(READ(&bus, 0x80, bytes));
  OK(amg8833_fault_count(&bus, AMG8833_FAULT_ALL_ZERO, &count));
  CHECK(count > 400 && count < 600);
}

int main(void) {
  words_of_the_datasheet();
  ways_to_read();
  byte_by_byte();
  refusals();
  interrupt();
  reset();
  faults();
  return failures > 0;
}

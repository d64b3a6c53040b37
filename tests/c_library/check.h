/* What the programs of this folder share: CHECK counts, and main() returns `failures`. */
#include <amg8833.h>
#include <stdio.h>
#include <string.h>

static int failures = 0;

#define CHECK(what)                                               \
  do {                                                            \
    if (!(what)) {                                                \
      printf("%s:%d: not so: %s\n", __FILE__, __LINE__, #what);   \
      failures++;                                                 \
    }                                                             \
  } while (0)

#define OK(call) CHECK_IS(AMG8833_OK, call)
#define CHECK_IS(expected, call)                                                              \
  do {                                                                                        \
    const amg8833_error found_ = (call);                                                      \
    if (found_ != (expected)) {                                                               \
      printf("%s:%d: %s: %s\n", __FILE__, __LINE__, #call, amg8833_error_text(found_));       \
      failures++;                                                                             \
    }                                                                                         \
  } while (0)

#define READ(bus, reg, bytes) read_registers(bus, reg, bytes, sizeof bytes)

static inline amg8833_error read_registers(amg8833_bus *bus, uint8_t reg, uint8_t *bytes, size_t count) {
  return amg8833_write_read(bus, 0x69, &reg, 1, bytes, count);
}

static inline amg8833_error set_register(amg8833_bus *bus, uint8_t reg, uint8_t value) {
  const uint8_t bytes[] = {reg, value};
  return amg8833_write(bus, 0x69, bytes, sizeof bytes);
}

/* As much of Zephyr's headers (3.7) as crates/amg8833-c/zephyr/amg8833_emul.c uses, with one sensor in the device tree. */
#ifndef ZEPHYR_STUB_H
#define ZEPHYR_STUB_H
#include <stdint.h>

typedef int32_t q31_t;
struct device;
struct emul {
  const struct device *dev;
  const void *cfg;
  void *data;
  int (*init)(const struct emul *target, const struct device *parent);
  const void *bus_api;
  const void *backend_api;
};
struct i2c_msg {
  uint8_t *buf;
  uint32_t len;
  uint8_t flags;
};
enum { I2C_MSG_WRITE = 0, I2C_MSG_READ = 1, I2C_MSG_STOP = 2, I2C_MSG_RESTART = 4 };
struct i2c_emul_api {
  int (*transfer)(const struct emul *target, struct i2c_msg *msgs, int num_msgs, int addr);
};
enum { SENSOR_CHAN_AMBIENT_TEMP = 13, SENSOR_CHAN_HUMIDITY = 16 };
struct sensor_chan_spec {
  uint16_t chan_type;
  uint16_t chan_idx;
};
struct emul_sensor_driver_api {
  int (*set_channel)(const struct emul *target, struct sensor_chan_spec ch, const q31_t *value, int8_t shift);
};

/* 10 kHz. */
static int64_t ticks;
static inline int64_t k_uptime_ticks(void) { return ticks; }
static inline uint64_t k_ticks_to_ns_floor64(uint64_t t) { return t * 100000; }

#define DT_INST_REG_ADDR(n) 0x69
#define DT_INST_FOREACH_STATUS_OKAY(of) of(0)
#define EMUL_DT_INST_DEFINE(n, init_fn, data_ptr, cfg_ptr, i2c, backend) \
  const struct emul emul_##n = {0, cfg_ptr, data_ptr, init_fn, i2c, backend}
#endif

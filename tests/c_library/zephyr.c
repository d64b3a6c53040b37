/* The emulator for Zephyr, by the calls that Zephyr's I2C makes. Zephyr itself is not here: zephyr_stub.h. */
#include "zephyr_stub.h"

#include "amg8833_emul.c"
#include "check.h"

static int transfer(struct i2c_msg *msgs, int count, int address) {
  const struct i2c_emul_api *api = emul_0.bus_api;
  return api->transfer(&emul_0, msgs, count, address);
}

int main(void) {
  uint8_t reg = 0x80, pixels[128] = {0}, level[] = {0x08, 0x78}, got[2] = {0};
  const struct emul_sensor_driver_api *sensor = emul_0.backend_api;
  const struct sensor_chan_spec ambient = {SENSOR_CHAN_AMBIENT_TEMP, 0}, humidity = {SENSOR_CHAN_HUMIDITY, 0};
  /* -25 of 128 degrees. */
  const q31_t minus_25 = (q31_t)(-25.0 / 128 * 2147483648.0);
  CHECK(emul_0.init(&emul_0, NULL) == 0);
  CHECK(sensor->set_channel(&emul_0, humidity, &minus_25, 7) == -ENOTSUP);
  CHECK(sensor->set_channel(&emul_0, ambient, &minus_25, 7) == 0);
  ticks += 1000;
  /* i2c_burst_read(): AMG88 spec 4-11-11 prints -25 as 0xF9C. */
  struct i2c_msg burst[] = {{&reg, 1, I2C_MSG_WRITE}, {pixels, 128, I2C_MSG_RESTART | I2C_MSG_READ | I2C_MSG_STOP}};
  CHECK(transfer(burst, 2, 0x69) == 0);
  CHECK(pixels[0] == 0x9C && pixels[1] == 0x0F && pixels[126] == 0x9C && pixels[127] == 0x0F);
  /* i2c_burst_write(): the register and the value are two messages of one write. */
  struct i2c_msg split[] = {{&level[0], 1, I2C_MSG_WRITE}, {&level[1], 1, I2C_MSG_WRITE | I2C_MSG_STOP}};
  CHECK(transfer(split, 2, 0x69) == 0);
  reg = 0x08;
  struct i2c_msg read[] = {{&reg, 1, I2C_MSG_WRITE | I2C_MSG_STOP}, {got, 1, I2C_MSG_READ | I2C_MSG_STOP}};
  CHECK(transfer(read, 2, 0x69) == 0 && got[0] == 0x78);
  const amg8833_fault wire = amg8833_fault_of(AMG8833_FAULT_NACK_ADDRESS);
  OK(amg8833_set_fault(amg8833_emul_bus(&emul_0), 0x69, &wire));
  CHECK(transfer(burst, 2, 0x69) == -EIO);
  OK(amg8833_clear_faults(amg8833_emul_bus(&emul_0), 0x69));
  CHECK(transfer(burst, 2, 0x69) == 0);
  return failures > 0;
}

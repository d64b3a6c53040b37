// Between ESPHome and grideye.h, for esphome.yaml. Never compiled for a board, and not tried on hardware.
#pragma once

#include <esp_random.h>
#include <esp_timer.h>
#include <sys/time.h>

#include <string>

#include "esphome/components/i2c/i2c_bus.h"
#include "grideye.h"

namespace grideye {

class EsphomeBus : public Bus {
 public:
  explicit EsphomeBus(esphome::i2c::I2CBus *bus) : bus_(bus) {}
  const char *write(uint8_t address, uint8_t reg, uint8_t value) override {
    const uint8_t bytes[] = {reg, value};
    return named(bus_->write_readv(address, bytes, sizeof bytes, nullptr, 0));
  }
  const char *read(uint8_t address, uint8_t reg, uint8_t *bytes, size_t count) override {
    return named(bus_->write_readv(address, &reg, 1, bytes, count));
  }

 private:
  static const char *named(esphome::i2c::ErrorCode code) {
    switch (code) {
      case esphome::i2c::ERROR_OK: return nullptr;
      case esphome::i2c::ERROR_NOT_ACKNOWLEDGED: return "nack";
      case esphome::i2c::ERROR_TIMEOUT: return "bus-timeout";
      default: return "bus-error";
    }
  }
  esphome::i2c::I2CBus *const bus_;
};

// One sensor, and the posts of its frames. ESPHome runs everything in one task.
class Esphome {
 public:
  Esphome(esphome::i2c::I2CBus *bus, const char *device, const char *sensor, uint8_t address)
      : bus_(bus), sensor_(sensor, address, ring_, sizeof ring_ / sizeof *ring_, &lock_), agent_(device, boot_, &sensors_, 1) {
    snprintf(boot_, sizeof boot_, "%08" PRIx32 "%08" PRIx32, esp_random(), esp_random());
  }
  void poll() { sensor_.poll(bus_, now()); }
  std::string post() { return std::string(body_, agent_.post(body_, sizeof body_, now())); }
  void handed_over() { agent_.handed_over(); }

 private:
  static Moment now() {
    timeval utc;
    gettimeofday(&utc, nullptr);
    // Before NTP has answered, the clock runs from 1970.
    return {uint64_t(esp_timer_get_time()) * 1000, int64_t(utc.tv_sec) * 1000000000 + int64_t(utc.tv_usec) * 1000, utc.tv_sec > 1600000000};
  }

  EsphomeBus bus_;
  Lock lock_;
  Frame ring_[200];
  Sensor sensor_;
  Sensor *sensors_ = &sensor_;
  char boot_[17];
  char body_[POST_BYTES_MAX + 20 * FRAME_BYTES_MAX];
  Agent agent_;
};

}  // namespace grideye

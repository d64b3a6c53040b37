// As esphome/components/i2c/i2c_bus.h of ESPHome 2026.6.5 declares it.
#pragma once
#include <cstddef>
#include <cstdint>

namespace esphome {
namespace i2c {

enum ErrorCode { NO_ERROR = 0, ERROR_OK = 0, ERROR_INVALID_ARGUMENT, ERROR_NOT_ACKNOWLEDGED, ERROR_TIMEOUT, ERROR_NOT_INITIALIZED, ERROR_TOO_LARGE, ERROR_UNKNOWN, ERROR_CRC };

class I2CBus {
 public:
  virtual ErrorCode write_readv(uint8_t address, const uint8_t *write_buffer, size_t write_count, uint8_t *read_buffer, size_t read_count) = 0;
};

}  // namespace i2c
}  // namespace esphome

// The AVR's `Wire` on an emulated or real bus of this host, as controller. Which bus it is:
//
//   g++ … amg8833_wire.cpp libamg8833_c.a    the emulated sensor in this process, on a bare bus as a microcontroller's
//   grideye emulate SOURCE -- PROGRAM        /dev/i2c-1, judged by the adapter that is emulated (`--adapter`)
//   ./PROGRAM                                a real /dev/i2c-1
//
// At /dev/i2c-N, `Wire` is bus 1 and `Wire1` bus 2. GRIDEYE_I2C_BUS names another first number. Where there is no bus, begin()
// and the first transfer end the program with code 3 and a hint.
//
// As on the AVR: a transmission longer than the buffer is cut and sent, a request for more than the buffer reads what
// fits, and neither is an error. Compile every file with -DBUFFER_LENGTH=128 for the buffer of an ESP32, or up to 255.
//
// Different from the AVR:
//   - A line that is held low is code 5 after a second, with setWireTimeout() and without.
//   - At /dev/i2c-N, where a transfer is a whole: a held write is sent with what follows, and its result is 0, as on an
//     ESP32; a held read ends with a STOP all the same, so that an update may come between two parts of a frame.
#ifndef TwoWire_h
#define TwoWire_h

#include "Arduino.h"

#include <vector>

#ifndef BUFFER_LENGTH
#define BUFFER_LENGTH 32
#endif
#define WIRE_HAS_END 1
#define WIRE_HAS_TIMEOUT 1

// A bus in this process, with its time and the INT pins of its sensors.
class WireBus {
 public:
  static const int NO_LEVEL = -1;
  virtual ~WireBus() {}
  // A message after a START or repeated START; a STOP follows if asked for, and after whatever is not acknowledged. A read
  // fills `bytes`. Returns what endTransmission() does.
  virtual uint8_t transfer(uint8_t address, bool is_read, std::vector<uint8_t> &bytes, bool stop) = 0;
  // Lets time pass, at most so long, or until INT of the first sensor has this level. Returns the time since the start.
  virtual uint64_t pass_us(uint64_t most_us, int level) = 0;
  virtual std::vector<uint8_t> int_levels() = 0;
};

// The bus of `Wire` (0) or `Wire1` (1), where a file of the program defines it: amg8833_wire.cpp does.
WireBus *wire_bus(unsigned number) __attribute__((weak));

class TwoWire : public Stream {
 public:
  explicit TwoWire(unsigned after_the_first) : offset_(after_the_first) {}

  void begin();
  void begin(int /*sda*/, int /*scl*/, uint32_t /*hz*/ = 0) { begin(); }
  void end();
  void setClock(uint32_t /*hz*/) {}  // the emulated bus's is 100 kHz, or what `grideye emulate --scl` says
  void setWireTimeout(uint32_t /*us*/ = 25000, bool /*reset*/ = false) {}
  bool getWireTimeoutFlag() const { return timed_out_; }
  void clearWireTimeoutFlag() { timed_out_ = false; }

  void beginTransmission(uint8_t address);
  void beginTransmission(int address) { beginTransmission(uint8_t(address)); }

  // 0 done, 2 address not acknowledged, 3 byte not acknowledged, 4 another error, 5 timeout
  uint8_t endTransmission(uint8_t stop);
  uint8_t endTransmission() { return endTransmission(true); }

  // The number of bytes read: all that fit, or none.
  uint8_t requestFrom(uint8_t address, uint8_t quantity, uint32_t reg, uint8_t reg_bytes, uint8_t stop);
  uint8_t requestFrom(uint8_t address, uint8_t quantity, uint8_t stop);
  uint8_t requestFrom(uint8_t address, uint8_t quantity) { return requestFrom(address, quantity, uint8_t(true)); }
  uint8_t requestFrom(int address, int quantity) { return requestFrom(uint8_t(address), uint8_t(quantity)); }
  uint8_t requestFrom(int address, int quantity, int stop) {
    return requestFrom(uint8_t(address), uint8_t(quantity), uint8_t(stop));
  }

  size_t write(uint8_t byte) override;
  size_t write(const uint8_t *bytes, size_t length) override;  // always `length`, even if it did not fit
  size_t write(int n) { return write(uint8_t(n)); }
  size_t write(unsigned n) { return write(uint8_t(n)); }
  size_t write(long n) { return write(uint8_t(n)); }
  size_t write(unsigned long n) { return write(uint8_t(n)); }
  using Print::write;

  int available() override { return int(received_.size() - taken_); }
  int read() override { return available() ? received_[taken_++] : -1; }
  int peek() override { return available() ? received_[taken_] : -1; }

 private:
  struct Message {
    uint16_t address;
    bool is_read;
    std::vector<uint8_t> bytes;  // to write, or as many as to read
  };

  uint8_t carry_out(Message message, bool stop);
  uint8_t carry_out_by_device(const Message &message, bool stop);
  void open_device();

  unsigned offset_;
  unsigned number_ = 0;
  WireBus *bus_ = nullptr;
  int file_ = -1;
  bool transmitting_ = false;
  bool timed_out_ = false;
  Message transmission_;
  std::vector<Message> held_;  // by a device, since the last STOP
  std::vector<uint8_t> received_;
  size_t taken_ = 0;
};

extern TwoWire Wire;
extern TwoWire Wire1;

#endif

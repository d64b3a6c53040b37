// Arduino's core on the computer that compiles it: an unmodified sketch or library becomes a program of this host, whose
// `Wire` is an emulated or real I2C bus. C++11, three files, nothing to install:
//
//   g++ -std=c++11 -fpermissive -DARDUINO=10819 -I CORE -I LIBRARY -include Arduino.h -x c++ SKETCH.ino
//     -x none LIBRARY/*.cpp CORE/arduino.cpp -o sketch
//   grideye emulate --constant -5 -- ./sketch
//
// With crates/amg8833-c/arduino/amg8833_wire.cpp and libamg8833_c.a in the same command, the sensor is in the program itself:
//
//   GRIDEYE_CELSIUS=-5 ./sketch
//
// A unit test has its own main() in place of setup() and loop(), and exits with its result. A sketch runs until it is
// ended: by exit(), by `timeout 5 ./sketch`, or by a reader that has read enough (`./sketch | grep -m 1 "pixel 1: -5.00"`).
//
// What differs from an AVR:
//   - `int` has 32 bits, as on ESP32 and RP2040, and `long` and `double` have 64. Code that relies on 16 bits, such as
//     `value |= 0xF000` for a sign, is right on one side alone: run the firmware itself, too.
//   - With the emulated sensor in this process (amg8833_wire.cpp, below), time is the sensor's: delay() lets it pass at once,
//     so that a test of an hour takes no hour. Otherwise time is real.
//   - Only the sensor's INT has a wire, and only in this process: to pin 2, or to the pins that GRIDEYE_INT_PINS names, one a
//     sensor ("2,3"). An interrupt's handler is called in delay() and after loop(). Other inputs read HIGH with a pull-up.
//   - Only what is declared here exists. A sketch that needs more does not compile.
#ifndef Arduino_h
#define Arduino_h

#ifndef ARDUINO
#define ARDUINO 10819
#endif

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <string>
#include <type_traits>

typedef bool boolean;
typedef uint8_t byte;
typedef uint16_t word;

// The sketch's, unless there is a main().
void setup();
void loop();

// --- numbers -------------------------------------------------------------------------------------------------------

#define PI 3.1415926535897932384626433832795
#define DEG_TO_RAD 0.017453292519943295769236907684886
#define RAD_TO_DEG 57.295779513082320876798154814105

#define constrain(value, low, high) ((value) < (low) ? (low) : ((value) > (high) ? (high) : (value)))
#define radians(deg) ((deg) * DEG_TO_RAD)
#define degrees(rad) ((rad) * RAD_TO_DEG)
#define sq(x) ((x) * (x))
#define bit(b) (1UL << (b))
#define bitRead(value, b) (((value) >> (b)) & 1)
#define bitSet(value, b) ((value) |= bit(b))
#define bitClear(value, b) ((value) &= ~bit(b))
#define bitWrite(value, b, on) ((on) ? bitSet(value, b) : bitClear(value, b))
#define lowByte(w) ((uint8_t)((w) & 0xFF))
#define highByte(w) ((uint8_t)((w) >> 8))
#define word(high, low) ((uint16_t)((uint8_t)(high) << 8 | (uint8_t)(low)))

// Functions, not macros, so that the headers of C++ may follow this one.
template <class A, class B> typename std::common_type<A, B>::type min(A a, B b) { return a < b ? a : b; }
template <class A, class B> typename std::common_type<A, B>::type max(A a, B b) { return a > b ? a : b; }
inline long map(long x, long from_low, long from_high, long to_low, long to_high) {
  return (x - from_low) * (to_high - to_low) / (from_high - from_low) + to_low;
}

// --- constants in flash, which are in memory here ------------------------------------------------------------------

#define PROGMEM
#define PGM_P const char *
#define PSTR(text) (text)
#define pgm_read_byte(at) (*(const uint8_t *)(at))
#define pgm_read_word(at) (*(const uint16_t *)(at))
#define pgm_read_dword(at) (*(const uint32_t *)(at))
#define pgm_read_float(at) (*(const float *)(at))
#define memcpy_P memcpy
#define strcpy_P strcpy
#define strlen_P strlen

class __FlashStringHelper;
#define F(text) (reinterpret_cast<const __FlashStringHelper *>(text))

// --- time, from the start of the program ---------------------------------------------------------------------------

unsigned long millis();  // wraps after 49.7 days
unsigned long micros();  // wraps after 71.6 minutes
void delay(unsigned long ms);
void delayMicroseconds(unsigned int us);
inline void yield() {}

// --- pins ----------------------------------------------------------------------------------------------------------

#define LOW 0
#define HIGH 1
#define INPUT 0
#define OUTPUT 1
#define INPUT_PULLUP 2
#define CHANGE 1
#define FALLING 2
#define RISING 3
enum : uint8_t { LED_BUILTIN = 13, A0 = 14, A1, A2, A3, SDA, SCL };

void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t level);
int digitalRead(uint8_t pin);

// Numbers as on an Uno: interrupt 0 is pin 2 and 1 is pin 3; others are their pin. Without the sensor in this process
// no interrupt comes, which is said on standard error.
void attachInterrupt(uint8_t interrupt, void (*handler)(), int mode);
void detachInterrupt(uint8_t interrupt);
inline void interrupts() {}
inline void noInterrupts() {}
#define digitalPinToInterrupt(pin) ((pin) == 2 ? 0 : (pin) == 3 ? 1 : (pin))

// --- text ----------------------------------------------------------------------------------------------------------

#define DEC 10
#define HEX 16
#define OCT 8
#define BIN 2

class String {
 public:
  String(const char *text = "") : text_(text ? text : "") {}
  String(const __FlashStringHelper *text) : String(reinterpret_cast<const char *>(text)) {}
  explicit String(char c) : text_(1, c) {}
  explicit String(int n) : text_(std::to_string(n)) {}
  explicit String(unsigned n) : text_(std::to_string(n)) {}
  explicit String(long n) : text_(std::to_string(n)) {}
  explicit String(unsigned long n) : text_(std::to_string(n)) {}
  explicit String(double n, unsigned char digits = 2);

  const char *c_str() const { return text_.c_str(); }
  unsigned length() const { return text_.size(); }
  char operator[](unsigned at) const { return at < text_.size() ? text_[at] : 0; }
  int indexOf(char c, unsigned from = 0) const { return found(text_.find(c, from)); }
  int indexOf(const String &s, unsigned from = 0) const { return found(text_.find(s.text_, from)); }
  String substring(unsigned from, unsigned to = ~0U) const;
  void trim();
  long toInt() const { return atol(c_str()); }
  float toFloat() const { return atof(c_str()); }
  bool startsWith(const String &s) const { return text_.compare(0, s.text_.size(), s.text_) == 0; }
  bool operator==(const String &s) const { return text_ == s.text_; }
  bool operator!=(const String &s) const { return text_ != s.text_; }
  String &operator+=(const String &s) { return text_ += s.text_, *this; }
  String &operator+=(char c) { return text_ += c, *this; }
  template <class Number> String &operator+=(Number n) { return *this += String(n); }
  template <class Any> friend String operator+(String left, const Any &right) { return left += right; }

 private:
  static int found(size_t at) { return at == std::string::npos ? -1 : int(at); }
  std::string text_;
};

class Print;

class Printable {
 public:
  virtual ~Printable() {}
  virtual size_t printTo(Print &) const = 0;
};

class Print {
 public:
  virtual ~Print() {}
  virtual size_t write(uint8_t) = 0;
  virtual size_t write(const uint8_t *bytes, size_t length);
  size_t write(const char *text) { return text ? write((const uint8_t *)text, strlen(text)) : 0; }
  size_t write(const char *bytes, size_t length) { return write((const uint8_t *)bytes, length); }
  virtual void flush() {}
  int getWriteError() const { return write_error_; }
  void clearWriteError() { write_error_ = 0; }

  size_t print(const char *text) { return write(text); }
  size_t print(const __FlashStringHelper *text) { return write((const char *)text); }
  size_t print(const String &text) { return write(text.c_str()); }
  size_t print(char c) { return write(uint8_t(c)); }
  size_t print(unsigned char n, int base = DEC) { return print((unsigned long)n, base); }
  size_t print(int n, int base = DEC) { return print((long)n, base); }
  size_t print(unsigned n, int base = DEC) { return print((unsigned long)n, base); }
  size_t print(long n, int base = DEC);  // below zero in a base other than 10: of 32 bits
  size_t print(unsigned long n, int base = DEC);
  size_t print(double n, int digits = 2);
  size_t print(const Printable &what) { return what.printTo(*this); }

  size_t println() { return write("\r\n"); }
  size_t println(const Printable &what) { return add(print(what)); }
  template <class T> size_t println(T what) { return add(print(what)); }
  template <class T> size_t println(T what, int format) { return add(print(what, format)); }

 protected:
  void setWriteError(int error = 1) { write_error_ = error; }

 private:
  size_t add(size_t before) { return before + println(); }
  int write_error_ = 0;
};

class Stream : public Print {
 public:
  virtual int available() = 0;
  virtual int read() = 0;
  virtual int peek() = 0;
  void setTimeout(unsigned long ms) { timeout_ms_ = ms; }
  size_t readBytes(uint8_t *bytes, size_t length);
  size_t readBytes(char *bytes, size_t length) { return readBytes((uint8_t *)bytes, length); }
  String readStringUntil(char end);

 private:
  int timed_read();
  unsigned long timeout_ms_ = 1000;
};

// Standard input and output. Output appears by lines, and before each delay().
class HardwareSerial : public Stream {
 public:
  void begin(unsigned long, uint8_t = 0) {}
  void end() { flush(); }
  int available() override;
  int read() override;
  int peek() override;
  void flush() override { fflush(stdout); }
  using Print::write;
  size_t write(uint8_t c) override { return putchar(c) == EOF ? 0 : 1; }
  operator bool() const { return true; }

 private:
  int next_ = -1;
};

extern HardwareSerial Serial;

#endif

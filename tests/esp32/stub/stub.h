// What esp32.ino and esphome.h use of the ESP32's libraries, declared: compiling against it finds slips, and no more.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>

using String = std::string;

struct TwoWire {
  void setBufferSize(size_t);
  void begin(int, int, uint32_t);
  void beginTransmission(uint8_t);
  size_t write(uint8_t);
  uint8_t endTransmission(bool = true);
  size_t requestFrom(uint8_t, size_t);
  size_t readBytes(uint8_t *, size_t);
};
extern TwoWire Wire;

struct HardwareSerial {
  void begin(unsigned long);
  void println(const char *);
  int printf(const char *, ...) __attribute__((format(printf, 2, 3)));
};
extern HardwareSerial Serial;

enum { WIFI_STA, WL_CONNECTED, OUTPUT, LOW, HIGH };
struct WiFiClass {
  void mode(int);
  void setAutoReconnect(bool);
  void begin(const char *, const char *);
  int status();
};
extern WiFiClass WiFi;

struct WiFiClient {
  virtual ~WiFiClient();
};
struct WiFiClientSecure : WiFiClient {
  void setCACert(const char *);
};
struct HTTPClient {
  void setReuse(bool);
  void setConnectTimeout(int32_t);
  void setTimeout(uint16_t);
  bool begin(WiFiClient &, String);
  void addHeader(const String &, const String &);
  int POST(uint8_t *, size_t);
  String getString();
  void end();
};

typedef void *SemaphoreHandle_t;
enum : uint32_t { portMAX_DELAY = 0xFFFFFFFF };
SemaphoreHandle_t xSemaphoreCreateMutex();
int xSemaphoreTake(SemaphoreHandle_t, uint32_t);
int xSemaphoreGive(SemaphoreHandle_t);
void vTaskDelay(uint32_t);
uint32_t pdMS_TO_TICKS(uint32_t);
int xTaskCreatePinnedToCore(void (*)(void *), const char *, uint32_t, void *, unsigned, void *, int);

int64_t esp_timer_get_time();
uint32_t esp_random();
void configTime(long, int, const char *);
void delay(uint32_t);
uint32_t millis();
void pinMode(int, int);
void digitalWrite(int, int);

// An ESP32 that reads one or two AMG8833 and posts to the collector. Not tried on hardware: only grideye.h was, on a PC.
//
// One task reads the sensors, the other posts, so that a slow network delays no frame. Put what `grideye enroll DEVICE --esp32`
// prints into collector.h, and the network's name and password below.

#include <HTTPClient.h>
#include <WiFi.h>
#include <WiFiClientSecure.h>
#include <Wire.h>
#include <esp_random.h>
#include <esp_timer.h>
#include <sys/time.h>

#include "collector.h"
#include "grideye.h"

const char *const WIFI_NAME = "your network";
const char *const WIFI_PASSWORD = "its password";

// Of each sensor: 600 frames are a minute, and take 101 kB.
const size_t RING_FRAMES = 600;
const int SDA_PIN = 21, SCL_PIN = 22;
const int LED_PIN = 2;

class WireBus : public grideye::Bus {
 public:
  const char *write(uint8_t address, uint8_t reg, uint8_t value) override {
    Wire.beginTransmission(address);
    Wire.write(reg);
    Wire.write(value);
    return named(Wire.endTransmission());
  }

  const char *read(uint8_t address, uint8_t reg, uint8_t *bytes, size_t count) override {
    Wire.beginTransmission(address);
    Wire.write(reg);
    if (const char *fault = named(Wire.endTransmission(false))) return fault;
    // All at once: only then does no frame mix with the next one.
    if (Wire.requestFrom(address, count) != count) return "short-transfer";
    return Wire.readBytes(bytes, count) == count ? nullptr : "short-transfer";
  }

 private:
  static const char *named(uint8_t ended) {
    switch (ended) {
      case 0: return nullptr;
      case 2:
      case 3: return "nack";
      case 5: return "bus-timeout";
      default: return "bus-error";
    }
  }
};

class Mutex : public grideye::Lock {
 public:
  void take() override { xSemaphoreTake(handle_, portMAX_DELAY); }
  void give() override { xSemaphoreGive(handle_); }

 private:
  SemaphoreHandle_t handle_ = xSemaphoreCreateMutex();
};

// The clock counts as set once NTP has answered: before, it runs from 1970.
const int64_t SET_AFTER_S = 1600000000;

grideye::Moment now() {
  timeval utc;
  gettimeofday(&utc, nullptr);
  grideye::Moment moment;
  moment.boot_ns = uint64_t(esp_timer_get_time()) * 1000;
  moment.utc_ns = int64_t(utc.tv_sec) * 1000000000 + int64_t(utc.tv_usec) * 1000;
  moment.is_synced = utc.tv_sec > SET_AFTER_S;
  return moment;
}

WireBus bus;
Mutex mutexes[2];
char boot_name[17];
char body[grideye::POST_BYTES_MAX + 40 * grideye::FRAME_BYTES_MAX];
grideye::Sensor *sensors[2];
size_t sensor_count = 0;
grideye::Agent *agent = nullptr;
WiFiClientSecure tls;
WiFiClient plain;
HTTPClient http;

void read_sensors(void *) {
  for (;;) {
    for (size_t at = 0; at < sensor_count; at++) sensors[at]->poll(bus, now());
    vTaskDelay(pdMS_TO_TICKS(5));
  }
}

// A sensor that is there acknowledges its address.
void add_sensor(const char *name, uint8_t address) {
  Wire.beginTransmission(address);
  if (Wire.endTransmission() != 0) return;
  grideye::Frame *ring = new grideye::Frame[RING_FRAMES];
  sensors[sensor_count] = new grideye::Sensor(name, address, ring, RING_FRAMES, &mutexes[sensor_count]);
  sensor_count++;
}

void setup() {
  Serial.begin(115200);
  pinMode(LED_PIN, OUTPUT);
  Wire.setBufferSize(grideye::BUS_BUFFER_BYTES);
  Wire.begin(SDA_PIN, SCL_PIN, 400000);
  delay(50);
  while (sensor_count == 0) {
    add_sensor("0x69", 0x69);
    add_sensor("0x68", 0x68);
    if (sensor_count > 0) break;
    Serial.println("no AMG8833 answers at 0x69 or 0x68: are SDA, SCL, 3.3 V and GND connected?");
    delay(2000);
  }
  WiFi.mode(WIFI_STA);
  WiFi.setAutoReconnect(true);
  WiFi.begin(WIFI_NAME, WIFI_PASSWORD);
  configTime(0, 0, "pool.ntp.org");
  snprintf(boot_name, sizeof boot_name, "%08" PRIx32 "%08" PRIx32, esp_random(), esp_random());
  tls.setCACert(COLLECTOR_AUTHORITY);
  http.setReuse(true);
  http.setConnectTimeout(5000);
  http.setTimeout(10000);
  agent = new grideye::Agent(COLLECTOR_DEVICE, boot_name, sensors, sensor_count);
  xTaskCreatePinnedToCore(read_sensors, "sensors", 8192, nullptr, 5, nullptr, 1);
}

int post(size_t length, String *answer) {
  if (WiFi.status() != WL_CONNECTED) return 0;
  const bool is_encrypted = strncmp(COLLECTOR_URL, "https:", 6) == 0;
  if (!http.begin(is_encrypted ? tls : plain, COLLECTOR_URL "/v1/frames")) return 0;
  http.addHeader("Content-Type", "application/json");
  http.addHeader("Authorization", "Bearer " COLLECTOR_TOKEN);
  const int status = http.POST(reinterpret_cast<uint8_t *>(body), length);
  *answer = status > 0 ? http.getString() : String();
  http.end();
  return status;
}

// Steady while the collector takes frames; blinks otherwise.
void show(int status, const String &answer) {
  static uint32_t said_ms = 0;
  static bool is_lit = false;
  is_lit = status == 200 || !is_lit;
  digitalWrite(LED_PIN, is_lit ? HIGH : LOW);
  if (status == 200 && millis() - said_ms < 10000) return;
  said_ms = millis();
  Serial.printf("post: %d %s\n", status, status == 200 ? "" : answer.c_str());
  for (size_t at = 0; at < sensor_count; at++) {
    const grideye::Sensor &sensor = *sensors[at];
    Serial.printf("%s: read %" PRIu64 ", missing %" PRIu64 ", dropped %" PRIu64 ", kept %" PRIu64 "%s%s\n", sensor.name(), sensor.read(), sensor.missing(), sensor.dropped(), sensor.kept(), sensor.fault() ? ", last fault " : "", sensor.fault() ? sensor.fault() : "");
  }
}

void loop() {
  String answer;
  const size_t length = agent->post(body, sizeof body, now());
  const int status = post(length, &answer);
  show(status, answer);
  delay(agent->answered(status, answer.c_str()));
}

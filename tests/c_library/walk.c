/* A person walks under the sensor, along a trajectory in memory. */
#include "check.h"

static const char SCENE[] =
    "[room]\n"
    "size_mm = [4000, 6000, 2700]\n"
    "ambient_c = 20\n"
    "[[agent]]\n"
    "name = \"person\"\n"
    "size_mm = [200, 500, 1750]\n"
    "temperature_c = 31\n"
    "trajectory = \"walk.csv\"\n"
    "speed_mm_per_s = 800\n"
    "[[sensor]]\n"
    "name = \"ceiling\"\n"
    "preset = \"grid-eye\"\n"
    "position_mm = [2000, 3000, 2700]\n"
    "elevation_deg = 90\n"
    "azimuth_deg = -90\n";

static int warmest(amg8833_bus *bus) {
  uint8_t pixels[128];
  int most = -2048;
  OK(READ(bus, 0x80, pixels));
  for (int at = 0; at < 128; at += 2) {
    const int word = pixels[at] | (pixels[at + 1] & 0x0F) << 8;
    const int steps = word < 0x800 ? word : word - 0x1000;
    if (steps > most) most = steps;
  }
  return most;
}

int main(void) {
  amg8833_bus bus;
  char message[160] = "";
  const amg8833_file walk = {"walk.csv", "x_mm,y_mm,z_mm\n300,3000,0\n3700,3000,0\n"};
  amg8833_scene scene = {SCENE, &walk, 1, NULL, 1};
  OK(amg8833_init(&bus, sizeof bus, 0));
  CHECK_IS(AMG8833_OK, amg8833_plug_scene(&bus, 0x69, &scene, message, sizeof message));
  OK(amg8833_advance_ns(&bus, 100 * AMG8833_MS));
  CHECK(warmest(&bus) < 4 * 23);
  /* 1.7 m at 0.8 m/s. */
  OK(amg8833_advance_ns(&bus, 2125 * AMG8833_MS));
  CHECK(warmest(&bus) > 4 * 24);
  /* A reset begins the walk again. */
  OK(set_register(&bus, 0x01, 0x3F));
  OK(amg8833_advance_ns(&bus, 200 * AMG8833_MS));
  CHECK(warmest(&bus) > 4 * 18 && warmest(&bus) < 4 * 23);

  scene.file_count = 0;
  CHECK_IS(AMG8833_SCENE, amg8833_plug_scene(&bus, 0x68, &scene, message, sizeof message));
  CHECK(strstr(message, "walk.csv") && strlen(message) < sizeof message);
  char shortened[5];
  CHECK_IS(AMG8833_SCENE, amg8833_plug_scene(&bus, 0x68, &scene, shortened, sizeof shortened));
  CHECK(strlen(shortened) == 4);
  scene.file_count = 1;
  scene.sensor = "door";
  CHECK_IS(AMG8833_SCENE, amg8833_plug_scene(&bus, 0x68, &scene, message, sizeof message));
  CHECK(strstr(message, "door"));
  scene.sensor = "ceiling";
  OK(amg8833_plug_scene(&bus, 0x68, &scene, message, sizeof message));
  /* Its scenes are free, and the sanitizer says so. */
  OK(amg8833_end(&bus));
  return failures > 0;
}

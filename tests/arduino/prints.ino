// Prints of every kind; prints.txt is what an ATmega328P printed.
static const double NUMBERS[] = {0,    -0.0, 0.005, 0.015, -0.125, 0.125, 25.0625, -20.0625,   0.0625,  99.995, 1019,
                                 -507, -4.75, 1e9,  5e9,   -5e9,   21.5,  0.999,   -0.004,     3.14159265, 37.1875, 0.25};

void setup() {
  Serial.begin(115200);
  for (double number : NUMBERS) {
    for (int digits = 0; digits < 5; digits++) {
      Serial.print(number, digits);
      Serial.print(digits < 4 ? ' ' : '\n');
    }
  }
  Serial.println(NAN);
  Serial.println(INFINITY);
  Serial.println(-INFINITY);
  Serial.println(-1, HEX);
  Serial.println(-1);
  Serial.println(255, BIN);
  Serial.println(-2147483647L - 1);
  Serial.println(4294967295UL);
  Serial.println(0, HEX);
  Serial.println((int8_t)-5);
  Serial.println((uint8_t)200);
  Serial.println('x');
  Serial.println(F("flash"));
  Serial.println(String(-1.125));
  Serial.println(String(0.125, 2));
  Serial.println(String("a") + 1 + 'b' + 2.5 + F("c"));
  Serial.println(String("hello").substring(1, 3));
  Serial.println(String("hello").indexOf('l'));
  Serial.println(String("-12.5x").toFloat());
  Serial.println(map(5, 0, 10, 0, 100));
  Serial.println(constrain(5, 6, 7));
  Serial.println(min(3, 2));
  Serial.println(word(1, 2));
  Serial.println(Serial.print("ab"));
  Serial.println("end");
  Serial.flush();
  exit(0);
}

void loop() {}

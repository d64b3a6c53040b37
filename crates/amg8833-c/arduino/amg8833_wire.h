// The emulated sensor as the bus of `Wire`, in this process: amg8833_wire.cpp and libamg8833_c.a in the command that compiles a
// sketch or a test with the core for this host (crates/i2c-emulation/arduino).
#pragma once

#include <Wire.h>
#include <amg8833.h>

// The bus of Wire (0) or Wire1 (1), of 100 kHz. The first has a sensor at 0x69 that sees GRIDEYE_CELSIUS degrees (21.5 without
// it), and whose thermistor is 4.5 degrees warmer; a test plugs in what it needs, before setup() in a constructor of its own.
// All buses have one time: amg8833_advance_ns() of one is the time of each at its next transfer.
amg8833_bus *amg8833_wire(unsigned number);

// The same as what the core asks for by wire_bus(), for a test that looks at what goes through.
WireBus *amg8833_wire_bus(unsigned number);

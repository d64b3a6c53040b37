"""How many frames a second of the processor a Python program reads from the emulated sensor of its own process.

    python crates/grideye-python/benches/frames.py [SCENE]
"""

import sys
import time

import grideye_hil as ge

SECONDS = 1.0


def rate(bus, advance_s):
    frame = bytearray(128)
    reads, started = 0, time.process_time()
    while time.process_time() - started < SECONDS:
        for _ in range(100):
            if advance_s:
                bus.advance(advance_s)
            bus.writeto_then_readfrom(0x69, b"\x80", frame)
        reads += 100
    return reads / (time.process_time() - started)


source = ge.Scene.load(sys.argv[1]) if len(sys.argv) > 1 else 22.0
with ge.emulate(source) as bus:
    print(f"{rate(bus, 0):.0f} frame reads a second of the processor")
    print(f"{rate(bus, 0.1):.0f} with a new frame for each")

"""What the drivers' programs share: where the bus is, and how the answer is printed.

With GRIDEYE_SOCKET set, the bus is the emulator's socket behind this project's one-file client; otherwise it is
/dev/i2c-1, opened by whatever library the driver brings.
"""

import json
import os
import sys
import time

socket_path = os.environ.get("GRIDEYE_SOCKET")

if socket_path:
    here = os.path.dirname(os.path.abspath(__file__))
    sys.path.insert(0, os.path.join(here, "../../crates/i2c-emulation/python"))


def smbus():
    """An open SMBus of bus 1, as smbus2 has it."""
    if socket_path:
        import grideye_i2c

        return grideye_i2c.SMBus(1)
    from smbus2 import SMBus

    return SMBus(1)


def answer(**values):
    """Prints what was found; the Rust test reads this line."""
    print(json.dumps(values))


def watch(look, seconds, pause=0.1):
    """What `look` sees, again and again for so many seconds."""
    seen = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        seen.append(look())
        time.sleep(pause)
    return seen

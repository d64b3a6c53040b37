"""melopero_amg8833. Arguments: frame | walk SECONDS | interrupts HIGH LOW HYSTERESIS | modes."""

import sys
import time

import bus
from melopero_amg8833 import AMGGridEye

sensor = AMGGridEye(0x69, 1)


def frame():
    sensor.update_pixel_temperature_matrix()
    # The driver hands out the one list that it keeps changing.
    return [list(row) for row in sensor.get_pixel_temperature_matrix()]


def interrupts(high, low, hysteresis):
    sensor.set_interrupt_thresholds(low, high, hysteresis)
    sensor.enable_interrupt(True, AMGGridEye.INTERRUPT_ABSOLUTE_VALUE_MODE)
    time.sleep(0.25)
    sensor.update_interrupt_table()
    table = [list(row) for row in sensor.get_interrupt_table()]
    tripped = sensor.get_status()["Interrupt"]
    sensor.set_interrupt_thresholds(low, 100, hysteresis)
    sensor.reset_flags()
    time.sleep(0.25)
    bus.answer(tripped=tripped, table=table, cleared=not sensor.get_status()["Interrupt"])


def modes():
    sensor.set_fps_mode(AMGGridEye.FPS_1_MODE)
    fps = [sensor.get_fps()]
    sensor.set_fps_mode(AMGGridEye.FPS_10_MODE)
    fps.append(sensor.get_fps())
    sensor.set_mode(AMGGridEye.SLEEP_MODE)
    asleep = frame()
    time.sleep(0.15)
    sensor.set_mode(AMGGridEye.NORMAL_MODE)
    time.sleep(0.05)
    sensor.reset_flags_and_settings()
    time.sleep(0.002)
    sensor.reset_flags()
    time.sleep(0.25)
    bus.answer(fps=fps, asleep=asleep, awake=frame())


if sys.argv[1] == "walk":
    bus.answer(frames=bus.watch(frame, float(sys.argv[2])))
elif sys.argv[1] == "interrupts":
    interrupts(*map(float, sys.argv[2:5]))
elif sys.argv[1] == "modes":
    modes()
else:
    bus.answer(thermistor=sensor.get_thermistor_temperature(), frame=frame())

#!/usr/bin/env python3
"""Stands in for the control's user interface: switches it on, runs $NGC to its end, leaves."""
import os
import sys
import time

import linuxcnc

command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()


samples = []


def until(reached, seconds):
    end = time.time() + seconds
    while time.time() < end:
        status.poll()
        samples.append((status.motion_line,) + tuple(status.actual_position[:4]) + (status.tool_offset[2],))
        message = errors.poll()
        if message:
            print("control:", message, flush=True)
        if reached():
            return
        time.sleep(0.002)
    sys.exit("the control did not follow in %d s" % seconds)


def switched_on():
    # The first order to leave the emergency stop may be lost.
    if status.estop:
        command.state(linuxcnc.STATE_ESTOP_RESET)
    elif not status.enabled:
        command.state(linuxcnc.STATE_ON)
    return status.enabled and not status.estop


until(switched_on, 30)
command.mode(linuxcnc.MODE_AUTO)
command.wait_complete()
command.program_open(os.environ["NGC"])
command.wait_complete()
command.auto(linuxcnc.AUTO_RUN, 0)
until(lambda: status.interp_state != linuxcnc.INTERP_IDLE, 10)
until(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos and status.queue == 0, 90)
with open("trace.txt", "w") as trace:
    for sample in samples:
        trace.write("%d %.6f %.6f %.6f %.6f %.6f\n" % sample)
print("done ok", flush=True)

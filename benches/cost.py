"""What a command costs, as a process of its own."""

import os
import subprocess
import sys


def measured(command):
    """CPU seconds (user and system, all threads), peak resident MiB and output of a command."""
    process = subprocess.Popen(command, stdout=subprocess.PIPE)
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        sys.exit(f"{' '.join(map(str, command))}: exit status {status}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, output


def least(command, runs=3):
    """Least CPU seconds and least peak MiB of several runs."""
    costs = [measured(command)[:2] for _ in range(runs)]
    return tuple(min(column) for column in zip(*costs))

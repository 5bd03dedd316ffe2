#!/usr/bin/env python3
"""600 seeded damages of corpus files, and files that stand for endless geometry, through `claymill merge`.

    python3 benches/damage.py [--count 600] [--first 0] [--command merge] [--binary PATH] [CORPUS]
    python3 benches/damage.py --command read --binary target/release/examples/read    of claymill-exchange: reading alone

Each run must end by itself, without a panic or an abort, within 5 times the CPU time of the sound file or 10 s
(whichever is more), and take no more memory than the sound one or 50 bytes for each byte of the file (whichever is more) and 64 MB
besides. Prints what does not, keeps the file under target/damage/, and exits with 1.
"""

import argparse
import os
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SUFFIXES = {".igs", ".iges", ".stp", ".step", ".3dm"}
# Larger files take minutes for the sound run alone.
LARGEST = 8 << 20
TIMES, SECONDS = 5, 10.0
BYTES, BESIDES = 50, 64 << 20
NUMBER = re.compile(rb"-?\d+\.\d*(?:[EeDd][-+]?\d+)?")
VALUES = [b"1.E9", b"-1.E9", b"1.E300", b"1.E-300", b"0.", b"-0.", b"1.E6", b"9.99999999E15", b"nan", b"1.E999"]


def files(corpus):
    found = sorted(p for p in corpus.rglob("*") if p.suffix.lower() in SUFFIXES and p.stat().st_size <= LARGEST)
    # Three hundred of the files are small plates: every tenth of them stands for all.
    plates = [p for p in found if p.parent.name == "mfcad"]
    return [p for p in found if p.parent.name != "mfcad"] + plates[::10]


def damaged(data, chance):
    """One to a few hundred changes: bytes, digits, whole numbers, references, pieces left out or doubled."""
    data = bytearray(data)
    text = b"3D Geometry" not in data[:32]
    for _ in range(chance.choice([1, 1, 1, 2, 5, 20, 200])):
        at = chance.randrange(len(data))
        kind = chance.randrange(8 if text else 3)
        if kind == 0:
            data[at] ^= 1 << chance.randrange(8)
        elif kind == 1:
            data[at] = chance.randrange(256)
        elif kind == 2:
            size = chance.randrange(1, 9)
            data[at : at + size] = bytes(chance.choice([0, 255, 0x7F, 1]) for _ in range(len(data[at : at + size])))
        elif kind == 3:
            data[at] = ord(chance.choice("0123456789-.,;#()'*$ "))
        elif kind == 4:
            # A whole number becomes another of the same width, so that fixed columns stay.
            found = NUMBER.search(data, at)
            if found:
                width = found.end() - found.start()
                data[found.start() : found.end()] = chance.choice(VALUES)[:width].ljust(width)
        elif kind == 5:
            found = re.compile(rb"#(\d+)").search(data, at)
            if found:
                other = str(chance.randrange(1, 10 ** len(found[1]))).encode().rjust(len(found[1]), b"0")
                data[found.start(1) : found.end(1)] = other
        elif kind == 6:
            del data[at : at + chance.randrange(1, 400)]
        else:
            piece = data[at : at + chance.randrange(1, 400)]
            data[at:at] = piece
        if not data:
            return b" "
    if chance.random() < 0.1:
        del data[chance.randrange(len(data)) :]
    return bytes(data)


def run(binary, command, path, limit):
    """Seconds of one core, peak memory in bytes, and what went wrong."""
    arguments = [binary, "--quiet", "--threads", "1", command, str(path)]
    if command == "merge":
        arguments += ["-o", str(path) + ".out"]
    if command == "read":
        arguments = [binary, str(path)]
    start = time.monotonic()
    # Others may work on the machine: it is the process's own time that counts.
    patience = 10 * limit
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=said)
        killed = False
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            if not killed and time.monotonic() - start > patience:
                killed = True
                process.send_signal(signal.SIGKILL)
            time.sleep(0.005)
        process.returncode = 0
        seconds = usage.ru_utime + usage.ru_stime
        said.seek(0)
        text = said.read().decode(errors="replace")
    fault = None
    if killed or seconds > limit:
        fault = f"does not end within {limit:.0f} s"
    elif os.WIFSIGNALED(status):
        fault = f"ends by signal {os.WTERMSIG(status)}"
    elif os.WEXITSTATUS(status) not in (0, 1) or "panicked" in text:
        fault = f"exit {os.WEXITSTATUS(status)}: {text.strip()[-300:]}"
    return seconds, usage.ru_maxrss * 1024, fault


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=600)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--command", default="merge")
    parser.add_argument("--binary", default=str(ROOT / "target/release/claymill"))
    parser.add_argument("corpus", nargs="?", default=os.environ.get("CLAYMILL_CORPUS", ROOT.parent / "shared/corpus"))
    options = parser.parse_args()
    kept = ROOT / "target/damage"
    kept.mkdir(parents=True, exist_ok=True)
    found, sound, failures, slowest, heaviest = files(Path(options.corpus)), {}, 0, (0.0, ""), (0.0, "")
    for seed in range(options.first, options.first + options.count):
        chance = random.Random(seed)
        path = found[seed % len(found)]
        data = path.read_bytes()
        if path not in sound:
            sound[path] = run(options.binary, options.command, path_in(kept, path, data), 600)
        normal_s, normal_bytes, _ = sound[path]
        limit_s = max(TIMES * normal_s, SECONDS)
        victim = kept / f"{seed}-{path.name}"
        victim.write_bytes(damaged(data, chance))
        size = victim.stat().st_size
        seconds, peak, fault = run(options.binary, options.command, victim, limit_s)
        limit_bytes = max(normal_bytes, BYTES * size) + BESIDES
        if not fault and peak > limit_bytes:
            fault = f"{peak >> 20} MB, allowed are {limit_bytes >> 20}"
        slowest = max(slowest, (seconds / limit_s, f"{victim.name}: {seconds:.1f} s of {limit_s:.1f}"))
        heaviest = max(heaviest, (peak / limit_bytes, f"{victim.name}: {peak >> 20} MB of {limit_bytes >> 20}"))
        if fault:
            failures += 1
            print(f"{victim.name}: {fault} (sound: {normal_s:.1f} s, {normal_bytes >> 20} MB)", flush=True)
        else:
            victim.unlink()
        for made in kept.glob("*.out"):
            subprocess.run(["rm", "-r", str(made)], check=True)
    print(f"{options.count} damages of {len(found)} files by `{options.command}`: {failures} failures")
    print(f"slowest {slowest[1]}\nlargest {heaviest[1]}")
    sys.exit(1 if failures else 0)


def path_in(folder, path, data):
    """The sound file where damaged ones are."""
    copy = folder / f"sound-{path.name}"
    copy.write_bytes(data)
    return copy


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    main()

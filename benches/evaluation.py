#!/usr/bin/env python3
"""Evaluation with second derivatives: claymill's leaves against Open CASCADE's C++ D2, on one core by CPU time.

    python3 benches/evaluation.py [REPEATS]

claymill gives the unit normal and both fundamental forms as well. Open CASCADE comes from Debian's packages, unpacked
(not installed) under target/; evaluation.cpp is compiled against them with optimisation. The two are run in turns and
each figure is the best of all. Exits with 1 below 80 M/s for bicubic polynomials or 40 M/s for rational ones, where
claymill is less than ten times as fast as the faster of Open CASCADE's two ways, or where the two differ by more than
1e-8.
"""

import subprocess
import sys

import occ

PACKAGES = ["libocct-foundation-dev", "libocct-modeling-data-dev", "libocct-foundation-7.6"]
PACKAGES += ["libocct-modeling-data-7.6", "libtbb12", "libtbbmalloc2"]
FOLDER = occ.ROOT / "target" / "bench-occt"
BARS = {("3x3", "0"): 80.0, ("3x3", "1"): 40.0}
RATIO = 10.0
TURNS = 3


def libraries():
    """Where the unpacked libraries are."""
    return next(FOLDER.glob("usr/lib/*/libTKG3d.so")).parent


def compiled():
    """Open CASCADE's side, compiled once."""
    program, source = FOLDER / "evaluation", occ.ROOT / "benches" / "evaluation.cpp"
    if program.exists() and program.stat().st_mtime > source.stat().st_mtime:
        return program
    FOLDER.mkdir(parents=True, exist_ok=True)
    if not (FOLDER / "usr").exists():
        download = ["apt-get", "download", "-qq", "-o", "APT::Sandbox::User=root", *PACKAGES]
        subprocess.run(download, cwd=FOLDER, check=True)
        for package in FOLDER.glob("*.deb"):
            subprocess.run(["dpkg", "-x", package, FOLDER], check=True)
    flags = ["-O3", "-march=native", "-isystem", FOLDER / "usr/include/opencascade", "-L", libraries()]
    flags += [f"-Wl,-rpath-link,{libraries()}", "-lTKG3d", "-lTKMath", "-lTKernel"]
    subprocess.run(["g++", source, "-o", program, *flags], check=True)
    return program


def rows(command, environment=None):
    """What a program prints, by degrees and rationality."""
    lines = subprocess.run(command, stdout=subprocess.PIPE, check=True, text=True, env=environment).stdout
    return {tuple(words[:2]): [float(w) for w in words[2:]] for words in map(str.split, lines.splitlines())}


def main():
    repeats = sys.argv[1] if len(sys.argv) > 1 else "7"
    own, other = occ.example("claymill-nurbs", "evaluate"), compiled()
    loader = {"LD_LIBRARY_PATH": str(libraries())}
    ours, theirs = {}, {}
    for _ in range(TURNS):
        for found, best in [(rows([own, repeats]), ours), (rows([other, repeats], loader), theirs)]:
            for key, row in found.items():
                best[key] = [max(pair) for pair in zip(row, best.get(key, row))]
    print(f"{'M/s a core':16} {'leaves, 8 abreast':>18} {'one by one':>11} {'OCC adaptor':>12} {'OCC surface':>12} {'ratio':>6}")
    passed = True
    for key, (bulk, single, _, *check) in ours.items():
        kept, plain, *expected = theirs[key]
        ratio = bulk / max(kept, plain)
        name = key[0] + (" rational" if key[1] == "1" else "")
        print(f"{name:16} {bulk:18.1f} {single:11.1f} {kept:12.2f} {plain:12.2f} {ratio:6.1f}")
        passed &= bulk >= BARS.get(key, 0.0) and ratio >= RATIO
        passed &= all(abs(a - b) <= 1e-8 for a, b in zip(check, expected))
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Ten pockets cleared by claymill and by FreeCAD's Adaptive, judged alike: one tool, one step-over, the same feeds.

    python3 benches/adaptive.py [LIMIT_DEG]

LIMIT_DEG is a multiple of 5. Both get the same contours, a flat end of 6 mm and the step-over at which a straight pass has LIMIT_DEG (60). FreeCAD's ways are
written as moves by the same code as claymill's: level cuts and links at one feed, helices and leads at half of it, rapids between.
claymill's verifier measures the engagement of both. FreeCAD comes from Debian (freecad-python3 and libfreecad-python3-0.20).
"""

import json
import subprocess
import sys

import occ

# Width of a bin of the verifier's histogram, degrees.
BIN_DEG = 5
# Step-overs that are tried with FreeCAD, as shares of that of the limit.
SHARES = [1.0, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6]
# Share of the cutting length that may be above the limit.
MOST_ABOVE = 0.01

FREECAD = "/usr/lib/freecad-python3/lib"

ADAPTIVE = """
import json, math, os, sys, time
# FreeCAD talks on stdout.
out = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
sys.path.insert(0, sys.argv[1])
import area

for line in sys.stdin:
    pocket = json.loads(line)
    adaptive = area.Adaptive2d()
    adaptive.toolDiameter = pocket["tool_mm"]
    adaptive.stepOverFactor = pocket["step_mm"] / pocket["tool_mm"]
    adaptive.helixRampDiameter = 0.9 * pocket["tool_mm"]
    adaptive.tolerance = 0.1
    adaptive.stockToLeave = 0.0
    adaptive.finishingProfile = True
    adaptive.keepToolDownDistRatio = 3.0
    adaptive.opType = area.AdaptiveOperationType.ClearingInside
    closed = [[*map(list, c), list(c[0])] for c in pocket["contours"]]
    xs, ys = zip(*(p for c in closed for p in c))
    low, high = (min(xs) - 1, min(ys) - 1), (max(xs) + 1, max(ys) + 1)
    stock = [[[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]], [low[0], low[1]]]]
    began = time.perf_counter()
    regions = adaptive.Execute(stock, closed, lambda paths: False)
    seconds = time.perf_counter() - began
    strokes = []
    for region in regions:
        centre, start = region.HelixCenterPoint, region.StartPoint
        strokes.append({"helix": [list(centre), math.dist(centre, start)]})
        over = False
        for kind, points in region.AdaptivePaths:
            # 0 cuts; 2 is a link that is not clear.
            if kind == 0:
                strokes.append({"over": over, "points": points})
            over = kind == 2
    print(json.dumps({"name": pocket["name"], "contours": pocket["contours"], "plan_s": seconds, "strokes": strokes}), file=out)
"""


def run(command, given=None):
    done = subprocess.run(command, input=given, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    if done.returncode != 0:
        sys.exit(f"{command[0]} failed:\n{done.stderr[-2000:]}")
    return [json.loads(line) for line in done.stdout.splitlines()]


def lines(values):
    return "".join(json.dumps(value) + "\n" for value in values)


def above(figures, limit_deg):
    """The share of the cutting length that lies above the limit; bins of 5 degrees, the first with all that cuts nothing."""
    bins = figures["histogram_mm"]
    return sum(bins[limit_deg // BIN_DEG :]) / sum(bins[1:])


def freecad(pockets, ours, share):
    """FreeCAD's ways at a share of the step-over, judged."""
    given = [{**our, "step_mm": share * our["step_mm"]} for our in ours]
    found = run(["/usr/bin/python3", "-c", ADAPTIVE, FREECAD], lines(given))
    judged = run([pockets, "judge"], lines(found))
    return [{**f["figures"], "plan_s": plan["plan_s"]} for f, plan in zip(judged, found)]


def main():
    limit_deg = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    build = ["cargo", "build", "--release", "--quiet", "-p", "claymill-clearing", "--example", "pockets"]
    subprocess.run(build, cwd=occ.ROOT, check=True)
    pockets = occ.ROOT / "target" / "release" / "examples" / "pockets"
    ours = run([pockets, "clear", str(limit_deg)])
    found = {share: freecad(pockets, ours, share) for share in SHARES}
    print(f"Engagement allowed: {limit_deg} degrees. C: claymill. F: FreeCAD with the step-over of that engagement. G: FreeCAD with the")
    print(f"largest share of it at which no more than {MOST_ABOVE:.0%} of the length that cuts is above the limit.\n")
    print("| pocket | time C, min | F | G | C / F | C / G | share G | largest C | F | G | above C, % | F | G | left C, mm2 | F | G |")
    print("|---" + "|--:" * 15 + "|")
    total = [0.0] * 3
    for k, our in enumerate(ours):
        kept = [s for s in SHARES if above(found[s][k], limit_deg) <= MOST_ABOVE]
        share = max(kept, default=min(SHARES))
        three = [our["figures"], found[1.0][k], found[share][k]]
        minutes = [f["minutes"] for f in three]
        total = [a + b for a, b in zip(total, minutes)]
        row = [
            our["name"],
            *(f"{m:.2f}" for m in minutes),
            *(f"{minutes[0] / m:.2f}" for m in minutes[1:]),
            f"{share:.2f}" if kept else "none",
            *(f"{f['engagement_deg']:.1f}" for f in three),
            *(f"{100 * above(f, limit_deg):.1f}" for f in three),
            *(f"{f['left_mm2']:.2f}" for f in three),
        ]
        print(f"| {' | '.join(row)} |")
    ratios = [total[0] / t for t in total[1:]]
    print(f"\nAll: {total[0]:.2f}, {total[1]:.2f} and {total[2]:.2f} min; C / F {ratios[0]:.2f}, C / G {ratios[1]:.2f}.")
    plan_s = [sum(our["plan_s"] for our in ours), sum(f["plan_s"] for f in found[1.0])]
    print(f"Planned in {plan_s[0]:.1f} s (C) and {plan_s[1]:.1f} s (F).")


if __name__ == "__main__":
    main()

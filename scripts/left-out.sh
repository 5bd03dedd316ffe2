#!/usr/bin/env bash
# Counts the tests that were left out, by what they needed. Each line of the file has need, place, test and reason,
# separated by tabs (tests/src/need.rs). A test may have several lines and counts once for each need.
set -euo pipefail
file=$1
if [ ! -s "$file" ]; then
    echo "no test was left out"
    exit 0
fi
awk -F '\t' '
    # The harness names no test when it has a single thread: the place stands for it.
    { folder = $2; sub("/.*", "", folder); test = folder " " ($3 == "?" ? $2 : $3) }
    !seen[$1, test]++ { count[$1]++ }
    !known[test]++ { tests++ }
    END {
        for (need in count) print need "\t" count[need] | "sort -f"
        close("sort -f")
        print tests
    }' "$file" | awk -F '\t' -v file="$file" '
    NF == 2 { list = list (list == "" ? "" : ", ") $1 " " $2; next }
    { printf "%d %s left out, wholly or in part: %s (%s has the reasons)\n",
          $1, $1 == 1 ? "test was" : "tests were", list, file }'

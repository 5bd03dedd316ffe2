#!/usr/bin/env python3
"""Checks the proof in a reach.json: that its directions reach all its places, and that fewer do not.

    python3 scripts/check-cover.py reach.json

It shares nothing with the program that wrote the file. A proof is a tree. A leaf gives places shares in millionths; if
no direction that is still allowed reaches more than one million of them, any choice needs as many directions as the sum
of all shares says. A branch takes each direction that reaches a place in turn, without those before; one may be missing
where another one that is there reaches all that it reaches of what is left.
"""

import json
import sys

SHARE = 1_000_000


class Wrong(Exception):
    pass


def check(node, least, chosen, left, allowed, reached):
    """Whether a choice that has `chosen` directions already needs `least` in all."""
    if "shares" in node:
        shares = {}
        for place, share in node["shares"]:
            if place not in left or place in shares or share < 0:
                raise Wrong(f"place {place} is not left, or has two shares")
            shares[place] = share
        for direction in allowed:
            load = sum(share for place, share in shares.items() if place in reached[direction])
            if load > SHARE:
                raise Wrong(f"direction {direction} reaches shares of {load}")
        needed = chosen + -(-sum(shares.values()) // SHARE)
        if needed < least:
            raise Wrong(f"{chosen} directions and shares need {needed} only")
        return 1
    branch = node["branch"]
    place = branch["row"]
    if place not in left:
        raise Wrong(f"place {place} is not left")
    taken = [child["column"] for child in branch["children"]]
    for direction in allowed:
        if place in reached[direction] and direction not in taken:
            own = reached[direction] & left
            if not any(other in allowed and own <= reached[other] & left for other in taken):
                raise Wrong(f"direction {direction} reaches place {place} and is not tried")
    leaves = 0
    allowed = set(allowed)
    for child in branch["children"]:
        direction = child["column"]
        if direction not in allowed:
            raise Wrong(f"direction {direction} is not allowed")
        leaves += check(child["proof"], least, chosen + 1, left - reached[direction], frozenset(allowed), reached)
        allowed.remove(direction)
    return leaves


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        found = json.load(file)
    directions = range(len(found["directions"]))
    places = set(range(len(found["places"])))
    reached = {d: set() for d in directions}
    for place, record in enumerate(found["places"]):
        for direction in record["from"]:
            reached[direction].add(place)
    chosen, forced = found["chosen"], found["forced"]
    try:
        by_forced = set().union(*(reached[d] for d in chosen[:forced]))
        if by_forced:
            raise Wrong("forced directions reach places that the proof counts")
        missing = places - set().union(*(reached[d] for d in chosen))
        if missing:
            raise Wrong(f"place {min(missing)} is reached by none of the chosen directions")
        sys.setrecursionlimit(10_000)
        leaves = check(found["proof"], found["least"], 0, places, frozenset(directions), reached)
        if found["is_optimal"] != (len(chosen) - forced == found["least"]):
            raise Wrong("is_optimal does not say what the numbers say")
    except Wrong as wrong:
        sys.exit(f"no proof: {wrong}")
    word = "proven" if found["is_optimal"] else "not proven to be the fewest"
    print(
        f"{len(chosen) - forced} directions besides {forced} forced ones, at least {found['least']}: {word} "
        f"({len(places)} places, {leaves} leaves)"
    )


if __name__ == "__main__":
    main()

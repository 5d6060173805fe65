#!/usr/bin/env python3
"""Holds `cargo metadata` against deny.toml: licences, banned crates, sources. A stand-in for cargo-deny."""

import json
import re
import subprocess
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def permitted(expression: str, allow: set[str]) -> bool:
    """Whether an SPDX expression can be met with the permitted licences. `/` is an old way of writing OR."""
    tokens = re.findall(r"[()]|[^\s()]+", expression.replace("/", " OR "))
    position = 0

    def peek() -> str:
        return tokens[position] if position < len(tokens) else ""

    def take() -> str:
        nonlocal position
        position += 1
        return tokens[position - 1]

    def either() -> bool:
        result = both()
        while peek() == "OR":
            take()
            other = both()
            result = result or other
        return result

    def both() -> bool:
        result = one()
        while peek() == "AND":
            take()
            other = one()
            result = result and other
        return result

    def one() -> bool:
        token = take()
        if token == "(":
            result = either()
            take()
            return result
        if peek() == "WITH":
            take()
            token = f"{token} WITH {take()}"
        return token in allow

    return either()


def main() -> int:
    deny = tomllib.loads((ROOT / "deny.toml").read_text())
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--all-features"]
    host = re.search(r"host: (\S+)", subprocess.run(["rustc", "-vV"], capture_output=True, text=True, check=True).stdout)
    command += ["--filter-platform", host.group(1)]
    metadata = json.loads(subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout)
    used = {node["id"] for node in metadata["resolve"]["nodes"]}
    packages = [package for package in metadata["packages"] if package["id"] in used]

    allow = set(deny["licenses"]["allow"])
    wrong = []
    versions = defaultdict(set)
    for package in packages:
        name = f"{package['name']} {package['version']}"
        versions[package["name"]].add(package["version"])
        if not permitted(package["license"] or "none", allow):
            wrong.append(f"{name}: licence {package['license']}")
        if package["source"] and "crates.io" not in package["source"]:
            wrong.append(f"{name}: comes from {package['source']}")
    for ban in deny["bans"]["deny"]:
        found = versions.get(ban["crate"], set())
        if ban.get("deny-multiple-versions") and len(found) > 1 or found and not ban.get("deny-multiple-versions"):
            wrong.append(f"{ban['crate']} {', '.join(sorted(found))}: {ban['reason']}")

    assert permitted("(MIT OR GPL-3.0) AND Unicode-3.0", {"MIT", "Unicode-3.0"})
    assert not permitted("MIT AND GPL-3.0", {"MIT"})
    for line in wrong:
        print(line, file=sys.stderr)
    print(f"{len(packages)} packages, {len(wrong)} not permitted by deny.toml")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

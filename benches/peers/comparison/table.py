"""The table as Markdown, and its place in the README."""

import statistics

BEGIN, END = "<!-- peers -->\n", "<!-- /peers -->\n"
# Most that an iteration with lines or with structure may take over one of points alone.
MOST_OVER_POINTS = 1.5


def number(value):
    """Three digits."""
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def peer_cells(measured, missing, ours):
    """Seconds of a peer, and ours over them."""
    if missing is not None or measured is None:
        return ["–", ""]
    if measured.median is None:
        return [measured.note, ""]
    mark = "" if measured.same_cost else " †"
    ratio = "" if ours is None or not measured.same_cost else number(ours / measured.median)
    return [f"{number(measured.median)}{mark}", ratio]


def times(compared, names, missing):
    """The table of seconds to the same cost."""
    heads = ["problem", "cost", "ours, s"]
    for name in names:
        heads += [f"{name}, s", "ours over it"]
    lines = [row(heads + ["Ceres' configuration"]), "|---|--:|--:|" + "--:|--:|" * len(names) + "---|"]
    for entry in compared:
        ours = entry.ours.median
        mark = " ‡" if entry.disagreements else ""
        cells = [f"{entry.group}, {entry.name}{mark}", "–" if entry.target is None else f"{entry.target:.6e}", entry.ours.note if ours is None else number(ours)]
        for name in names:
            cells += peer_cells(entry.peers.get(name), missing.get(name), ours)
        best = entry.peers.get("Ceres")
        lines.append(row(cells + [best.configuration if best is not None else "–"]))
    return lines


def paces(paced, methods):
    """The table of our time for an iteration."""
    heads = ["sequence", "point, ms"]
    for method in methods[1:]:
        heads += [f"{method}, ms", "over point"]
    lines = [row([*heads, f"≤ {MOST_OVER_POINTS}"]), "|---|--:|" + "--:|--:|" * (len(methods) - 1) + "---|"]
    for entry in paced:
        cells = [entry.name, number(1e3 * entry.seconds["point"])]
        for method in methods[1:]:
            cells += [number(1e3 * entry.seconds[method]), f"{entry.ratio(method):.2f}"]
        over = [method for method in methods[1:] if entry.ratio(method) > MOST_OVER_POINTS]
        lines.append(row([*cells, "NO: " + ", ".join(over) if over else "yes"]))
    return lines


def row(cells):
    return "| " + " | ".join(cells) + " |"


def summary(compared, names):
    """How we stand against each peer, over the problems that both time; and by kind of problem against the first."""
    words = [standing(compared, name, name) for name in names]
    for group in dict.fromkeys(entry.group for entry in compared):
        words.append(standing([entry for entry in compared if entry.group == group], names[0], f"{names[0]}, {group}"))
    return "; ".join(filter(None, words)) + "." if any(words) else ""


def standing(compared, name, label):
    """How we stand against a peer; nothing where no problem is timed by both."""
    ratios = sorted(
        entry.ours.median / entry.peers[name].median
        for entry in compared
        if name in entry.peers and entry.peers[name].same_cost and entry.ours.median and entry.peers[name].median
    )
    if not ratios:
        return ""
    faster = sum(ratio < 1.0 for ratio in ratios)
    return (
        f"{label}: faster on {faster} of {len(ratios)}, ours over it {number(ratios[0])} to {number(ratios[-1])}, "
        f"in geometric mean {number(statistics.geometric_mean(ratios))}"
    )


def markdown(label, compared, paced, methods, names, missing):
    """The whole block."""
    lines = [label, "", *times(compared, names, missing), ""]
    if short := summary(compared, names):
        lines += [short, ""]
    notes = [f"{name} is not there: {reason}." for name, reason in missing.items()]
    if any(not peer.same_cost for entry in compared for peer in entry.peers.values()):
        notes.append(
            "† on the way to its own least cost: its residuals are others (GTSAM leaves points behind a camera out, and takes logarithms of relative poses)."
        )
    wrong = [words for entry in compared for words in entry.disagreements]
    if wrong:
        notes.append("‡ costs disagree: " + "; ".join(wrong) + ".")
    if notes:
        lines += [" ".join(notes), ""]
    if paced:
        lines += ["An iteration of ours:", "", *paces(paced, methods), ""]
    return "\n".join(lines).rstrip() + "\n"


def markers(readme):
    """What stands before and after the table."""
    text = readme.read_text(encoding="utf-8")
    before, found, rest = text.partition(BEGIN)
    _, closed, after = rest.partition(END)
    if not found or not closed:
        raise ValueError(f"{readme}: expected the lines {BEGIN.strip()} and {END.strip()}")
    return before + BEGIN, END + after


def put(readme, block):
    """Writes the block between its markers."""
    before, after = markers(readme)
    readme.write_text(before + block + after, encoding="utf-8")

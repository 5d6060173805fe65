"""The table as Markdown, and what was promised."""

# Of the largest graph.
MOST_MINUTES = 15.0
MOST_GIB = 16.0
LEAST_OBSERVATIONS = 10_000_000
# The power of the number of observations with which the time of an iteration grows; 1 is linear, and times differ by some per cent.
MOST_POWER = 1.1
# Residuals of noise of one sigma, over what is expected of them; a robust loss leaves a little more than least squares do.
MOST_OVER_NOISE = 1.02
# Error of positions, as part of the way that was gone.
MOST_ERROR = 0.01


def row(cells):
    return "| " + " | ".join(cells) + " |"


def cells(run):
    return [
        f"{run['frames']:,}",
        f"{run['points']:,}",
        f"{run['observations']:,}",
        f"{run['track_length']:.1f}",
        str(run["steps"]),
        f"{run['seconds']:.1f}",
        f"{run['iteration_seconds']:.3f}",
        f"{1e6 * run['iteration_seconds'] / run['observations']:.2f}",
        f"{run['process_seconds']:.0f}",
        f"{run['peak_gib']:.2f}",
        f"{run['final_cost']:.6e}",
        f"{run['residual_rms_px']:.4f} / {run['expected_rms_px']:.4f}",
        f"{run['way_m']:.0f}",
        f"{run['initial_ape_m']:.3f}",
        f"{run['ape_m']:.3f}",
    ]


HEADS = [
    "frames",
    "points",
    "observations",
    "views a point",
    "steps",
    "adjusting, s",
    "an iteration, s",
    "an iteration, µs an observation",
    "whole process, s",
    "memory, GiB",
    "final cost",
    "residuals / expected, px RMS",
    "way, m",
    "error before, m RMS",
    "error after, m RMS",
]


def bounds(runs, powers):
    """What is promised: words, what was measured, the bound in words, and whether it holds."""
    largest = max(runs, key=lambda run: run["observations"])
    wholly = largest["observations"] >= LEAST_OBSERVATIONS
    minutes, gib = largest["process_seconds"] / 60.0, largest["peak_gib"]
    over = max(run["residual_rms_px"] / run["expected_rms_px"] for run in runs)
    error = max(run["ape_m"] / run["way_m"] for run in runs)
    power = powers["iteration_seconds"]
    found = [
        ("all converged", "yes" if all(run["converged"] for run in runs) else "no", "yes", all(run["converged"] for run in runs)),
        ("residuals over those of the noise, at most", f"{over:.4f}", f"≤ {MOST_OVER_NOISE}", over <= MOST_OVER_NOISE),
        ("error of positions over the way, at most", f"{100 * error:.2f} %", f"≤ {100 * MOST_ERROR:.0f} %", error <= MOST_ERROR),
    ]
    if wholly:
        found += [
            ("the largest, with reading and writing", f"{minutes:.1f} min", f"≤ {MOST_MINUTES:.0f} min", minutes <= MOST_MINUTES),
            ("its resident memory", f"{gib:.1f} GiB", f"≤ {MOST_GIB:.0f} GiB", gib <= MOST_GIB),
        ]
    if power is not None:
        found.append(("time of an iteration ∝ observations to the power", f"{power:.2f}", f"≤ {MOST_POWER}", power <= MOST_POWER))
    return found


def markdown(about, powers):
    """The tables, and the promises that do not hold."""
    runs = about["runs"]
    days = sorted({run["date"] for run in runs})
    commits = ", ".join(sorted({run["commit"] for run in runs}))
    lines = [f"{about['made_by']}, {' to '.join(sorted({days[0], days[-1]}))}, {commits}, {about['machine']}.", ""]
    lines += [row(HEADS), "|" + "--:|" * len(HEADS)]
    lines += [row(cells(run)) for run in runs]
    promised = bounds(runs, powers)
    lines += ["", row(["promise", "measured", "bound", "holds"]), "|---|--:|--:|---|"]
    lines += [row([words, found, bound, "yes" if holds else "NO"]) for words, found, bound, holds in promised]
    lines += ["", "![time of an iteration and memory over observations](scale.svg)", ""]
    return "\n".join(lines), [f"{words}: {found}, {bound}" for words, found, bound, holds in promised if not holds]

"""Measures one problem: costs that have to agree, and seconds until they are reached."""

import statistics
from dataclasses import asdict, dataclass, field

# A cost is reached when no more than this part of it is left.
RELATIVE = 1e-6
# Where the least cost is next to nothing, as without noise, the same part of this part of the initial cost counts.
LEAST_PART = 1e-3
# A configuration is given up after this many times the fastest one's time to its end.
PATIENCE = 4.0
# Other peers are given this many times as long as Ceres takes to its end, and never less than this many seconds.
TIMES_CERES = 20.0
LEAST_SECONDS = 3.0
# Rounds of runs in turn, by the seconds that a round takes.
ROUNDS = [(2.0, 5), (15.0, 3)]


@dataclass
class Measured:
    """One solver on one problem."""

    version: str = ""
    configuration: str = ""
    initial_cost: float | None = None
    final_cost: float | None = None
    seconds: list = field(default_factory=list)  # to the target, of each round
    steps: int | None = None
    ending: str = ""
    same_cost: bool = True  # whether it costs the start as ours does
    note: str = ""  # why there is no time

    @property
    def median(self):
        return statistics.median(self.seconds) if self.seconds else None


@dataclass
class Compared:
    """All solvers on one problem."""

    group: str
    name: str
    target: float | None  # none where ours failed
    ours: Measured
    peers: dict
    disagreements: list

    def as_json(self):
        return {**asdict(self), "medians": {"ours": self.ours.median, **{name: peer.median for name, peer in self.peers.items()}}}


def slack(cost, initial):
    """How far above a cost still counts as that cost."""
    return RELATIVE * max(cost, LEAST_PART * initial)


def explore(peer, problem, limits, say):
    """Runs every configuration of a peer without a target; gives those that ran, and why the others did not."""
    runs, reasons = [], []
    seconds = limits.seconds
    for configuration in peer.configurations_of(problem):
        run = peer.run(problem, configuration, type(limits)(limits.threads, limits.iterations, seconds))
        if isinstance(run, str):
            reasons.append(f"{configuration[0]}: {run}")
            say(f"    {peer.name}, {configuration[0]}: {run}")
            continue
        runs.append((configuration, run))
        say(f"    {peer.name}, {configuration[0]}: {run.final_cost:.7e} in {run.seconds:.2f} s, {run.steps} steps, {run.ending}")
        if run.ending == "converged":
            seconds = min(seconds, max(2.0, PATIENCE * run.seconds))
    return runs, reasons


def fastest(runs, target):
    """The configuration that is first at a target, or that comes nearest to it."""
    def rank(entry):
        _, run = entry
        seconds = run.seconds_to(target)
        return (seconds is None, run.final_cost if seconds is None else seconds)

    return min(runs, key=rank)


def chosen(peer, problem, runs, reasons, target, initial):
    """What is known of a peer before it is timed, and its configuration; None where it is not timed."""
    if not peer.configurations_of(problem):
        return Measured(note="cannot pose it"), None
    if not runs:
        return Measured(note="; ".join(reasons)), None
    (configuration, run), goal, same_cost = fastest(runs, target), target, True
    if abs(run.initial_cost - initial) > RELATIVE * initial:
        # Its residuals are others; then it is timed on the way to its own least cost.
        least = min(run.final_cost for _, run in runs)
        same_cost, goal = False, least + slack(least, run.initial_cost)
        configuration, run = fastest(runs, goal)
    measured = Measured(run.version, configuration[0], run.initial_cost, run.final_cost, ending=run.ending, same_cost=same_cost)
    if run.seconds_to(goal) is None:
        above = (run.final_cost - target) / target if target > 0.0 else float("inf")
        words = {"time": f"not in {run.seconds:.0f} s", "iterations": f"not in {run.steps} steps"}
        measured.note = f"{words.get(run.ending, 'not reached')}: {above:.1e} above"
        return measured, None
    measured.steps = sum(1 for _, cost in run.iterations if cost > goal)
    return measured, (peer, configuration, goal)


def compare(problem, own, peers, limits, say):
    """Explores, then times ours and every peer in turn."""
    first = own.run(problem.own_path, problem.method, limits)
    if isinstance(first, str):
        where = f"{problem.group}, {problem.name}"
        return Compared(problem.group, problem.name, None, Measured(note=first), {}, [f"{where}: ours failed: {first}"])
    say(f"    ours: {first.final_cost:.7e} in {first.seconds:.2f} s, {first.steps} steps")
    explored, patience = {}, limits
    for name, peer in peers.items():
        explored[name] = explore(peer, problem, patience, say)
        if name == "Ceres" and explored[name][0]:
            quickest = min(run.seconds for _, run in explored[name][0])
            seconds = min(limits.seconds, max(LEAST_SECONDS, TIMES_CERES * quickest))
            patience = type(limits)(limits.threads, limits.iterations, seconds)
    # Ceres' least cost is the one to reach; without it that of whoever has the same cost.
    same = {
        name: min(run.final_cost for _, run in runs if abs(run.initial_cost - first.initial_cost) <= RELATIVE * first.initial_cost)
        for name, (runs, _) in explored.items()
        if any(abs(run.initial_cost - first.initial_cost) <= RELATIVE * first.initial_cost for _, run in runs)
    }
    least = same.get("Ceres", min([first.final_cost, *same.values()]))
    target = least + slack(least, first.initial_cost)

    ours = Measured(initial_cost=first.initial_cost, final_cost=first.final_cost, steps=first.steps)
    measured, timed = {}, []
    for name, peer in peers.items():
        runs, reasons = explored[name]
        measured[name], entry = chosen(peer, problem, runs, reasons, target, first.initial_cost)
        if entry is not None:
            timed.append((measured[name], *entry))

    rounds, done = 1, 0
    while done < rounds:
        spent = 0.0
        run = own.run(problem.own_path, problem.method, limits, target)
        seconds = None if isinstance(run, str) else run.seconds_to(target)
        if seconds is not None:
            ours.seconds.append(seconds)
        spent += seconds or 0.0
        for peer_measured, peer, configuration, goal in timed:
            run = peer.run(problem, configuration, limits, goal)
            seconds = None if isinstance(run, str) else run.seconds_to(goal)
            if seconds is not None:
                peer_measured.seconds.append(seconds)
                spent += seconds
        if done == 0:
            rounds = next((rounds for most, rounds in ROUNDS if spent <= most), 1)
        done += 1

    compared = Compared(problem.group, problem.name, target, ours, measured, [])
    compared.disagreements = disagreements(compared, same, target)
    if not ours.seconds:
        ours.note = f"not reached: {(first.final_cost - target) / target:.1e} above"
    return compared


def disagreements(compared, same, target):
    """What does not agree: costs where they begin, and costs where they end."""
    found = []
    where, ours = f"{compared.group}, {compared.name}", compared.ours
    for name, peer in compared.peers.items():
        # GTSAM leaves points behind a camera out, and measures relative poses by logarithms.
        if not peer.same_cost and name != "GTSAM":
            found.append(f"{where}: {name} costs the start {peer.initial_cost:.9e}, ours {ours.initial_cost:.9e}")
    if same:
        name = min(same, key=same.get)
        margin = slack(min(same[name], ours.final_cost), ours.initial_cost)
        if ours.final_cost > same[name] + margin:
            found.append(f"{where}: ours ends at {ours.final_cost:.9e}, {name} lower, at {same[name]:.9e}")
        elif same[name] > ours.final_cost + margin:
            found.append(f"{where}: ours ends at {ours.final_cost:.9e}, no peer lower than {name}, at {same[name]:.9e}")
    return found


@dataclass
class Paced:
    """Seconds that an iteration of ours takes on one sequence, by method."""

    name: str
    seconds: dict

    def ratio(self, method):
        return self.seconds[method] / self.seconds["point"]


def pace(sequence, methods, own, limits):
    """Seconds for an iteration of each method, all of an adjustment over its steps: medians of runs in turn."""
    found = {method: [] for method in methods}
    rounds, done = 1, 0
    while done < rounds:
        spent = 0.0
        for method in methods:
            run = own.run(sequence.path, method, limits)
            if not isinstance(run, str) and run.steps > 0:
                found[method].append(run.seconds / run.steps)
                spent += run.seconds
        if done == 0:
            rounds = next((rounds for most, rounds in ROUNDS if spent <= most), 1)
        done += 1
    if not all(found.values()):
        return None
    return Paced(sequence.name, {method: statistics.median(seconds) for method, seconds in found.items()})

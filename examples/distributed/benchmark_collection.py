#!/usr/bin/env python3
"""Makes the sequences of a collection and benchmarks them, on many processes at once, with Dask.

    python3 benchmark_collection.py all -o results --jobs jobs.txt --workers 4 -- --seeds 10

The program `os` is the task, one for each sequence; Dask shares the tasks out among worker processes, on this
machine or, with --scheduler, on those of a cluster that see the same folders. What comes out is what one
machine makes of

    os index all && os benchmark all -o results --seeds 10

to the byte in `table.md`; wall times differ.

A task that fails is tried again, elsewhere where there is an elsewhere; so is one whose worker died. Programs
give an output its name when it is whole, so that an attempt leaves all or nothing, and what is there is not
made twice.
"""

import argparse
import json
import os
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from distributed import Client, Future, LocalCluster


@dataclass(frozen=True)
class Job:
    """A sequence and the command that makes it; no command where it is there already."""

    name: str
    output: str
    command: tuple[str, ...] = ()


class TaskFailed(RuntimeError):
    """A program that ended with an error, and what it said."""


def folder_name(sequence: str) -> str:
    """The folder of a sequence in a collection, as section 15.1 of the specification has it."""
    plain = "-._~"
    return "sequence=" + "".join(
        c if not c.isascii() or c.isalnum() or c in plain else f"%{ord(c):02X}" for c in sequence
    )


def read_jobs(path: Path, collection: Path, program: str) -> list[Job]:
    """One job a line: the name of the sequence, then the command, in which {output} is where it writes."""
    jobs = []
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        sys.exit(f"{path}: {error.strerror}")
    for number, line in enumerate(text.splitlines(), 1):
        words = shlex.split(line, comments=True)
        if not words:
            continue
        name, *command = words
        if not any("{output}" in word for word in command):
            sys.exit(f"{path} line {number}: expected NAME COMMAND… {{output}} …, found {line!r}")
        output = str(collection / folder_name(name))
        words = [program if command[0] == "os" else command[0], *command[1:]]
        jobs.append(Job(name, output, tuple(word.replace("{output}", output) for word in words)))
    return jobs


def run(command: list[str] | tuple[str, ...], permitted: tuple[int, ...] = (0,)) -> str:
    """What a program prints."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in permitted:
        raise TaskFailed(f"{shlex.join(command)} ended with {done.returncode}: {done.stderr.strip()}")
    return done.stdout


def make(job: Job, program: str) -> Job:
    """Makes a sequence that is not there yet, of the name that the collection wants."""
    output = Path(job.output)
    if not output.exists():
        try:
            # Findings (3) are told in the sequence itself.
            run(job.command, permitted=(0, 3))
        except TaskFailed:
            # The attempt of a worker that was given up may have come to its end meanwhile.
            if not output.exists():
                raise
    found = json.loads(run((program, "cat", job.output, "manifest")))["name"]
    if found != job.name:
        raise TaskFailed(f"{output}: expected a sequence called {job.name!r}, found {found!r}; name it so where it is made")
    return job


def benchmark(job: Job, program: str, runs: str, options: tuple[str, ...]) -> str:
    """Benchmarks one sequence; goes on where an earlier attempt was cut off."""
    output = str(Path(runs) / folder_name(job.name))
    # Findings (3) are methods that failed on the sequence: they stand in the table.
    run((program, "benchmark", job.output, "-o", output, "--threads", "1", *options), permitted=(0, 3))
    return output


def settle(futures: dict[str, Future]) -> dict[str, str]:
    """The results of all tasks, by name of the sequence; ends the program with a word on each that failed."""
    results, failed = {}, []
    for name, future in sorted(futures.items()):
        try:
            results[name] = future.result()
        except Exception as error:  # whatever a task raised, or the loss of its workers
            failed.append(f"{name}: {error}")
    if failed:
        sys.exit("\n".join(failed))
    return results


def main() -> None:
    style = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=style)
    parser.add_argument("collection", type=Path, help="folder of sequences called sequence=NAME")
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder of results")
    parser.add_argument("--jobs", type=Path, help="file with NAME COMMAND… {output} … in each line")
    parser.add_argument("--workers", type=int, default=2, help="worker processes on this machine")
    parser.add_argument("--scheduler", help="address of a running scheduler, in place of workers on this machine")
    parser.add_argument("--retries", type=int, default=2, help="how often a task that fails is tried again")
    parser.add_argument("--program", default="os", help="the program os")
    parser.add_argument("--label", default="", help="said above the table, such as date and commit")
    parser.epilog = "What follows -- are options of os benchmark."
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    arguments, options = parser.parse_args(words[:end]), tuple(words[end + 1 :])

    collection, output = arguments.collection.absolute(), Path(os.path.abspath(arguments.output))
    if output.exists() and not (output / "plan.json").is_file():
        sys.exit(f"{output}: expected a folder of results with plan.json, or none; found something else")
    runs = output.with_name(f"{output.name}.runs")
    collection.mkdir(parents=True, exist_ok=True)
    program = arguments.program
    jobs = read_jobs(arguments.jobs, collection, program) if arguments.jobs else []
    there = {job.output for job in jobs}
    for folder in sorted(collection.glob("sequence=*")):
        if str(folder) not in there:
            jobs.append(Job(unquote(folder.name.removeprefix("sequence=")), str(folder)))
    if not jobs:
        sys.exit(f"{collection}: no sequences; expected folders called sequence=NAME, or --jobs")

    cluster = None
    if not arguments.scheduler:
        cluster = LocalCluster(
            n_workers=arguments.workers, threads_per_worker=1, processes=True, dashboard_address=None
        )
    with Client(arguments.scheduler or cluster) as client:
        futures = {}
        for job in jobs:
            tries = {"retries": arguments.retries}
            made = client.submit(make, job, program, key=f"make-{job.name}", **tries) if job.command else job
            futures[job.name] = client.submit(
                benchmark, made, program, str(runs), options, key=f"benchmark-{job.name}", **tries
            )
        results = settle(futures)
    if cluster:
        cluster.close()

    print(run((program, "index", str(collection), "--force")), end="")
    # By name, as the catalogue has them.
    folders = [results[name] for name in sorted(results, key=lambda name: name.encode())]
    output = ("-o", str(arguments.output), "--label", arguments.label)
    print(run((program, "benchmark", "--gather", *folders, *output), permitted=(0, 3)), end="")


if __name__ == "__main__":
    main()

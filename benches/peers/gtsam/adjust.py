"""GTSAM on the graphs of `make bench-peers`; says cost over time as one line of JSON.

    adjust.py graph|bal|pose-graph PATH [--ordering O] [--threads N] [--iterations N] [--seconds S] [--target COST]

Points and poses only: GTSAM has no factor of lines. Its optimisers are stepped from here, one iteration at a time; between
two of them nothing but the clock and the cost is read. The wheel's own number of threads is used; `--threads` is only told.
"""

import argparse
import importlib.metadata
import json
import math
import sys
import time

import gtsam
import numpy
from gtsam.symbol_shorthand import L, P, X


class Unsupported(Exception):
    """What GTSAM has nothing for."""


def hold(factors, key, pose):
    """Holds a pose: by a prior so tight that it stays, for a constraint proper makes GTSAM take QR for Cholesky.

    The rest can follow it rigidly, so that the prior costs nothing where the cost is least.
    """
    if isinstance(pose, gtsam.Pose3):
        factors.add(gtsam.PriorFactorPose3(key, pose, gtsam.noiseModel.Isotropic.Sigma(6, 1e-4)))
    else:
        factors.add(gtsam.PriorFactorPose2(key, pose, gtsam.noiseModel.Isotropic.Sigma(3, 1e-4)))


def read_graph(path):
    """Factors and initial values of a graph as `peer_export` writes it."""
    factors, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    cameras, poses, points, camera_of = [], [], 0, []
    noise, sigma, scale = None, 1.0, 1.0
    with open(path, encoding="utf-8") as file:
        for number, text in enumerate(file, 1):
            kind, *words = text.split()
            if kind == "point-view":
                if noise is None:
                    cauchy = gtsam.noiseModel.mEstimator.Cauchy.Create(scale)
                    noise = gtsam.noiseModel.Robust.Create(cauchy, gtsam.noiseModel.Isotropic.Sigma(2, sigma))
                pose, point = int(words[0]), int(words[1])
                pixel = numpy.array([float(words[2]), float(words[3])])
                factors.add(gtsam.GenericProjectionFactorCal3_S2(pixel, noise, X(pose), L(point), cameras[camera_of[pose]]))
            elif kind == "point":
                values.insert(L(points), numpy.array([float(word) for word in words]))
                points += 1
            elif kind == "pose":
                tx, ty, tz, qx, qy, qz, qw = (float(word) for word in words[2:])
                pose = gtsam.Pose3(gtsam.Rot3.Quaternion(qw, qx, qy, qz), numpy.array([tx, ty, tz]))
                values.insert(X(len(poses)), pose)
                if words[1] == "held":
                    hold(factors, X(len(poses)), pose)
                poses.append(pose)
                camera_of.append(int(words[0]))
            elif kind == "prior":
                # Its logarithm has the other sign and the same length.
                turn, shift = float(words[1]), float(words[2])
                sigmas = gtsam.noiseModel.Diagonal.Sigmas(numpy.array([turn] * 3 + [shift] * 3))
                factors.add(gtsam.PriorFactorPose3(X(int(words[0])), poses[int(words[0])], sigmas))
            elif kind == "camera":
                fx, fy, cx, cy = (float(word) for word in words)
                cameras.append(gtsam.Cal3_S2(fx, fy, 0.0, cx, cy))
            elif kind == "loss":
                if words[0] != "cauchy":
                    raise Unsupported(f"{path} line {number}: expected the loss cauchy; found {words[0]}")
                scale = float(words[1])
            elif kind == "sigma":
                sigma = float(words[0])
            elif kind in ("line", "line-view"):
                raise Unsupported("GTSAM has no factor of lines")
            elif kind not in ("#", "cost"):
                raise Unsupported(f"{path} line {number}: no kind of line `{kind}`")
    return factors, values


def read_bal(path):
    """Factors and initial values of a problem of Bundle Adjustment in the Large; GTSAM's own reader takes pixels as floats."""
    with open(path, encoding="utf-8") as file:
        words = iter(file.read().split())
    cameras, points, views = (int(next(words)) for _ in range(3))
    factors, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    noise = gtsam.noiseModel.Unit.Create(2)
    for _ in range(views):
        camera, point, u, v = int(next(words)), int(next(words)), float(next(words)), float(next(words))
        # Its y goes down, theirs up.
        factors.add(gtsam.GeneralSFMFactorCal3Bundler(numpy.array([u, -v]), noise, X(camera), P(point)))
    for place in range(cameras):
        turn, shift, lens = (numpy.array([float(next(words)) for _ in range(3)]) for _ in range(3))
        angle = numpy.linalg.norm(turn)
        rotation = gtsam.Rot3.AxisAngle(turn / angle, angle) if angle > 0.0 else gtsam.Rot3()
        # Its camera looks along −z with y up, theirs along z with y down.
        flipped = gtsam.Rot3(numpy.diag([1.0, -1.0, -1.0]))
        inverse = rotation.inverse()
        pose = gtsam.Pose3(inverse.compose(flipped), inverse.rotate(-shift))
        values.insert(X(place), gtsam.PinholeCameraCal3Bundler(pose, gtsam.Cal3Bundler(*lens, 0.0, 0.0)))
    for place in range(points):
        values.insert(P(place), numpy.array([float(next(words)) for _ in range(3)]))
    return factors, values


def read_pose_graph(path):
    """Factors and initial values of a g2o file, by GTSAM's own reader; the first vertex is held."""
    with open(path, encoding="utf-8") as file:
        is_3d = "SE3" in file.readline()
    factors, values = gtsam.readG2o(path, is_3d)
    first = min(values.keys())
    hold(factors, first, values.atPose3(first) if is_3d else values.atPose2(first))
    return factors, values


def poses_first(values):
    """The order in which poses are eliminated before points."""
    ordering = gtsam.Ordering()
    for key in sorted(values.keys(), key=lambda key: (gtsam.Symbol(key).chr() != ord("x"), key)):
        ordering.push_back(key)
    return ordering


READERS = {"graph": read_graph, "bal": read_bal, "pose-graph": read_pose_graph}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=READERS)
    parser.add_argument("path")
    parser.add_argument("--ordering", choices=["colamd", "metis", "poses-first"], default="colamd")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--iterations", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=math.inf)
    parser.add_argument("--target", type=float, default=-math.inf)
    arguments = parser.parse_args()
    try:
        factors, values = READERS[arguments.kind](arguments.path)
    except Unsupported as cause:
        print(f"gtsam: {cause}", file=sys.stderr)
        return 1

    start = time.perf_counter()
    # As Ceres steps: damping by the diagonal, gain ratios decide.
    parameters = gtsam.LevenbergMarquardtParams.CeresDefaults()
    if arguments.ordering == "poses-first":
        parameters.setOrdering(poses_first(values))
    else:
        parameters.setOrderingType(arguments.ordering.upper())
    optimiser = gtsam.LevenbergMarquardtOptimizer(factors, values, parameters)
    cost = optimiser.error()
    initial, ending = cost, "iterations"
    costs = [[time.perf_counter() - start, cost]]
    for _ in range(arguments.iterations):
        optimiser.iterate()
        seconds, found = time.perf_counter() - start, optimiser.error()
        if found < cost:
            costs.append([seconds, found])
        if found <= arguments.target:
            ending = "target"
        elif not found < cost * (1.0 - 1e-12):
            ending = "converged"
        elif seconds > arguments.seconds:
            ending = "time"
        cost = min(cost, found)
        if ending != "iterations":
            break
    told = {
        "peer": "gtsam",
        "version": importlib.metadata.version("gtsam"),
        "initial_cost": initial,
        "final_cost": cost,
        "seconds": time.perf_counter() - start,
        "ending": ending,
        "iterations": costs,
    }
    print(json.dumps(told))
    return 0


if __name__ == "__main__":
    sys.exit(main())

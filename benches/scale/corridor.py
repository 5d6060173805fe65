"""The corridor that is walked: recipes of `os simulate` that differ in nothing but their length.

A camera goes down a straight corridor on a gentle serpentine and looks ahead. It sees walls, floor and ceiling up to `SIGHT_M`
away, so that what a frame sees, and for how many frames a landmark is seen, is the same however long the corridor is.
"""

import math

# Landmarks for each frame: with tracks of 50 frames, a frame sees 2000.
LANDMARKS_A_FRAME = 40
# From frame to frame: 50 of them while a landmark is in sight.
STEP_M = 0.079
SIGHT_M = 8.0
WIDTH_M, HEIGHT_M = 4.4, 3.5
# Of the serpentine: to either side, up and down, and from waypoint to waypoint, four and six of which make a period.
ASIDE_M, ALOFT_M, BETWEEN_M = 0.6, 0.3, 5.0
# Landmarks of shorter tracks are drawn anew; they would be those at the two ends.
SHORTEST_TRACK = 20
SIGMA_PX, SIGMA_DEPTH_M = 1.0, 0.05


def way_m(frames):
    """How long the path is along the corridor, metres."""
    return STEP_M * (frames - 1)


def recipe(frames):
    """The recipe for so many frames."""
    way = way_m(frames)
    pieces = max(2, round(way / BETWEEN_M))
    places = [
        [ASIDE_M * math.sin(math.pi / 2.0 * i), way * (i / pieces - 0.5), ALOFT_M * math.sin(math.pi / 3.0 * i)]
        for i in range(pieces + 1)
    ]
    return {
        "name": f"corridor-{frames}",
        "description": f"{way:.0f} m down a corridor on a serpentine",
        "seed": 1,
        "min_observations": SHORTEST_TRACK,
        "trajectory": {"kind": "waypoints", "frames": frames, "waypoints": [{"position_m": place} for place in places]},
        "scene": [{"kind": "room", "size_m": [WIDTH_M, way + 1.5 * SIGHT_M, HEIGHT_M]}],
        "points": {"count": LANDMARKS_A_FRAME * frames},
        "lines": {"count": 0},
        "visibility": {"depth_range_m": [0.5, SIGHT_M]},
        "noise": {"model": "gaussian", "sigma_px": SIGMA_PX, "sigma_depth_m": SIGMA_DEPTH_M},
    }

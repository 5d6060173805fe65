// A pose graph in g2o's text form, in three dimensions or two.
#pragma once

#include "solve.h"

namespace peer {

// Reads a pose graph and solves it with its first vertex held.
void SolvePoseGraph(const Request& request);

}  // namespace peer

// A factor graph of points and lines, as `peer_export` writes it.
#pragma once

#include <string>

#include "solve.h"

namespace peer {

// Reads a graph and solves it.
void SolveGraph(const Request& request);

}  // namespace peer

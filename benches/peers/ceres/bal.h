// A problem of Bundle Adjustment in the Large.
#pragma once

#include "solve.h"

namespace peer {

// Reads a problem and solves it: poses, focal lengths, two coefficients of radial distortion and points; no loss.
void SolveBal(const Request& request);

}  // namespace peer

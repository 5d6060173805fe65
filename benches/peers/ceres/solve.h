// How a problem is solved, and what is told of it: cost over time as JSON.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <ceres/ceres.h>

namespace peer {

// What a run is asked for.
struct Request {
  // `graph`, `bal` or `pose-graph`.
  std::string kind;
  std::string path;
  // Linear solver: `sparse-schur`, `dense-schur`, `iterative-schur` or `normal-cholesky`.
  std::string solver = "sparse-schur";
  // Eliminated first: `landmarks`, `points` (lines stay with the poses) or `poses`.
  std::string eliminate = "landmarks";
  int threads = 1;
  int iterations = 100;
  // Wall time after which a run is ended.
  double seconds = std::numeric_limits<double>::infinity();
  // Cost at which a run is ended.
  double target = -std::numeric_limits<double>::infinity();
};

// A problem with the blocks that may be eliminated; it owns nothing of the numbers that it moves.
struct Posed {
  ceres::Problem problem;
  std::vector<double*> poses;
  std::vector<double*> points;
  std::vector<double*> lines;
};

// Solves a problem and prints one line of JSON:
//
//     {"peer": "ceres", "version", "initial_cost", "final_cost", "seconds", "ending", "iterations": [[seconds, cost], …]}
//
// Seconds are Ceres' own, since the call of `Solve`; of the iterations those that lowered the cost are told.
void SolveAndTell(const Request& request, Posed* posed);

}  // namespace peer

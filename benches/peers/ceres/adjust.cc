// Ceres on the graphs of `make bench-peers`; says cost over time as JSON (see solve.h).
//
//     ceres_peer KIND PATH [--solver S] [--eliminate E] [--threads N] [--iterations N] [--seconds S] [--target COST]

#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "bal.h"
#include "graph.h"
#include "pose_graph.h"
#include "solve.h"

namespace {

peer::Request Read(int count, char** words) {
  if (count < 3 || count % 2 == 0) {
    throw std::invalid_argument(
        "usage: ceres_peer graph|bal|pose-graph PATH [--solver S] [--eliminate E] [--threads N] [--iterations N] "
        "[--seconds S] [--target COST]");
  }
  peer::Request request;
  request.kind = words[1];
  request.path = words[2];
  for (int at = 3; at < count; at += 2) {
    const std::string option = words[at], value = words[at + 1];
    if (option == "--solver") {
      request.solver = value;
    } else if (option == "--eliminate") {
      request.eliminate = value;
    } else if (option == "--threads") {
      request.threads = std::stoi(value);
    } else if (option == "--iterations") {
      request.iterations = std::stoi(value);
    } else if (option == "--seconds") {
      request.seconds = std::stod(value);
    } else if (option == "--target") {
      request.target = std::stod(value);
    } else {
      throw std::invalid_argument("no option " + option);
    }
  }
  return request;
}

void Run(const peer::Request& request) {
  if (request.kind == "graph") {
    peer::SolveGraph(request);
  } else if (request.kind == "bal") {
    peer::SolveBal(request);
  } else if (request.kind == "pose-graph") {
    peer::SolvePoseGraph(request);
  } else {
    throw std::invalid_argument("kind: expected graph, bal or pose-graph; found " + request.kind);
  }
}

}  // namespace

int main(int count, char** words) {
  try {
    Run(Read(count, words));
  } catch (const std::exception& cause) {
    std::fprintf(stderr, "ceres_peer: %s\n", cause.what());
    return 1;
  }
  return 0;
}

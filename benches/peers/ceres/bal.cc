#include "bal.h"

#include <array>
#include <fstream>
#include <stdexcept>

#include "bal_cost.h"

namespace peer {

void SolveBal(const Request& request) {
  std::ifstream file(request.path);
  if (!file) throw std::runtime_error(request.path + ": cannot be opened");
  long cameras = 0, points = 0, views = 0;
  if (!(file >> cameras >> points >> views) || cameras <= 0 || points <= 0 || views <= 0) {
    throw std::runtime_error(request.path + ": expected numbers of cameras, points and observations");
  }
  std::vector<std::array<double, 9>> camera(cameras);
  std::vector<std::array<double, 3>> point(points);
  Posed posed;
  for (long row = 0; row < views; ++row) {
    long at = 0, of = 0;
    double u = 0.0, v = 0.0;
    if (!(file >> at >> of >> u >> v) || at < 0 || at >= cameras || of < 0 || of >= points) {
      throw std::runtime_error(request.path + ": observation " + std::to_string(row) + ": expected camera, point, x and y");
    }
    posed.problem.AddResidualBlock(new BalCost({u, v}), nullptr, camera[at].data(), point[of].data());
  }
  for (auto& block : camera) {
    for (double& number : block) file >> number;
    if (posed.problem.HasParameterBlock(block.data())) posed.poses.push_back(block.data());
  }
  for (auto& block : point) {
    for (double& number : block) file >> number;
    if (posed.problem.HasParameterBlock(block.data())) posed.points.push_back(block.data());
  }
  if (!file) throw std::runtime_error(request.path + ": ends before the last point");
  SolveAndTell(request, &posed);
}

}  // namespace peer

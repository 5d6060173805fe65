// Holds the analytic derivatives of every cost against differences, in the tangent space; fails with a word where one is off.

#include <cstdio>
#include <memory>
#include <vector>

#include <ceres/ceres.h>
#include <ceres/gradient_checker.h>

#include "bal_cost.h"
#include "relative_pose_cost.h"
#include "reprojection_cost.h"

namespace {

using PoseManifold = ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;
using LineManifold = ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<1>>;

bool Check(const char* name, const ceres::CostFunction& cost, std::vector<const ceres::Manifold*> manifolds,
           std::vector<std::vector<double>> numbers) {
  std::vector<const double*> parameters;
  for (const auto& block : numbers) parameters.push_back(block.data());
  ceres::NumericDiffOptions options;
  // A line's image bends within the usual first step.
  options.ridders_relative_initial_step_size = 1e-3;
  ceres::GradientChecker checker(&cost, &manifolds, options);
  ceres::GradientChecker::ProbeResults results;
  // Differences hold about seven digits here; a slip shows in the first.
  const bool good = checker.Probe(parameters.data(), 1e-5, &results);
  std::printf("%s: %s\n", name, good ? "derivatives as by differences" : results.error_log.c_str());
  return good;
}

std::vector<double> Unit(double x, double y, double z, double w, std::vector<double> rest) {
  Eigen::Quaterniond q(w, x, y, z);
  q.normalize();
  std::vector<double> all = {q.x(), q.y(), q.z(), q.w()};
  all.insert(all.end(), rest.begin(), rest.end());
  return all;
}

}  // namespace

int main() {
  const PoseManifold pose;
  const LineManifold line;
  const ceres::EuclideanManifold<3> three;
  const ceres::EuclideanManifold<9> nine;
  const peer::Camera camera{535.4, -539.2, 320.1, 247.6};
  const std::vector<double> at = Unit(0.11, -0.23, 0.31, 0.87, {0.4, -0.3, 0.8});
  const std::vector<double> other = Unit(-0.37, 0.12, 0.29, 0.83, {1.4, 0.7, -0.5});

  peer::RelativePoseCost::Matrix6 root = peer::RelativePoseCost::Matrix6::Identity() * 3.0;
  root(0, 4) = 0.7;
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.8, 0.3, -0.4, 0.2).normalized();
  Eigen::Matrix3d planar_root = Eigen::Matrix3d::Identity() * 2.0;
  planar_root(0, 2) = 0.3;
  const std::unique_ptr<ceres::CostFunction> prior(
      peer::PriorCost::Create({Eigen::Quaterniond(0.9, 0.1, 0.2, -0.1).normalized(), {0.3, 0.1, 0.2}, 1.0, 100.0}));

  bool good = true;
  good &= Check("point", peer::PointCost(camera, {300.0, 200.0}, 0.8), {&pose, &three}, {at, {0.5, -0.4, 3.0}});
  good &= Check("line", peer::LineCost(camera, {300.0, 200.0}, {340.0, 260.0}, 0.8), {&pose, &line},
                {at, Unit(0.5, 0.1, -0.4, 0.6, {0.7})});
  good &= Check("bal", peer::BalCost({20.0, -30.0}), {&nine, &three},
                {{0.1, -0.3, 0.2, 0.4, 0.1, -3.0, 500.0, -0.1, 0.02}, {0.5, -0.4, -2.0}});
  good &= Check("relative pose", peer::RelativePoseCost(turn, {1.03, 0.51, -0.27}, root), {&pose, &pose}, {at, other});
  good &= Check("planar pose", peer::PlanarPoseCost({1.0, 0.2, 0.3}, planar_root), {&three, &three},
                {{0.4, -0.3, 0.8}, {1.5, 0.6, 2.0}});
  good &= Check("prior", *prior, {&pose}, {at});
  return good ? 0 : 1;
}

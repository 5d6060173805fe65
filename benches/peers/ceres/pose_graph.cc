#include "pose_graph.h"

#include <array>
#include <map>

#include <Eigen/Cholesky>

#include "relative_pose_cost.h"
#include "text_file.h"

namespace peer {
namespace {

// Vertices by id; a map keeps them in place.
struct PoseGraph {
  std::map<long, std::array<double, 7>> poses;   // qx qy qz qw px py pz
  std::map<long, std::array<double, 3>> planar;  // x y θ
};

// W with WᵀW = information, of which the file has the upper triangle by rows.
template <int kSize>
Eigen::Matrix<double, kSize, kSize> ReadRoot(TextFile* file) {
  Eigen::Matrix<double, kSize, kSize> information;
  for (int row = 0; row < kSize; ++row) {
    for (int column = row; column < kSize; ++column) {
      information(row, column) = information(column, row) = file->Number();
    }
  }
  const Eigen::LLT<Eigen::Matrix<double, kSize, kSize>> cholesky(information);
  if (cholesky.info() != Eigen::Success) file->Fail("expected a positive definite information matrix");
  return cholesky.matrixU();
}

template <typename Vertices>
double* Find(const TextFile& file, Vertices* vertices, long id) {
  const auto found = vertices->find(id);
  if (found == vertices->end()) file.Fail("no vertex " + std::to_string(id));
  return found->second.data();
}

void ReadQuaternionPose(TextFile* file, Eigen::Vector3d* t, Eigen::Quaterniond* q) {
  for (int k = 0; k < 3; ++k) (*t)[k] = file->Number();
  for (int k = 0; k < 4; ++k) q->coeffs()[k] = file->Number();
  q->normalize();
}

void Read(const Request& request, PoseGraph* graph, ceres::Problem* problem) {
  TextFile file(request.path);
  std::string kind;
  while (file.Next(&kind)) {
    if (kind == "VERTEX_SE3:QUAT") {
      const long id = file.Id();
      Eigen::Vector3d t;
      Eigen::Quaterniond q;
      ReadQuaternionPose(&file, &t, &q);
      graph->poses[id] = {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
    } else if (kind == "VERTEX_SE2") {
      const long id = file.Id();
      const double x = file.Number(), y = file.Number(), angle = file.Number();
      graph->planar[id] = {x, y, angle};
    } else if (kind == "EDGE_SE3:QUAT") {
      double* a = Find(file, &graph->poses, file.Id());
      double* b = Find(file, &graph->poses, file.Id());
      Eigen::Vector3d t;
      Eigen::Quaterniond q;
      ReadQuaternionPose(&file, &t, &q);
      problem->AddResidualBlock(new RelativePoseCost(q, t, ReadRoot<6>(&file)), nullptr, a, b);
    } else if (kind == "EDGE_SE2") {
      double* a = Find(file, &graph->planar, file.Id());
      double* b = Find(file, &graph->planar, file.Id());
      const double x = file.Number(), y = file.Number(), angle = file.Number();
      problem->AddResidualBlock(new PlanarPoseCost({x, y, angle}, ReadRoot<3>(&file)), nullptr, a, b);
    } else {
      file.Fail("no kind of line `" + kind + "`");
    }
  }
  if (graph->poses.empty() == graph->planar.empty()) {
    throw std::runtime_error(request.path + ": expected vertices of one dimension");
  }
}

}  // namespace

void SolvePoseGraph(const Request& request) {
  PoseGraph graph;
  Posed posed;
  Read(request, &graph, &posed.problem);
  for (auto& [id, pose] : graph.poses) {
    if (!posed.problem.HasParameterBlock(pose.data())) continue;
    posed.problem.SetManifold(
        pose.data(), new ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>());
    posed.poses.push_back(pose.data());
  }
  for (auto& [id, pose] : graph.planar) {
    if (posed.problem.HasParameterBlock(pose.data())) posed.poses.push_back(pose.data());
  }
  // The first vertex by id is held.
  posed.problem.SetParameterBlockConstant(posed.poses.front());
  SolveAndTell(request, &posed);
}

}  // namespace peer

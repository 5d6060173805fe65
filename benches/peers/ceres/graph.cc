#include "graph.h"

#include <array>
#include <deque>
#include <memory>

#include "reprojection_cost.h"
#include "text_file.h"

namespace peer {
namespace {

using PoseManifold = ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;
using LineManifold = ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<1>>;

// Vertices keep their places in memory while a problem points at them.
struct Graph {
  std::vector<Camera> cameras;
  std::deque<std::array<double, 7>> poses;  // camera_from_world
  std::vector<size_t> camera_of_pose;
  std::deque<std::array<double, 3>> points;
  std::deque<std::array<double, 5>> lines;
  double sigma = 1.0;
  std::unique_ptr<ceres::LossFunction> loss;
};

// From world_from_camera, translation before rotation.
std::array<double, 7> ReadPose(TextFile* file) {
  const double x = file->Number(), y = file->Number(), z = file->Number();
  const double qx = file->Number(), qy = file->Number(), qz = file->Number(), qw = file->Number();
  const Eigen::Quaterniond inverse = Eigen::Quaterniond(qw, qx, qy, qz).normalized().conjugate();
  const Eigen::Vector3d t = -(inverse * Eigen::Vector3d(x, y, z));
  return {inverse.x(), inverse.y(), inverse.z(), inverse.w(), t.x(), t.y(), t.z()};
}

// From two points of the line.
std::array<double, 5> ReadLine(TextFile* file) {
  Eigen::Vector3d ends[2];
  for (auto& end : ends) {
    for (int k = 0; k < 3; ++k) end[k] = file->Number();
  }
  const Eigen::Vector3d direction = ends[1] - ends[0], moment = ends[0].cross(direction);
  Eigen::Matrix3d columns;
  columns.col(0) = moment.normalized();
  columns.col(1) = direction.normalized();
  // A moment of zero leaves the turn about the direction open.
  if (!(moment.norm() > 0.0)) columns.col(0) = columns.col(1).unitOrthogonal();
  columns.col(2) = columns.col(0).cross(columns.col(1));
  const Eigen::Quaterniond q(columns);
  return {q.x(), q.y(), q.z(), q.w(), std::atan2(direction.norm(), moment.norm())};
}

void Read(const Request& request, Graph* graph, Posed* posed) {
  TextFile file(request.path);
  ceres::Problem& problem = posed->problem;
  static PoseManifold pose_manifold;
  static LineManifold line_manifold;
  std::string kind;
  while (file.Next(&kind)) {
    if (kind == "loss") {
      const std::string name = file.Word();
      if (name != "cauchy") file.Fail("loss: expected cauchy; found " + name);
      graph->loss = std::make_unique<ceres::CauchyLoss>(file.Number());
    } else if (kind == "sigma") {
      graph->sigma = file.Number();
    } else if (kind == "cost") {
      // What it costs by the exporter's own reckoning; held against ours by whoever runs us.
    } else if (kind == "camera") {
      const double fx = file.Number(), fy = file.Number(), cx = file.Number(), cy = file.Number();
      graph->cameras.push_back({fx, fy, cx, cy});
    } else if (kind == "pose") {
      graph->camera_of_pose.push_back(file.Place(graph->cameras.size()));
      const std::string state = file.Word();
      double* pose = graph->poses.emplace_back(ReadPose(&file)).data();
      problem.AddParameterBlock(pose, 7, &pose_manifold);
      if (state == "held") {
        problem.SetParameterBlockConstant(pose);
      } else if (state != "free") {
        file.Fail("pose: expected free or held; found " + state);
      }
      posed->poses.push_back(pose);
    } else if (kind == "prior") {
      const size_t pose = file.Place(graph->poses.size());
      const double sigma_rotation = file.Number(), sigma_translation = file.Number();
      const auto& begun = graph->poses[pose];
      const PriorCost cost{Eigen::Quaterniond(begun[3], begun[0], begun[1], begun[2]),
                           Eigen::Vector3d(begun[4], begun[5], begun[6]), sigma_rotation, sigma_translation};
      problem.AddResidualBlock(PriorCost::Create(cost), nullptr, graph->poses[pose].data());
    } else if (kind == "point") {
      const double x = file.Number(), y = file.Number(), z = file.Number();
      double* point = graph->points.emplace_back(std::array<double, 3>{x, y, z}).data();
      problem.AddParameterBlock(point, 3);
      posed->points.push_back(point);
    } else if (kind == "line") {
      double* line = graph->lines.emplace_back(ReadLine(&file)).data();
      problem.AddParameterBlock(line, 5, &line_manifold);
      posed->lines.push_back(line);
    } else if (kind == "point-view") {
      const size_t pose = file.Place(graph->poses.size()), point = file.Place(graph->points.size());
      const double u = file.Number(), v = file.Number();
      const Camera& camera = graph->cameras[graph->camera_of_pose[pose]];
      problem.AddResidualBlock(new PointCost(camera, {u, v}, graph->sigma), graph->loss.get(),
                               graph->poses[pose].data(), graph->points[point].data());
    } else if (kind == "line-view") {
      const size_t pose = file.Place(graph->poses.size()), line = file.Place(graph->lines.size());
      const double u = file.Number(), v = file.Number(), other_u = file.Number(), other_v = file.Number();
      const Camera& camera = graph->cameras[graph->camera_of_pose[pose]];
      problem.AddResidualBlock(new LineCost(camera, {u, v}, {other_u, other_v}, graph->sigma), graph->loss.get(),
                               graph->poses[pose].data(), graph->lines[line].data());
    } else {
      file.Fail("no kind of line `" + kind + "`");
    }
  }
}

}  // namespace

void SolveGraph(const Request& request) {
  Graph graph;
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  Posed posed{ceres::Problem(options), {}, {}, {}};
  Read(request, &graph, &posed);
  SolveAndTell(request, &posed);
}

}  // namespace peer

#include "solve.h"

#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace peer {
namespace {

// Keeps cost over time, and ends a run at its target or its time.
class Watch : public ceres::IterationCallback {
 public:
  explicit Watch(const Request& request) : request_(request) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    const double seconds = summary.cumulative_time_in_seconds;
    if (summary.iteration == 0 || summary.step_is_successful) {
      costs_.emplace_back(seconds, summary.cost);
      if (summary.cost <= request_.target) {
        ending_ = "target";
        return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
      }
    }
    if (seconds > request_.seconds) {
      ending_ = "time";
      return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    }
    return ceres::SOLVER_CONTINUE;
  }

  const std::vector<std::pair<double, double>>& costs() const { return costs_; }

  const char* Ending(ceres::TerminationType type) const {
    if (ending_ != nullptr) return ending_;
    switch (type) {
      case ceres::CONVERGENCE:
        return "converged";
      case ceres::NO_CONVERGENCE:
        return "iterations";
      default:
        return "failed";
    }
  }

 private:
  const Request& request_;
  const char* ending_ = nullptr;
  std::vector<std::pair<double, double>> costs_;
};

ceres::LinearSolverType SolverType(const std::string& name) {
  if (name == "sparse-schur") return ceres::SPARSE_SCHUR;
  if (name == "dense-schur") return ceres::DENSE_SCHUR;
  if (name == "iterative-schur") return ceres::ITERATIVE_SCHUR;
  if (name == "normal-cholesky") return ceres::SPARSE_NORMAL_CHOLESKY;
  throw std::invalid_argument("solver: expected sparse-schur, dense-schur, iterative-schur or normal-cholesky; found " + name);
}

std::shared_ptr<ceres::ParameterBlockOrdering> Ordering(const std::string& eliminate, const Posed& posed) {
  int points = 1, lines = 1, poses = 1;
  if (eliminate == "landmarks") {
    points = lines = 0;
  } else if (eliminate == "points") {
    points = 0;
  } else if (eliminate == "poses") {
    poses = 0;
  } else {
    throw std::invalid_argument("eliminate: expected landmarks, points or poses; found " + eliminate);
  }
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (double* block : posed.points) ordering->AddElementToGroup(block, points);
  for (double* block : posed.lines) ordering->AddElementToGroup(block, lines);
  for (double* block : posed.poses) ordering->AddElementToGroup(block, poses);
  return ordering;
}

}  // namespace

void SolveAndTell(const Request& request, Posed* posed) {
  ceres::Solver::Options options;
  options.linear_solver_type = SolverType(request.solver);
  options.preconditioner_type = ceres::SCHUR_JACOBI;
  if (options.linear_solver_type != ceres::SPARSE_NORMAL_CHOLESKY) {
    options.linear_solver_ordering = Ordering(request.eliminate, *posed);
  }
  options.num_threads = request.threads;
  options.max_num_iterations = request.iterations;
  // The target decides when a run is timed; without one the least cost is wanted, to more digits than a target has.
  options.function_tolerance = 1e-12;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  options.max_num_consecutive_invalid_steps = 20;
  options.logging_type = ceres::SILENT;
  Watch watch(request);
  options.callbacks.push_back(&watch);

  ceres::Solver::Summary summary;
  ceres::Solve(options, &posed->problem, &summary);

  if (watch.costs().empty() || !std::isfinite(summary.initial_cost)) {
    throw std::runtime_error(request.path + ": Ceres: " + summary.message);
  }
  std::printf("{\"peer\": \"ceres\", \"version\": \"%s\", \"initial_cost\": %.17g, \"final_cost\": %.17g, \"seconds\": %.9g, ",
              CERES_VERSION_STRING, summary.initial_cost, summary.final_cost, summary.total_time_in_seconds);
  std::printf("\"ending\": \"%s\", \"iterations\": [", watch.Ending(summary.termination_type));
  const char* comma = "";
  for (const auto& [seconds, cost] : watch.costs()) {
    std::printf("%s[%.9g, %.17g]", comma, seconds, cost);
    comma = ", ";
  }
  std::printf("]}\n");
}

}  // namespace peer

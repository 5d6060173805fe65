// Residual of a point in a camera of Bundle Adjustment in the Large, with its derivatives.
#pragma once

#include <cmath>

#include <ceres/ceres.h>

#include "tangent.h"

namespace peer {

// P = R X + t, p = −P.xy/P.z, r = f (1 + k₁ |p|² + k₂ |p|⁴) p − measured; a camera is `[ω t f k₁ k₂]` with R = Exp(ω).
//
// Source: the page of Bundle Adjustment in the Large.
class BalCost final : public ceres::SizedCostFunction<2, 9, 3> {
 public:
  explicit BalCost(const Eigen::Vector2d& pixel) : pixel_(pixel) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double* camera = parameters[0];
    const Eigen::Map<const Eigen::Vector3d> omega(camera), t(camera + 3), point(parameters[1]);
    const double f = camera[6], k1 = camera[7], k2 = camera[8];
    const double square = omega.squaredNorm();
    // R = I + a [ω]ₓ + b [ω]ₓ², and the right Jacobian I − b [ω]ₓ + c [ω]ₓ².
    double a = 1.0, b = 0.5, c = 1.0 / 6.0;
    if (square > 1e-12) {
      const double angle = std::sqrt(square);
      a = std::sin(angle) / angle;
      b = (1.0 - std::cos(angle)) / square;
      c = (1.0 - a) / square;
    }
    const Eigen::Matrix3d cross = Cross(omega), cross_twice = cross * cross;
    const Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity() + a * cross + b * cross_twice;
    const Eigen::Vector3d seen = rotation * point + t;
    const double inverse = -1.0 / seen.z();
    const Eigen::Vector2d p = seen.head<2>() * inverse;
    const double radius = p.squaredNorm();
    const double distortion = 1.0 + radius * (k1 + k2 * radius);
    Eigen::Map<Eigen::Vector2d> residual(residuals);
    residual = f * distortion * p - pixel_;
    if (jacobians == nullptr) return true;
    // ∂(d p)/∂p = d I + 2 (k₁ + 2 k₂ |p|²) p pᵀ, ∂p/∂P = −1/P.z [I, p]
    const Eigen::Matrix2d by_p =
        f * (distortion * Eigen::Matrix2d::Identity() + 2.0 * (k1 + 2.0 * k2 * radius) * p * p.transpose());
    Eigen::Matrix<double, 2, 3> by_seen;
    by_seen.leftCols<2>() = inverse * by_p;
    by_seen.col(2) = inverse * by_p * p;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 9, Eigen::RowMajor>> by_camera(jacobians[0]);
      const Eigen::Matrix3d right = Eigen::Matrix3d::Identity() - b * cross + c * cross_twice;
      by_camera.leftCols<3>() = -by_seen * rotation * Cross(point) * right;
      by_camera.middleCols<3>(3) = by_seen;
      by_camera.col(6) = distortion * p;
      by_camera.col(7) = f * radius * p;
      by_camera.col(8) = f * radius * radius * p;
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> by_point(jacobians[1]);
      by_point = by_seen * rotation;
    }
    return true;
  }

 private:
  Eigen::Vector2d pixel_;
};

}  // namespace peer

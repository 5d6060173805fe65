// Residuals of points and lines in pixels, with their derivatives.
//
// A pose is camera_from_world, `[qx qy qz qw tx ty tz]`; a line is its orthonormal form, `[qx qy qz qw φ]`: the columns
// u₁, u₂ of the rotation are the directions of its moment and of itself, `moment = cos φ u₁`, `direction = sin φ u₂`.
#pragma once

#include <cmath>

#include <ceres/ceres.h>

#include "tangent.h"

namespace peer {

// u = fx x/z + cx, v = fy y/z + cy, pixels.
struct Camera {
  double fx, fy, cx, cy;
};

// r = (projection − measured) / σ
class PointCost final : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  PointCost(const Camera& camera, const Eigen::Vector2d& pixel, double sigma)
      : camera_(camera), pixel_(pixel), weight_(1.0 / sigma) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> t(parameters[0] + 4), point(parameters[1]);
    const Eigen::Matrix3d rotation = q.toRotationMatrix();
    const Eigen::Vector3d turned = rotation * point;
    const Eigen::Vector3d p = turned + t;
    const double inverse = 1.0 / p.z();
    residuals[0] = weight_ * (camera_.fx * p.x() * inverse + camera_.cx - pixel_.x());
    residuals[1] = weight_ * (camera_.fy * p.y() * inverse + camera_.cy - pixel_.y());
    if (jacobians == nullptr) return true;
    const double a = weight_ * camera_.fx * inverse, b = weight_ * camera_.fy * inverse;
    Eigen::Matrix<double, 2, 3> by_p;
    by_p << a, 0, -a * p.x() * inverse, 0, b, -b * p.y() * inverse;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> by_pose(jacobians[0]);
      by_pose.leftCols<4>() = ByQuaternion<2>(-by_p * Cross(turned), q);
      by_pose.rightCols<3>() = by_p;
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> by_point(jacobians[1]);
      by_point = by_p * rotation;
    }
    return true;
  }

 private:
  Camera camera_;
  Eigen::Vector2d pixel_;
  double weight_;
};

// r = distances of both measured ends from the image of the line / σ
class LineCost final : public ceres::SizedCostFunction<2, 7, 5> {
 public:
  LineCost(const Camera& camera, const Eigen::Vector2d& start, const Eigen::Vector2d& end, double sigma)
      : camera_(camera), ends_{start, end}, weight_(1.0 / sigma) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]), frame(parameters[1]);
    const Eigen::Map<const Eigen::Vector3d> t(parameters[0] + 4);
    const Eigen::Matrix3d rotation = q.toRotationMatrix(), columns = frame.toRotationMatrix();
    const double cosine = std::cos(parameters[1][4]), sine = std::sin(parameters[1][4]);
    const Eigen::Vector3d moment = cosine * columns.col(0), direction = sine * columns.col(1);
    // The moment in the camera: R n + t × R d.
    const Eigen::Vector3d turned_moment = rotation * moment, turned_direction = rotation * direction;
    const Eigen::Vector3d n = turned_moment + t.cross(turned_direction);
    // The image line l = K̃ n.
    const auto& [fx, fy, cx, cy] = camera_;
    double l0 = fy * n.x(), l1 = fx * n.y(), l2 = fx * fy * n.z() - cx * l0 - cy * l1;
    const double length = std::sqrt(l0 * l0 + l1 * l1);
    if (!(length > 0.0)) return false;
    const double inverse = 1.0 / length;
    l0 *= inverse, l1 *= inverse, l2 *= inverse;
    Eigen::Matrix<double, 2, 3> by_n;
    for (int k = 0; k < 2; ++k) {
      const double distance = l0 * ends_[k].x() + l1 * ends_[k].y() + l2;
      residuals[k] = weight_ * distance;
      const double scale = weight_ * inverse;
      const double by_l0 = (ends_[k].x() - distance * l0) * scale, by_l1 = (ends_[k].y() - distance * l1) * scale;
      by_n(k, 0) = fy * (by_l0 - cx * scale);
      by_n(k, 1) = fx * (by_l1 - cy * scale);
      by_n(k, 2) = fx * fy * scale;
    }
    if (jacobians == nullptr) return true;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>> by_pose(jacobians[0]);
      const Eigen::Matrix3d by_turn = -Cross(turned_moment) - Cross(t) * Cross(turned_direction);
      by_pose.leftCols<4>() = ByQuaternion<2>(by_n * by_turn, q);
      by_pose.rightCols<3>() = -by_n * Cross(turned_direction);
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 5, Eigen::RowMajor>> by_line(jacobians[1]);
      const Eigen::Matrix<double, 2, 3> by_moment = by_n * rotation, by_direction = by_n * Cross(t) * rotation;
      by_line.leftCols<4>() = ByQuaternion<2>(-by_moment * Cross(moment) - by_direction * Cross(direction), frame);
      by_line.col(4) = -sine * by_moment * columns.col(0) + cosine * by_direction * columns.col(1);
    }
    return true;
  }

 private:
  Camera camera_;
  Eigen::Vector2d ends_[2];
  double weight_;
};

// What keeps a pose near where it began: ξ of Exp(ξ) = camera_from_world · world_from_camera₀, over its standard deviations.
//
// Few graphs have one, and those few; its derivatives are Ceres' own.
struct PriorCost {
  Eigen::Quaterniond rotation;  // camera_from_world at the start
  Eigen::Vector3d translation;
  double sigma_rotation, sigma_translation;

  static ceres::CostFunction* Create(const PriorCost& cost) {
    return new ceres::AutoDiffCostFunction<PriorCost, 6, 7>(new PriorCost(cost));
  }

  template <typename T>
  bool operator()(const T* pose, T* residuals) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Eigen::Map<const Eigen::Quaternion<T>> q(pose);
    const Eigen::Map<const Vector> t(pose + 4);
    // D = T T₀⁻¹
    const Eigen::Quaternion<T> turn = q * rotation.conjugate().cast<T>();
    const Vector shift = t - turn * translation.cast<T>();
    Vector axis = turn.vec();
    T w = turn.w();
    if (w < T(0)) {
      axis = -axis;
      w = -w;
    }
    // ω = 2 atan2(|v|, w) v/|v|, and V⁻¹ = I − ½ [ω]ₓ + (1 − θ/2 cot(θ/2))/θ² [ω]ₓ².
    const T square = axis.squaredNorm();
    T scale = T(2) / w, second = T(1.0 / 12.0);
    if (square > T(1e-12)) {
      const T norm = sqrt(square), angle = T(2) * atan2(norm, w);
      scale = angle / norm;
      second = (T(1) - T(0.5) * angle * w / norm) / (angle * angle);
    }
    const Vector omega = scale * axis;
    const Vector across = omega.cross(shift);
    const Vector rho = shift - T(0.5) * across + second * omega.cross(across);
    for (int k = 0; k < 3; ++k) {
      residuals[k] = omega[k] / T(sigma_rotation);
      residuals[3 + k] = rho[k] / T(sigma_translation);
    }
    return true;
  }
};

}  // namespace peer

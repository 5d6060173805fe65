// Residuals of relative poses, with their derivatives.
#pragma once

#include <cmath>

#include <ceres/ceres.h>

#include "tangent.h"

namespace peer {

// r = W [t; 2 vec q] with (t, q) = Z⁻¹ Xₐ⁻¹ X_b and the measured pose Z of b in a; a pose is `[qx qy qz qw px py pz]`.
//
// WᵀW is the information. Source: the error of g2o's EDGE_SE3:QUAT, with twice the quaternion, so that it is radians.
class RelativePoseCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  RelativePoseCost(const Eigen::Quaterniond& q, const Eigen::Vector3d& t, const Matrix6& root)
      : inverse_(q.conjugate()), t_(t), root_(root) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> qa(parameters[0]), qb(parameters[1]);
    const Eigen::Map<const Eigen::Vector3d> pa(parameters[0] + 4), pb(parameters[1] + 4);
    const Eigen::Vector3d between = pb - pa;
    // Z⁻¹ Xₐ⁻¹, its rotation.
    const Eigen::Quaterniond from_world = inverse_ * qa.conjugate();
    const Eigen::Matrix3d rotation = from_world.toRotationMatrix();
    const Eigen::Quaterniond error = from_world * qb;
    Eigen::Matrix<double, 6, 1> plain;
    plain << rotation * between - inverse_ * t_, 2.0 * error.vec();
    Eigen::Map<Eigen::Matrix<double, 6, 1>> residual(residuals);
    residual = root_ * plain;
    if (jacobians == nullptr) return true;
    // With Exp(ω) q_b the error is Exp(R ω) q, and 2 vec(Exp(η) q) moves by (w I − [v]ₓ) η; of a with the other sign.
    const Eigen::Matrix3d by_turn = (error.w() * Eigen::Matrix3d::Identity() - Cross(error.vec())) * rotation;
    for (int which = 0; which < 2; ++which) {
      if (jacobians[which] == nullptr) continue;
      const bool is_a = which == 0;
      Eigen::Matrix<double, 6, 3> by_rotation;
      by_rotation.topRows<3>() = is_a ? Eigen::Matrix3d(rotation * Cross(between)) : Eigen::Matrix3d::Zero();
      by_rotation.bottomRows<3>() = is_a ? Eigen::Matrix3d(-by_turn) : by_turn;
      Eigen::Matrix<double, 6, 7> by_pose;
      by_pose.leftCols<4>() = ByQuaternion<6>(by_rotation, is_a ? qa : qb);
      by_pose.topRightCorner<3, 3>() = is_a ? Eigen::Matrix3d(-rotation) : rotation;
      by_pose.bottomRightCorner<3, 3>().setZero();
      Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> jacobian(jacobians[which]);
      jacobian = root_ * by_pose;
    }
    return true;
  }

 private:
  Eigen::Quaterniond inverse_;
  Eigen::Vector3d t_;
  Matrix6 root_;
};

// r = W [x y θ] of Z⁻¹ Xₐ⁻¹ X_b, the angle wrapped; a pose is `[x y θ]`.
//
// Source: the error of g2o's EDGE_SE2.
class PlanarPoseCost final : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  PlanarPoseCost(const Eigen::Vector3d& measured, const Eigen::Matrix3d& root) : measured_(measured), root_(root) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> a(parameters[0]), b(parameters[1]);
    const Eigen::Matrix2d of_a = Inverse(a.z()), of_measured = Inverse(measured_.z()), both = of_measured * of_a;
    const Eigen::Vector2d seen = of_a * (b - a).head<2>();
    const Eigen::Vector2d shift = of_measured * (seen - measured_.head<2>());
    const double turn = std::remainder(b.z() - a.z() - measured_.z(), 2.0 * M_PI);
    Eigen::Map<Eigen::Vector3d> residual(residuals);
    residual = root_ * Eigen::Vector3d(shift.x(), shift.y(), turn);
    if (jacobians == nullptr) return true;
    Eigen::Matrix3d by_b = Eigen::Matrix3d::Identity();
    by_b.topLeftCorner<2, 2>() = both;
    if (jacobians[0] != nullptr) {
      Eigen::Matrix3d by_a = -by_b;
      by_a.topRightCorner<2, 1>() = of_measured * Eigen::Vector2d(seen.y(), -seen.x());
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> jacobian(jacobians[0]);
      jacobian = root_ * by_a;
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> jacobian(jacobians[1]);
      jacobian = root_ * by_b;
    }
    return true;
  }

 private:
  static Eigen::Matrix2d Inverse(double angle) {
    const double cosine = std::cos(angle), sine = std::sin(angle);
    Eigen::Matrix2d matrix;
    matrix << cosine, sine, -sine, cosine;
    return matrix;
  }

  Eigen::Vector3d measured_;
  Eigen::Matrix3d root_;
};

}  // namespace peer

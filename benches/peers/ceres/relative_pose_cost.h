// Residuals of relative poses, with their derivatives.
#pragma once

#include <cmath>

#include <ceres/ceres.h>

#include "tangent.h"

namespace peer {

// r = W [ Rₐᵀ (p_b − pₐ) − t ; 2 vec(q q_b⁻¹ qₐ) ] with the measured pose (q, t) of b in a; a pose is `[qx qy qz qw px py pz]`.
//
// Source: the residual of Ceres' own example of pose graphs; WᵀW is the information.
class RelativePoseCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  RelativePoseCost(const Eigen::Quaterniond& q, const Eigen::Vector3d& t, const Matrix6& root) : q_(q), t_(t), root_(root) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> qa(parameters[0]), qb(parameters[1]);
    const Eigen::Map<const Eigen::Vector3d> pa(parameters[0] + 4), pb(parameters[1] + 4);
    const Eigen::Matrix3d inverse = qa.toRotationMatrix().transpose();
    const Eigen::Vector3d between = pb - pa;
    const Eigen::Quaterniond measured_b = q_ * qb.conjugate();
    const Eigen::Quaterniond error = measured_b * qa;
    Eigen::Matrix<double, 6, 1> plain;
    plain << inverse * between - t_, 2.0 * error.vec();
    Eigen::Map<Eigen::Matrix<double, 6, 1>> residual(residuals);
    residual = root_ * plain;
    if (jacobians == nullptr) return true;
    // With ω in Exp(ω) of a pose's rotation: q q_b⁻¹ Exp(ω) qₐ = Exp(R ω) e, R of q q_b⁻¹, and vec(Exp(η) e) moves by
    // ½ (w I − [v]ₓ) η; of b the same with the other sign.
    const Eigen::Matrix3d by_turn =
        (error.w() * Eigen::Matrix3d::Identity() - Cross(error.vec())) * measured_b.toRotationMatrix();
    for (int which = 0; which < 2; ++which) {
      if (jacobians[which] == nullptr) continue;
      Eigen::Matrix<double, 6, 3> by_rotation;
      by_rotation.topRows<3>() = which == 0 ? Eigen::Matrix3d(inverse * Cross(between)) : Eigen::Matrix3d::Zero();
      by_rotation.bottomRows<3>() = which == 0 ? by_turn : Eigen::Matrix3d(-by_turn);
      Eigen::Matrix<double, 6, 7> by_pose;
      by_pose.leftCols<4>() = ByQuaternion<6>(by_rotation, which == 0 ? qa : qb);
      by_pose.topRightCorner<3, 3>() = which == 0 ? Eigen::Matrix3d(-inverse) : inverse;
      by_pose.bottomRightCorner<3, 3>().setZero();
      Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> jacobian(jacobians[which]);
      jacobian = root_ * by_pose;
    }
    return true;
  }

 private:
  Eigen::Quaterniond q_;
  Eigen::Vector3d t_;
  Matrix6 root_;
};

// r = W [ Rₐᵀ (p_b − pₐ) − t ; θ_b − θₐ − θ wrapped to (−π, π] ]; a pose is `[x y θ]`.
class PlanarPoseCost final : public ceres::SizedCostFunction<3, 3, 3> {
 public:
  PlanarPoseCost(const Eigen::Vector3d& measured, const Eigen::Matrix3d& root) : measured_(measured), root_(root) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> a(parameters[0]), b(parameters[1]);
    const double cosine = std::cos(a.z()), sine = std::sin(a.z());
    Eigen::Matrix2d inverse;
    inverse << cosine, sine, -sine, cosine;
    const Eigen::Vector2d seen = inverse * (b - a).head<2>();
    const double turn = std::remainder(b.z() - a.z() - measured_.z(), 2.0 * M_PI);
    Eigen::Map<Eigen::Vector3d> residual(residuals);
    residual = root_ * Eigen::Vector3d(seen.x() - measured_.x(), seen.y() - measured_.y(), turn);
    if (jacobians == nullptr) return true;
    Eigen::Matrix3d by_b = Eigen::Matrix3d::Identity();
    by_b.topLeftCorner<2, 2>() = inverse;
    if (jacobians[0] != nullptr) {
      Eigen::Matrix3d by_a = -by_b;
      by_a(0, 2) = seen.y();
      by_a(1, 2) = -seen.x();
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
  Eigen::Vector3d measured_;
  Eigen::Matrix3d root_;
};

}  // namespace peer

// Derivatives by a quaternion from derivatives by a rotation.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace peer {

// [v]ₓ
inline Eigen::Matrix3d Cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

// The derivative by a unit quaternion (x, y, z, w) of what changes by `by_rotation` with ω in Exp(ω) q.
//
// EigenQuaternionManifold steps by δ with ω = 2 δ; its derivative P of q by δ has orthonormal columns, so that
// J = 2 by_rotation Pᵀ is right in the tangent space: J P = 2 by_rotation.
template <int kRows>
Eigen::Matrix<double, kRows, 4> ByQuaternion(const Eigen::Matrix<double, kRows, 3>& by_rotation,
                                             const Eigen::Quaterniond& q) {
  Eigen::Matrix<double, 4, 3> by_step;
  by_step << q.w(), q.z(), -q.y(),   //
      -q.z(), q.w(), q.x(),          //
      q.y(), -q.x(), q.w(),          //
      -q.x(), -q.y(), -q.z();
  return 2.0 * by_rotation * by_step.transpose();
}

}  // namespace peer

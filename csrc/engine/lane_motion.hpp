// What follows the velocity iterations, in lanes: integrating and correcting the poses, and moving
// the bodies there. Compiled once per instruction set (see simd/kernel_target.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "engine/body.hpp"
#include "engine/joint_constants.hpp"
#include "engine/joint_position_solver.hpp"
#include "engine/kernel.hpp"
#include "engine/lane_rows.hpp"
#include "engine/lanes.hpp"
#include "engine/motion.hpp"
#include "engine/velocity_constraints.hpp"
#include "simd/kernel_target.hpp"

namespace touchdown::engine::TOUCHDOWN_KERNEL {
namespace {

inline constexpr std::size_t kBodyFloats = sizeof(std::array<Body, kNumBodies>) / sizeof(float);

// The same part of each lander; spare lanes repeat the first one's.
template <int W, typename Part>
auto rows_of(std::span<Moving> items, const Part& part) {
  Rows<W, float> rows;
  for (std::size_t i = 0; i < W; ++i) {
    rows[i] = reinterpret_cast<float*>(part(items[i < items.size() ? i : 0]));
  }
  return rows;
}

template <int W>
Rows<W, const float> read_only(const Rows<W, float>& rows) {
  Rows<W, const float> same;
  for (std::size_t i = 0; i < W; ++i) same[i] = rows[i];
  return same;
}

template <int W>
void integrate_few(std::span<Moving> items, const Model& model) {
  using F = Floats<W>;
  const auto velocity_rows =
      rows_of<W>(items, [](const Moving& item) { return &item.constraints->velocities; });
  const auto pose_rows =
      rows_of<W>(items, [](const Moving& item) { return &item.constraints->poses; });
  BasicVelocities<F> velocities;
  BasicPoses<F> poses;
  std::array<BasicJointConstraint<F>, kNumLegs> joints;
  load_rows<kVelocityFloats, W>(&velocities, read_only<W>(velocity_rows));
  load_rows<kPoseFloats, W>(&poses, read_only<W>(pose_rows));
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    const auto rows = rows_of<W>(
        items, [i](const Moving& item) { return changing_floats(item.constraints->joints[i]); });
    load_rows<kChangingFloats, W>(changing_floats(joints[i]), read_only<W>(rows));
    joints[i].leg = kUsualLegs[i];
    set_masses(joints[i], model.shapes[kHull],
               model.shapes[static_cast<std::size_t>(joints[i].leg)]);
  }
  typename Lanes<W>::Bits flies{};
  for (std::size_t i = 0; i < items.size(); ++i) {
    const VelocityConstraints& constraints = *items[i].constraints;
    if (constraints.num_contacts == 0 && constraints.joints[0].leg == kUsualLegs[0]) flies[i] = -1;
  }

  for (std::size_t i = 0; i < kNumBodies; ++i) {
    integrate(poses[i], velocities[i], broadcast<F>(kTimeStep));
  }
  const BasicPoses<F> integrated = poses;
  auto corrected = flies;
  for (const auto& joint : joints) {
    corrected &= solve_position_constraint(
        joint, model.joints[static_cast<std::size_t>(joint.leg - kLeg0)], poses);
  }
  for (std::size_t i = 0; i < kNumBodies; ++i) {
    poses[i].center = select(flies, poses[i].center, integrated[i].center);
    poses[i].angle = flies ? poses[i].angle : integrated[i].angle;
  }

  store_rows<kVelocityFloats, W>(&velocities, velocity_rows, items.size());
  store_rows<kPoseFloats, W>(&poses, pose_rows, items.size());
  for (std::size_t i = 0; i < items.size(); ++i) {
    items[i].iterations = flies[i] != 0 ? 1 : 0;
    items[i].corrected = corrected[i] != 0;
  }
}

template <int W>
void place_few(std::span<Moving> items, const Model& model) {
  using F = Floats<W>;
  const auto velocity_rows =
      rows_of<W>(items, [](const Moving& item) { return &item.constraints->velocities; });
  const auto pose_rows =
      rows_of<W>(items, [](const Moving& item) { return &item.constraints->poses; });
  const auto body_rows = rows_of<W>(items, [](const Moving& item) { return item.bodies; });
  BasicVelocities<F> velocities;
  BasicPoses<F> poses;
  std::array<BasicBody<F>, kNumBodies> bodies;
  load_rows<kVelocityFloats, W>(&velocities, read_only<W>(velocity_rows));
  load_rows<kPoseFloats, W>(&poses, read_only<W>(pose_rows));
  load_rows<kBodyFloats, W>(&bodies, read_only<W>(body_rows));
  for (std::size_t i = 0; i < kNumBodies; ++i) {
    move_to(bodies[i], model.shapes[i], poses[i], velocities[i]);
    update_sleep_time(bodies[i]);
  }
  store_rows<kBodyFloats, W>(&bodies, body_rows, items.size());
}

// Calls `work` with as many items as there are lanes, again and again.
template <int W, typename Work>
void in_lanes(std::span<Moving> items, const Work& work) {
  while (!items.empty()) {
    const std::size_t count = items.size() < W ? items.size() : W;
    work(items.first(count));
    items = items.subspan(count);
  }
}

template <int W>
void integrate(std::span<Moving> items, const Model& model) {
  in_lanes<W>(items, [&](std::span<Moving> few) { integrate_few<W>(few, model); });
}

template <int W>
void place(std::span<Moving> items, const Model& model) {
  in_lanes<W>(items, [&](std::span<Moving> few) { place_few<W>(few, model); });
}

}  // namespace
}  // namespace touchdown::engine::TOUCHDOWN_KERNEL

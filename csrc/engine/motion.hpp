// What the solver moves: the pose and the velocity of each body, apart from everything else.
//
// Box2D: b2Position, b2Velocity, and the integration in b2Island::Solve.
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

#include "engine/lane_rotation.hpp"
#include "engine/lanes.hpp"
#include "engine/math.hpp"
#include "engine/settings.hpp"
#include "engine/velocity_constraints.hpp"

namespace touchdown::engine {

template <typename F>
struct BasicPose {
  Vec<F> center;
  F angle;
  // The last rotation computed. Iterations often return to an angle, and the C library's sine costs
  // as much as all the rest of an iteration.
  F cached_angle;
  BasicRotation<F> cached_rotation;
};
using Pose = BasicPose<float>;

inline Pose pose_at(Vec2 center, float angle, Rotation rotation) {
  return {center, angle, angle, rotation};
}

template <typename F>
inline BasicRotation<F> rotation(BasicPose<F>& pose) {
  // Equal floats have equal sines, except for the two zeros.
  const auto stale = pose.angle != pose.cached_angle || pose.angle == 0.0f;
  if (!any(stale)) return pose.cached_rotation;
  if constexpr (std::is_same_v<F, float>) {
    pose.cached_rotation = rotation(pose.angle);
  } else {
    pose.cached_rotation = lane_rotation(pose.angle);  // equal angles have equal rotations
  }
  pose.cached_angle = pose.angle;
  return pose.cached_rotation;
}

// The body's transform; `local_center` is its centre of mass in its own coordinates.
template <typename F>
inline BasicTransform<F> transform_of(BasicPose<F>& pose, Vec<F> local_center) {
  const BasicRotation<F> q = rotation(pose);
  return transform_about(pose.center, q, local_center);
}

template <typename F>
using BasicPoses = std::array<BasicPose<F>, kNumBodies>;
using Poses = BasicPoses<float>;
inline constexpr std::size_t kPoseFloats = sizeof(Poses) / sizeof(float);
using Velocity = BasicVelocity<float>;
using Velocities = BasicVelocities<float>;

// All that the velocity iterations of one environment need; in lanes, the joints' constraints are
// made of the poses.
struct VelocityConstraints : BasicVelocityConstraints<float> {
  Poses poses;
  std::array<float, 16> padding;  // whole vectors are read, the last one beyond the poses
};

// Moves a body for `time` seconds. A body too fast for the solver is slowed down first.
template <typename F>
inline void integrate(BasicPose<F>& pose, BasicVelocity<F>& velocity, F time) {
  const Vec<F> translation = time * velocity.linear;
  const auto too_fast = dot(translation, translation) > kMaxTranslation * kMaxTranslation;
  if (any(too_fast)) {
    const F ratio = kMaxTranslation / length(translation);
    velocity.linear = select(too_fast, ratio * velocity.linear, velocity.linear);
  }
  const F rotation = time * velocity.angular;
  const auto turns_too_fast = rotation * rotation > kMaxRotation * kMaxRotation;
  if (any(turns_too_fast)) {
    const F slower = velocity.angular * (kMaxRotation / magnitude(rotation));
    velocity.angular = turns_too_fast ? slower : velocity.angular;
  }
  pose.center += time * velocity.linear;
  pose.angle += time * velocity.angular;
}

}  // namespace touchdown::engine

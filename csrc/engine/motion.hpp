// What the solver moves: the pose and the velocity of each body, apart from everything else.
//
// Box2D: b2Position, b2Velocity, and the integration in b2Island::Solve.
#pragma once

#include <array>

#include "engine/math.hpp"
#include "engine/settings.hpp"
#include "engine/velocity_constraints.hpp"

namespace touchdown::engine {

struct Pose {
  Vec2 center;
  float angle;
  // The last rotation computed. Iterations often return to an angle, and a sine costs as much as
  // all the rest of an iteration.
  float cached_angle;
  Rotation cached_rotation;
};

inline Pose pose_at(Vec2 center, float angle, Rotation rotation) {
  return {center, angle, angle, rotation};
}

inline Rotation rotation(Pose& pose) {
  // Equal floats have equal sines, except for the two zeros.
  if (pose.angle != pose.cached_angle || pose.angle == 0.0f) {
    pose.cached_angle = pose.angle;
    pose.cached_rotation = rotation(pose.angle);
  }
  return pose.cached_rotation;
}

// The body's transform; `local_center` is its centre of mass in its own coordinates.
inline Transform transform_of(Pose& pose, Vec2 local_center) {
  const Rotation q = rotation(pose);
  return transform_about(pose.center, q, local_center);
}

using Poses = std::array<Pose, kNumBodies>;
using Velocity = BasicVelocity<float>;
using Velocities = BasicVelocities<float>;

// Moves a body for `time` seconds. A body too fast for the solver is slowed down first.
inline void integrate(Pose& pose, Velocity& velocity, float time) {
  const Vec2 translation = time * velocity.linear;
  if (dot(translation, translation) > kMaxTranslation * kMaxTranslation) {
    const float ratio = kMaxTranslation / length(translation);
    velocity.linear = ratio * velocity.linear;
  }
  const float rotation = time * velocity.angular;
  if (rotation * rotation > kMaxRotation * kMaxRotation) {
    velocity.angular *= kMaxRotation / magnitude(rotation);
  }
  pose.center += time * velocity.linear;
  pose.angle += time * velocity.angular;
}

}  // namespace touchdown::engine

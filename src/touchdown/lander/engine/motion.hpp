// What the solver works on: where a body is and how it moves, apart from everything else.
#pragma once

#include <array>

#include "layout.hpp"
#include "math.hpp"
#include "rows.hpp"

namespace touchdown {

struct Pose {
  Vec2 center;
  float angle;
  // The last rotation that was asked for: iterations often come back to an angle, and a sine costs
  // as much as all else that they do with it.
  float turned_angle;
  Rotation turned;
};

inline Pose pose_at(Vec2 center, float angle, Rotation turned) {
  return {center, angle, angle, turned};
}

inline Rotation rotation(Pose& pose) {
  // Equal floats have equal sines, but for the two zeros.
  if (pose.angle != pose.turned_angle || pose.angle == 0.0f) {
    pose.turned_angle = pose.angle;
    pose.turned = rotation(pose.angle);
  }
  return pose.turned;
}

// Where the body's own coordinates are; `local_center` is its centre of mass in them.
inline Transform transform_of(Pose& pose, Vec2 local_center) {
  const Rotation q = rotation(pose);
  return transform_about(pose.center, q, local_center);
}

using Poses = std::array<Pose, kNumBodies>;
using Velocity = BasicVelocity<float>;
using Velocities = BasicVelocities<float>;

// Moves a body for `time` seconds; a body too fast for the solver is slowed down first.
inline void integrate(Pose& pose, Velocity& velocity, float time) {
  constexpr float max_translation = 2.0f;     // metres a step
  constexpr float max_rotation = 0.5f * kPi;  // radians a step
  const Vec2 translation = time * velocity.linear;
  if (dot(translation, translation) > max_translation * max_translation) {
    const float ratio = max_translation / length(translation);
    velocity.linear = ratio * velocity.linear;
  }
  const float turn = time * velocity.angular;
  if (turn * turn > max_rotation * max_rotation) {
    velocity.angular *= max_rotation / magnitude(turn);
  }
  pose.center += time * velocity.linear;
  pose.angle += time * velocity.angular;
}

}  // namespace touchdown

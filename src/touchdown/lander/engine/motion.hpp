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
};

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

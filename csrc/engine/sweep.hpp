// The motion of a body's centre of mass through one step.
//
// Box2D: b2Sweep; start_center, start_angle and start_time are its c0, a0 and alpha0.
#pragma once

#include "engine/math.hpp"

namespace touchdown::engine {

// `start_*` is the state at the fraction `start_time` of the step: 0, or the last time of impact.
template <typename F>
struct BasicSweep {
  Vec<F> start_center;
  Vec<F> center;
  F start_angle;
  F angle;
  F start_time;
};
using Sweep = BasicSweep<float>;

// Moves the start of the sweep forward to `time` (b2Sweep::Advance).
inline void advance_start(Sweep& sweep, float time) {
  const float beta = (time - sweep.start_time) / (1.0f - sweep.start_time);
  sweep.start_center = (1.0f - beta) * sweep.start_center + beta * sweep.center;
  sweep.start_angle = (1.0f - beta) * sweep.start_angle + beta * sweep.angle;
  sweep.start_time = time;
}

// The body's transform at the fraction `beta` of the rest of the sweep (b2Sweep::GetTransform).
inline Transform transform_at(const Sweep& sweep, Vec2 local_center, float beta) {
  const Vec2 center = (1.0f - beta) * sweep.start_center + beta * sweep.center;
  const float angle = (1.0f - beta) * sweep.start_angle + beta * sweep.angle;
  return transform_about(center, rotation(angle), local_center);
}

}  // namespace touchdown::engine

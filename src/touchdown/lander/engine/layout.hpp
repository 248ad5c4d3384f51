// How many of what there is, and how often it is looked at in a step.
#pragma once

namespace touchdown {

inline constexpr int kNumBodies = 3;
inline constexpr int kHull = 0;
inline constexpr int kLeg0 = 1;  // stock's legs[0]: starts on the right
inline constexpr int kLeg1 = 2;
inline constexpr int kNumLegs = 2;

inline constexpr int kNumEdges = 11;
inline constexpr int kMaxContacts = kNumBodies * kNumEdges;

inline constexpr float kTimeStep = static_cast<float>(1.0 / 50);  // seconds
inline constexpr int kVelocityIterations = 6 * 30;
inline constexpr int kPositionIterations = 2 * 30;

// Impulses carry over from step to step scaled by the ratio of their lengths; since that is one,
// the factor is nowhere to be seen.
static_assert(1.0f / kTimeStep * kTimeStep == 1.0f);

}  // namespace touchdown

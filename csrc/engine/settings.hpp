// Sizes, tolerances and iteration counts.
//
// Box2D: b2Settings.h (b2_linearSlop, b2_polygonRadius, b2_aabbExtension, ...) and b2TimeStep. The
// rest is what Gymnasium's LunarLander asks of Box2D.
#pragma once

namespace touchdown::engine {

inline constexpr float kPi = 3.14159265359f;  // b2_pi

inline constexpr int kNumBodies = 3;
inline constexpr int kHull = 0;
inline constexpr int kLeg0 = 1;  // stock's legs[0]: starts on the right
inline constexpr int kLeg1 = 2;
inline constexpr int kNumLegs = 2;

inline constexpr int kNumEdges = 11;
inline constexpr int kMaxContacts = kNumBodies * kNumEdges;

inline constexpr double kScale = 30.0;  // pixels per metre: stock's lengths are in pixels

inline constexpr float kTimeStep = static_cast<float>(1.0 / 50);  // seconds
inline constexpr int kVelocityIterations = 6 * 30;
inline constexpr int kPositionIterations = 2 * 30;
inline constexpr int kTimeOfImpactPositionIterations = 20;
inline constexpr int kMaxSubSteps = 8;  // a contact with more time-of-impact events is left alone

// Warm starting scales last step's impulses by the ratio of the steps' lengths. The ratio is one
// here, so the factor is left out.
static_assert(1.0f / kTimeStep * kTimeStep == 1.0f);

inline constexpr float kLinearSlop = 0.005f;                 // metres
inline constexpr float kAngularSlop = 2.0f / 180.0f * kPi;   // radians
inline constexpr float kPolygonRadius = 2.0f * kLinearSlop;  // the skin around every shape, metres
inline constexpr float kAabbExtension = 0.1f;                // margin of a fat box, metres

inline constexpr float kBaumgarte = 0.2f;  // share of a position error corrected per iteration
inline constexpr float kTimeOfImpactBaumgarte = 0.75f;
inline constexpr float kMaxLinearCorrection = 0.2f;                  // metres per iteration
inline constexpr float kMaxAngularCorrection = 8.0f / 180.0f * kPi;  // radians per iteration

inline constexpr float kMaxTranslation = 2.0f;     // metres per step
inline constexpr float kMaxRotation = 0.5f * kPi;  // radians per step

inline constexpr float kTimeToSleep = 0.5f;                           // seconds
inline constexpr float kLinearSleepTolerance = 0.01f;                 // metres per second
inline constexpr float kAngularSleepTolerance = 2.0f / 180.0f * kPi;  // radians per second

}  // namespace touchdown::engine

// Shapes whose distances can be worked out in the head.
#pragma once

#include "engine/math.hpp"
#include "engine/settings.hpp"
#include "engine/shapes.hpp"
#include "engine/terrain.hpp"

namespace touchdown::engine {

// A square with sides of 1 m around the origin of its own coordinates.
inline Shape unit_square() {
  Shape square{};
  square.count = 4;
  square.vertices = {{{-0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, 0.5f}, {-0.5f, 0.5f}}};
  square.normals = {{{0.0f, -1.0f}, {1.0f, 0.0f}, {0.0f, 1.0f}, {-1.0f, 0.0f}}};
  return square;
}

// The ground: y = 0 from x = 0 to x = 20, with the normal upwards. An edge's normal is to the right
// of its direction, so it runs from right to left.
inline Edge ground() { return make_edge({20.0f, 0.0f}, {0.0f, 0.0f}, 0.1f); }

inline Transform at(float x, float y, float degrees = 0.0f) {
  return {{x, y}, rotation(degrees / 180.0f * kPi)};
}

}  // namespace touchdown::engine

// The moon: eleven static edges, ten of which are the surface.
//
// Box2D: eleven b2EdgeShape fixtures of one static b2Body. The heights are drawn as Gymnasium's
// LunarLander.reset draws them.
#pragma once

#include <array>

#include "engine/aabb.hpp"
#include "engine/math.hpp"
#include "engine/pcg64.hpp"
#include "engine/settings.hpp"

namespace touchdown::engine {

inline constexpr double kViewportWidth = 600;   // pixels
inline constexpr double kViewportHeight = 400;  // pixels
inline constexpr double kWorldWidth = kViewportWidth / kScale;
inline constexpr double kWorldHeight = kViewportHeight / kScale;

inline constexpr int kNumHeights = 11;
inline constexpr int kMiddle = kNumHeights / 2;
inline constexpr double kChunk = kWorldWidth / (kNumHeights - 1);
inline constexpr double kHelipadLeft = kChunk * (kMiddle - 1);
inline constexpr double kHelipadRight = kChunk * (kMiddle + 1);
inline constexpr double kHelipadHeight = kWorldHeight / 4;

struct Edge {
  Vec2 start;
  Vec2 end;
  Vec2 normal;  // to the right of the direction from start to end
  Aabb fat_aabb;
  float friction;
};

inline Edge make_edge(Vec2 start, Vec2 end, float friction) {
  Vec2 along = end - start;
  normalize(along);
  const Aabb box = grown(Aabb{smaller(start, end), larger(start, end)}, kPolygonRadius);
  return {start, end, {along.y, -along.x}, grown(box, kAabbExtension), friction};
}

struct Terrain {
  float top;  // of the edges' fat boxes
  std::array<Edge, kNumEdges> edges;
  std::array<double, kNumHeights> heights;  // in double precision, as stock draws them
};

inline Terrain make_terrain(Pcg64& rng) {
  std::array<double, kNumHeights + 1> raw;
  for (double& height : raw) height = rng.uniform(0.0, kWorldHeight / 2);
  for (int i = kMiddle - 2; i <= kMiddle + 2; ++i) raw[i] = kHelipadHeight;

  Terrain terrain;
  for (int i = 0; i < kNumHeights; ++i) {
    // The first point's left neighbour is the last of the twelve draws, as stock indexes with -1.
    const double left = raw[i == 0 ? kNumHeights : i - 1];
    terrain.heights[i] = 0.33 * (left + raw[i] + raw[i + 1]);
  }
  terrain.edges[0] = make_edge({0.0f, 0.0f}, {static_cast<float>(kWorldWidth), 0.0f}, 0.2f);
  for (int i = 0; i + 1 < kNumHeights; ++i) {
    const auto point = [&terrain](int at) {
      return Vec2{static_cast<float>(kChunk * at), static_cast<float>(terrain.heights[at])};
    };
    terrain.edges[i + 1] = make_edge(point(i), point(i + 1), 0.1f);
  }
  terrain.top = terrain.edges[0].fat_aabb.upper.y;
  for (const Edge& edge : terrain.edges) terrain.top = larger(terrain.top, edge.fat_aabb.upper.y);
  return terrain;
}

}  // namespace touchdown::engine

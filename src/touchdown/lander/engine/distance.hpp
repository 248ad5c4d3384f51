// The distance between an edge and a polygon, by the algorithm of Gilbert, Johnson and Keerthi:
// walk a simplex of up to three corners of the difference of the shapes towards the origin.
//
// Source: C. Ericson, "Real-Time Collision Detection", 2005, on simplices and Voronoi regions.
#pragma once

#include <array>
#include <cfloat>

#include "bodies.hpp"
#include "math.hpp"
#include "terrain.hpp"

namespace touchdown {

// The corners of a convex shape, whichever kind it is.
struct Corners {
  std::array<Vec2, Shape::kMaxVertices> vertices;
  int count;
};

inline Corners corners(const Edge& edge) { return {{edge.start, edge.end}, 2}; }
inline Corners corners(const Shape& shape) { return {shape.vertices, shape.count}; }

// The corner farthest in a direction.
inline int support(const Corners& shape, Vec2 direction) {
  int best = 0;
  float most = dot(shape.vertices[0], direction);
  for (int i = 1; i < shape.count; ++i) {
    const float value = dot(shape.vertices[i], direction);
    if (value > most) {
      best = i;
      most = value;
    }
  }
  return best;
}

// A corner of the difference: the polygon's corner minus the edge's.
struct SimplexCorner {
  Vec2 on_edge;
  Vec2 on_polygon;
  Vec2 difference;
  float weight;  // barycentric, of the point nearest to the origin
  int edge_index;
  int polygon_index;
};

struct Simplex {
  std::array<SimplexCorner, 3> corners;
  int count;
};

// The corners a search ended with; the next search, a little later, starts from them.
struct SimplexMemory {
  float metric;
  int count;
  std::array<int, 3> edge_indices;
  std::array<int, 3> polygon_indices;
};

namespace detail {

inline SimplexCorner simplex_corner(const Corners& edge, int edge_index, const Corners& polygon,
                                    const Transform& transform, int polygon_index) {
  SimplexCorner corner;
  corner.edge_index = edge_index;
  corner.polygon_index = polygon_index;
  corner.on_edge = to_world(kMoonTransform, edge.vertices[edge_index]);
  corner.on_polygon = to_world(transform, polygon.vertices[polygon_index]);
  corner.difference = corner.on_polygon - corner.on_edge;
  corner.weight = 0.0f;
  return corner;
}

// A length or an area, to tell whether a remembered simplex still has its shape.
inline float metric(const Simplex& simplex) {
  const auto& c = simplex.corners;
  if (simplex.count == 2) return length(c[0].difference - c[1].difference);
  if (simplex.count == 3) {
    return cross(c[1].difference - c[0].difference, c[2].difference - c[0].difference);
  }
  return 0.0f;
}

inline Simplex recall(const SimplexMemory& memory, const Corners& edge, const Corners& polygon,
                      const Transform& transform) {
  Simplex simplex;
  simplex.count = memory.count;
  for (int i = 0; i < memory.count; ++i) {
    simplex.corners[i] =
        simplex_corner(edge, memory.edge_indices[i], polygon, transform, memory.polygon_indices[i]);
  }
  if (simplex.count > 1) {
    const float now = metric(simplex);
    if (now < 0.5f * memory.metric || 2.0f * memory.metric < now || now < kEpsilon) {
      simplex.count = 0;
    }
  }
  if (simplex.count == 0) {
    simplex.corners[0] = simplex_corner(edge, 0, polygon, transform, 0);
    simplex.corners[0].weight = 1.0f;
    simplex.count = 1;
  }
  return simplex;
}

inline void keep_one(Simplex& simplex, int i) {
  simplex.corners[0] = simplex.corners[i];
  simplex.corners[0].weight = 1.0f;
  simplex.count = 1;
}

inline void keep_two(Simplex& simplex, int i, int j, float weight_i, float weight_j) {
  const float inverse = 1.0f / (weight_i + weight_j);
  simplex.corners[0] = simplex.corners[i];
  simplex.corners[1] = simplex.corners[j];
  simplex.corners[0].weight = weight_i * inverse;
  simplex.corners[1].weight = weight_j * inverse;
  simplex.count = 2;
}

// Keeps the corners whose region the origin is in, and weighs them.
inline void solve_segment(Simplex& simplex) {
  const Vec2 w1 = simplex.corners[0].difference;
  const Vec2 w2 = simplex.corners[1].difference;
  const Vec2 along = w2 - w1;
  const float weight_2 = -dot(w1, along);
  if (weight_2 <= 0.0f) return keep_one(simplex, 0);
  const float weight_1 = dot(w2, along);
  if (weight_1 <= 0.0f) return keep_one(simplex, 1);
  keep_two(simplex, 0, 1, weight_1, weight_2);
}

inline void solve_triangle(Simplex& simplex) {
  const Vec2 w1 = simplex.corners[0].difference;
  const Vec2 w2 = simplex.corners[1].difference;
  const Vec2 w3 = simplex.corners[2].difference;
  const Vec2 e12 = w2 - w1;
  const Vec2 e13 = w3 - w1;
  const Vec2 e23 = w3 - w2;
  const float d12_1 = dot(w2, e12);
  const float d12_2 = -dot(w1, e12);
  const float d13_1 = dot(w3, e13);
  const float d13_2 = -dot(w1, e13);
  const float d23_1 = dot(w3, e23);
  const float d23_2 = -dot(w2, e23);
  const float area = cross(e12, e13);
  const float d123_1 = area * cross(w2, w3);
  const float d123_2 = area * cross(w3, w1);
  const float d123_3 = area * cross(w1, w2);

  if (d12_2 <= 0.0f && d13_2 <= 0.0f) return keep_one(simplex, 0);
  if (d12_1 > 0.0f && d12_2 > 0.0f && d123_3 <= 0.0f) return keep_two(simplex, 0, 1, d12_1, d12_2);
  if (d13_1 > 0.0f && d13_2 > 0.0f && d123_2 <= 0.0f) return keep_two(simplex, 0, 2, d13_1, d13_2);
  if (d12_1 <= 0.0f && d23_2 <= 0.0f) return keep_one(simplex, 1);
  if (d13_1 <= 0.0f && d23_1 <= 0.0f) return keep_one(simplex, 2);
  // The third corner comes first here, as it does upstream.
  if (d23_1 > 0.0f && d23_2 > 0.0f && d123_1 <= 0.0f) return keep_two(simplex, 2, 1, d23_2, d23_1);

  const float inverse = 1.0f / (d123_1 + d123_2 + d123_3);
  simplex.corners[0].weight = d123_1 * inverse;
  simplex.corners[1].weight = d123_2 * inverse;
  simplex.corners[2].weight = d123_3 * inverse;
}

// From the simplex towards the origin.
inline Vec2 search_direction(const Simplex& simplex) {
  const Vec2 w1 = simplex.corners[0].difference;
  if (simplex.count == 1) return -w1;
  const Vec2 along = simplex.corners[1].difference - w1;
  return cross(along, -w1) > 0.0f ? cross(1.0f, along) : cross(along, 1.0f);
}

inline float gap(const Simplex& simplex) {
  const auto& c = simplex.corners;
  if (simplex.count == 3) return 0.0f;
  if (simplex.count == 1) return length(c[0].on_edge - c[0].on_polygon);
  const Vec2 on_edge = c[0].weight * c[0].on_edge + c[1].weight * c[1].on_edge;
  const Vec2 on_polygon = c[0].weight * c[0].on_polygon + c[1].weight * c[1].on_polygon;
  return length(on_edge - on_polygon);
}

}  // namespace detail

inline float distance(const Corners& edge, const Corners& polygon, const Transform& transform,
                      SimplexMemory& memory) {
  constexpr int max_iterations = 20;
  Simplex simplex = detail::recall(memory, edge, polygon, transform);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const Simplex before = simplex;
    if (simplex.count == 2) detail::solve_segment(simplex);
    if (simplex.count == 3) detail::solve_triangle(simplex);
    if (simplex.count == 3) break;  // the origin is inside: the shapes overlap

    const Vec2 direction = detail::search_direction(simplex);
    if (dot(direction, direction) < kEpsilon * kEpsilon) break;  // the origin is on the simplex

    const SimplexCorner found = detail::simplex_corner(
        edge, support(edge, rotate_back(kMoonTransform.rotation, -direction)), polygon, transform,
        support(polygon, rotate_back(transform.rotation, direction)));
    bool seen = false;
    for (int i = 0; i < before.count; ++i) {
      seen = seen || (found.edge_index == before.corners[i].edge_index &&
                      found.polygon_index == before.corners[i].polygon_index);
    }
    if (seen) break;  // no corner is nearer
    simplex.corners[simplex.count++] = found;
  }

  memory.metric = detail::metric(simplex);
  memory.count = simplex.count;
  for (int i = 0; i < simplex.count; ++i) {
    memory.edge_indices[i] = simplex.corners[i].edge_index;
    memory.polygon_indices[i] = simplex.corners[i].polygon_index;
  }
  return detail::gap(simplex);
}

}  // namespace touchdown

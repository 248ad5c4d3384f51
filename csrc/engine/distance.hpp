// The distance between an edge and a polygon by GJK, the algorithm of Gilbert, Johnson and Keerthi:
// a simplex of up to three vertices of the shapes' Minkowski difference moves towards the origin.
//
// Box2D: b2Distance, b2DistanceProxy, b2Simplex and b2SimplexCache. Source: C. Ericson, "Real-Time
// Collision Detection", 2005, on simplices and Voronoi regions.
#pragma once

#include <array>

#include "engine/math.hpp"
#include "engine/shapes.hpp"
#include "engine/terrain.hpp"

namespace touchdown::engine {

// The vertices of a convex shape of either kind.
struct DistanceProxy {
  std::array<Vec2, Shape::kMaxVertices> vertices;
  int count;
};

inline DistanceProxy distance_proxy(const Edge& edge) { return {{edge.start, edge.end}, 2}; }
inline DistanceProxy distance_proxy(const Shape& shape) { return {shape.vertices, shape.count}; }

// The index of the vertex farthest in a direction.
inline int support(const DistanceProxy& shape, Vec2 direction) {
  int best = 0;
  float max_projection = dot(shape.vertices[0], direction);
  for (int i = 1; i < shape.count; ++i) {
    const float projection = dot(shape.vertices[i], direction);
    if (projection > max_projection) {
      best = i;
      max_projection = projection;
    }
  }
  return best;
}

// A vertex of the Minkowski difference: a vertex of the polygon minus one of the edge.
struct SimplexVertex {
  Vec2 on_edge;
  Vec2 on_polygon;
  Vec2 difference;
  float weight;  // barycentric coordinate of the simplex's point nearest to the origin
  int edge_index;
  int polygon_index;
};

struct Simplex {
  std::array<SimplexVertex, 3> vertices;
  int count;
};

// The vertices that a search ended with; the next search, a little later, starts from them.
struct SimplexCache {
  float metric;
  int count;
  std::array<int, 3> edge_indices;
  std::array<int, 3> polygon_indices;
};

namespace detail {

inline SimplexVertex simplex_vertex(const DistanceProxy& edge, int edge_index,
                                    const DistanceProxy& polygon, const Transform& transform,
                                    int polygon_index) {
  SimplexVertex vertex;
  vertex.edge_index = edge_index;
  vertex.polygon_index = polygon_index;
  vertex.on_edge = to_world(kMoonTransform, edge.vertices[edge_index]);
  vertex.on_polygon = to_world(transform, polygon.vertices[polygon_index]);
  vertex.difference = vertex.on_polygon - vertex.on_edge;
  vertex.weight = 0.0f;
  return vertex;
}

// A length or an area, which tells whether a cached simplex still has its shape.
inline float metric(const Simplex& simplex) {
  const auto& c = simplex.vertices;
  if (simplex.count == 2) return length(c[0].difference - c[1].difference);
  if (simplex.count == 3) {
    return cross(c[1].difference - c[0].difference, c[2].difference - c[0].difference);
  }
  return 0.0f;
}

inline Simplex read_cache(const SimplexCache& cache, const DistanceProxy& edge,
                          const DistanceProxy& polygon, const Transform& transform) {
  Simplex simplex;
  simplex.count = cache.count;
  for (int i = 0; i < cache.count; ++i) {
    simplex.vertices[i] =
        simplex_vertex(edge, cache.edge_indices[i], polygon, transform, cache.polygon_indices[i]);
  }
  if (simplex.count > 1) {
    const float now = metric(simplex);
    if (now < 0.5f * cache.metric || 2.0f * cache.metric < now || now < kEpsilon) {
      simplex.count = 0;
    }
  }
  if (simplex.count == 0) {
    simplex.vertices[0] = simplex_vertex(edge, 0, polygon, transform, 0);
    simplex.vertices[0].weight = 1.0f;
    simplex.count = 1;
  }
  return simplex;
}

inline void reduce_to_vertex(Simplex& simplex, int i) {
  simplex.vertices[0] = simplex.vertices[i];
  simplex.vertices[0].weight = 1.0f;
  simplex.count = 1;
}

inline void reduce_to_segment(Simplex& simplex, int i, int j, float weight_i, float weight_j) {
  const float inverse = 1.0f / (weight_i + weight_j);
  simplex.vertices[0] = simplex.vertices[i];
  simplex.vertices[1] = simplex.vertices[j];
  simplex.vertices[0].weight = weight_i * inverse;
  simplex.vertices[1].weight = weight_j * inverse;
  simplex.count = 2;
}

// Reduces the simplex to the vertices whose Voronoi region the origin is in, and sets their weights
// (b2Simplex::Solve2).
inline void solve_segment(Simplex& simplex) {
  const Vec2 w1 = simplex.vertices[0].difference;
  const Vec2 w2 = simplex.vertices[1].difference;
  const Vec2 along = w2 - w1;
  const float weight_2 = -dot(w1, along);
  if (weight_2 <= 0.0f) return reduce_to_vertex(simplex, 0);
  const float weight_1 = dot(w2, along);
  if (weight_1 <= 0.0f) return reduce_to_vertex(simplex, 1);
  reduce_to_segment(simplex, 0, 1, weight_1, weight_2);
}

// The same for three vertices (b2Simplex::Solve3).
inline void solve_triangle(Simplex& simplex) {
  const Vec2 w1 = simplex.vertices[0].difference;
  const Vec2 w2 = simplex.vertices[1].difference;
  const Vec2 w3 = simplex.vertices[2].difference;
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

  if (d12_2 <= 0.0f && d13_2 <= 0.0f) return reduce_to_vertex(simplex, 0);
  if (d12_1 > 0.0f && d12_2 > 0.0f && d123_3 <= 0.0f) {
    return reduce_to_segment(simplex, 0, 1, d12_1, d12_2);
  }
  if (d13_1 > 0.0f && d13_2 > 0.0f && d123_2 <= 0.0f) {
    return reduce_to_segment(simplex, 0, 2, d13_1, d13_2);
  }
  if (d12_1 <= 0.0f && d23_2 <= 0.0f) return reduce_to_vertex(simplex, 1);
  if (d13_1 <= 0.0f && d23_1 <= 0.0f) return reduce_to_vertex(simplex, 2);
  // The third vertex comes first here, as in Box2D.
  if (d23_1 > 0.0f && d23_2 > 0.0f && d123_1 <= 0.0f) {
    return reduce_to_segment(simplex, 2, 1, d23_2, d23_1);
  }

  const float inverse = 1.0f / (d123_1 + d123_2 + d123_3);
  simplex.vertices[0].weight = d123_1 * inverse;
  simplex.vertices[1].weight = d123_2 * inverse;
  simplex.vertices[2].weight = d123_3 * inverse;
}

// From the simplex towards the origin.
inline Vec2 search_direction(const Simplex& simplex) {
  const Vec2 w1 = simplex.vertices[0].difference;
  if (simplex.count == 1) return -w1;
  const Vec2 along = simplex.vertices[1].difference - w1;
  return cross(along, -w1) > 0.0f ? cross(1.0f, along) : cross(along, 1.0f);
}

// The distance between the two nearest points.
inline float nearest_distance(const Simplex& simplex) {
  const auto& c = simplex.vertices;
  if (simplex.count == 3) return 0.0f;
  if (simplex.count == 1) return length(c[0].on_edge - c[0].on_polygon);
  const Vec2 on_edge = c[0].weight * c[0].on_edge + c[1].weight * c[1].on_edge;
  const Vec2 on_polygon = c[0].weight * c[0].on_polygon + c[1].weight * c[1].on_polygon;
  return length(on_edge - on_polygon);
}

}  // namespace detail

// The distance between the shapes without their skins; 0 if they overlap. `cache` is read and
// written.
inline float distance(const DistanceProxy& edge, const DistanceProxy& polygon,
                      const Transform& transform, SimplexCache& cache) {
  constexpr int max_iterations = 20;
  Simplex simplex = detail::read_cache(cache, edge, polygon, transform);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const Simplex before = simplex;
    if (simplex.count == 2) detail::solve_segment(simplex);
    if (simplex.count == 3) detail::solve_triangle(simplex);
    if (simplex.count == 3) break;  // the origin is inside: the shapes overlap

    const Vec2 direction = detail::search_direction(simplex);
    if (dot(direction, direction) < kEpsilon * kEpsilon) break;  // the origin is on the simplex

    const SimplexVertex found = detail::simplex_vertex(
        edge, support(edge, rotate_back(kMoonTransform.rotation, -direction)), polygon, transform,
        support(polygon, rotate_back(transform.rotation, direction)));
    bool seen = false;
    for (int i = 0; i < before.count; ++i) {
      seen = seen || (found.edge_index == before.vertices[i].edge_index &&
                      found.polygon_index == before.vertices[i].polygon_index);
    }
    if (seen) break;  // no vertex is nearer
    simplex.vertices[simplex.count++] = found;
  }

  cache.metric = detail::metric(simplex);
  cache.count = simplex.count;
  for (int i = 0; i < simplex.count; ++i) {
    cache.edge_indices[i] = simplex.vertices[i].edge_index;
    cache.polygon_indices[i] = simplex.vertices[i].polygon_index;
  }
  return detail::nearest_distance(simplex);
}

}  // namespace touchdown::engine

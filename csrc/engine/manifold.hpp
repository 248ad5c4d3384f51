// The contact manifold of an edge and a polygon: the axis of least overlap, then the points
// of the incident face clipped to the reference face.
//
// Box2D: b2CollideEdgeAndPolygon (b2EPCollider), b2Manifold, b2ContactFeature and
// b2ClipSegmentToLine. The edges have no ghost vertices, so a polygon may catch on the end of an
// edge as if nothing followed it; stock's moon is made that way.
#pragma once

#include <array>
#include <cfloat>
#include <cstdint>

#include "engine/math.hpp"
#include "engine/settings.hpp"
#include "engine/shapes.hpp"
#include "engine/terrain.hpp"

namespace touchdown::engine {

// The shape that provides the reference face.
enum class Face : std::uint32_t { kEdge, kPolygon };

// The features that make a point, by which the next step finds its impulses again.
struct ContactFeature {
  enum Kind : std::uint8_t { kVertex, kFace };
  std::uint8_t edge_index;
  std::uint8_t polygon_index;
  std::uint8_t edge_kind;
  std::uint8_t polygon_kind;

  constexpr bool operator==(const ContactFeature&) const = default;
};

struct ManifoldPoint {
  Vec2 local_point;  // in the coordinates of the shape that does not provide the face
  float normal_impulse;
  float tangent_impulse;
  ContactFeature feature;
};

struct Manifold {
  std::array<ManifoldPoint, 2> points;
  Vec2 local_normal;  // of the face, in its shape's coordinates
  Vec2 local_point;   // on the face, in its shape's coordinates
  Face face;
  std::uint32_t count;
};

namespace detail {

struct ClipPoint {
  Vec2 position;
  ContactFeature feature;
};

// The reference face, oriented so that `normal` points out of it.
struct ReferenceFace {
  Vec2 start;
  Vec2 end;
  Vec2 normal;
  std::uint8_t start_index;
  std::uint8_t end_index;
};

// Keeps the part of a segment behind a line; false if no segment is left. A point where the line
// cuts it gets `index`, the end of the reference face that the line goes through, as its feature.
inline bool clip(std::array<ClipPoint, 2>& segment, Vec2 normal, float offset, std::uint8_t index) {
  const float distance[2] = {dot(normal, segment[0].position) - offset,
                             dot(normal, segment[1].position) - offset};
  std::array<ClipPoint, 2> kept;
  int count = 0;
  for (int i = 0; i < 2; ++i) {
    if (distance[i] <= 0.0f) kept[count++] = segment[i];
  }
  if (distance[0] * distance[1] < 0.0f) {
    const float fraction = distance[0] / (distance[0] - distance[1]);
    kept[count++] = {
        segment[0].position + fraction * (segment[1].position - segment[0].position),
        {index, segment[0].feature.polygon_index, ContactFeature::kVertex, ContactFeature::kFace}};
  }
  segment = kept;
  return count == 2;
}

}  // namespace detail

// The manifold of a polygon at `transform` with an edge of the moon; no points if they do not
// touch.
inline Manifold collide(const Edge& edge, const Shape& shape, const Transform& transform) {
  using detail::ClipPoint;
  using detail::ReferenceFace;
  constexpr float max_separation = 2.0f * kPolygonRadius;

  Manifold manifold{};
  const Transform to_edge = relative(kMoonTransform, transform);
  const bool front = dot(edge.normal, to_world(to_edge, shape.centroid) - edge.start) >= 0.0f;
  const Vec2 outward = front ? edge.normal : -edge.normal;

  std::array<Vec2, Shape::kMaxVertices> vertices;
  float edge_separation = FLT_MAX;
  for (int i = 0; i < shape.count; ++i) {
    vertices[i] = to_world(to_edge, shape.vertices[i]);
    edge_separation = smaller(dot(outward, vertices[i] - edge.start), edge_separation);
  }
  if (edge_separation > max_separation) return manifold;
  std::array<Vec2, Shape::kMaxVertices> normals;
  for (int i = 0; i < shape.count; ++i) {
    normals[i] = rotate(to_edge.rotation, shape.normals[i]);
  }

  // The polygon's axes count only if they oppose the edge's.
  int side = -1;
  float side_separation = -FLT_MAX;
  for (int i = 0; i < shape.count; ++i) {
    const Vec2 inward = -normals[i];
    const float separation =
        smaller(dot(inward, vertices[i] - edge.start), dot(inward, vertices[i] - edge.end));
    if (separation > max_separation) return manifold;
    if (dot(inward + outward, outward) < -kAngularSlop) continue;
    if (separation > side_separation) {
      side = i;
      side_separation = separation;
    }
  }

  // The polygon's axis has to be clearly better: otherwise resting contacts would flicker.
  const bool edge_is_face = side < 0 || !(side_separation > 0.98f * edge_separation + 0.001f);

  ReferenceFace face;
  std::array<ClipPoint, 2> incident;
  if (edge_is_face) {
    int first = 0;
    float min_alignment = dot(outward, normals[0]);
    for (int i = 1; i < shape.count; ++i) {
      const float value = dot(outward, normals[i]);
      if (value < min_alignment) {
        min_alignment = value;
        first = i;
      }
    }
    const int second = first + 1 < shape.count ? first + 1 : 0;
    const auto vertex = [&vertices](int i) -> ClipPoint {
      return {vertices[i],
              {0, static_cast<std::uint8_t>(i), ContactFeature::kFace, ContactFeature::kVertex}};
    };
    incident = {vertex(first), vertex(second)};
    face = front ? ReferenceFace{edge.start, edge.end, outward, 0, 1}
                 : ReferenceFace{edge.end, edge.start, outward, 1, 0};
    manifold.local_normal = face.normal;
    manifold.local_point = face.start;
  } else {
    const int next = side + 1 < shape.count ? side + 1 : 0;
    const ContactFeature feature{0, static_cast<std::uint8_t>(side), ContactFeature::kVertex,
                                 ContactFeature::kFace};
    incident = {ClipPoint{edge.start, feature}, ClipPoint{edge.end, feature}};
    face = {vertices[side], vertices[next], normals[side], static_cast<std::uint8_t>(side),
            static_cast<std::uint8_t>(next)};
    manifold.local_normal = shape.normals[side];
    manifold.local_point = shape.vertices[side];
  }

  const Vec2 before_start{face.normal.y, -face.normal.x};
  const Vec2 past_end = -before_start;
  if (!detail::clip(incident, before_start, dot(before_start, face.start), face.start_index) ||
      !detail::clip(incident, past_end, dot(past_end, face.end), face.end_index)) {
    return manifold;
  }

  manifold.face = edge_is_face ? Face::kEdge : Face::kPolygon;
  for (const ClipPoint& point : incident) {
    if (dot(face.normal, point.position - face.start) > max_separation) continue;
    ManifoldPoint& added = manifold.points[manifold.count++];
    const ContactFeature feature = point.feature;
    if (edge_is_face) {
      added.local_point = to_local(to_edge, point.position);
      added.feature = feature;
    } else {
      // The indices are swapped, as in Box2D: which points find their impulses again when the
      // reference face passes from one shape to the other depends on it.
      added.local_point = point.position;
      added.feature = {feature.polygon_index, feature.edge_index, feature.polygon_kind,
                       feature.edge_kind};
    }
  }
  return manifold;
}

}  // namespace touchdown::engine

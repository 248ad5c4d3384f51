// Where a polygon touches an edge of the moon: the axis of least overlap, then the points of one
// face that lie behind the other.
//
// The edges do not know their neighbours, so a polygon may meet the end of an edge as if nothing
// came after it; stock's moon is made that way.
#pragma once

#include <array>
#include <cfloat>
#include <cstdint>

#include "bodies.hpp"
#include "joint.hpp"
#include "math.hpp"
#include "terrain.hpp"

namespace touchdown {

// Which shape gives the face that the points are measured against.
enum class Face : std::uint32_t { kEdge, kPolygon };

// Names a point by the features that make it, so that next step finds its impulses again.
struct PointName {
  enum Kind : std::uint8_t { kVertex, kFace };
  std::uint8_t edge_index;
  std::uint8_t polygon_index;
  std::uint8_t edge_kind;
  std::uint8_t polygon_kind;

  constexpr bool operator==(const PointName&) const = default;
};

struct ManifoldPoint {
  Vec2 local_point;  // in the coordinates of the shape that does not give the face
  float normal_impulse;
  float tangent_impulse;
  PointName name;
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
  PointName name;
};

// The reference face, turned so that `normal` looks out of it.
struct ReferenceFace {
  Vec2 start;
  Vec2 end;
  Vec2 normal;
  std::uint8_t start_index;
  std::uint8_t end_index;
};

// Keeps the part of a segment behind a line; false if less than a segment is left. A point that the
// line makes is named after `index`, the end of the reference face that the line goes through.
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
    kept[count++] = {segment[0].position + fraction * (segment[1].position - segment[0].position),
                     {index, segment[0].name.polygon_index, PointName::kVertex, PointName::kFace}};
  }
  segment = kept;
  return count == 2;
}

}  // namespace detail

inline Manifold collide(const Edge& edge, const Shape& shape, const Transform& transform) {
  using detail::ClipPoint;
  using detail::ReferenceFace;
  constexpr float reach = 2.0f * kSkin;

  Manifold manifold{};
  const Transform to_edge = relative(kMoonTransform, transform);
  const bool front = dot(edge.normal, to_world(to_edge, shape.centroid) - edge.start) >= 0.0f;
  const Vec2 outward = front ? edge.normal : -edge.normal;

  std::array<Vec2, Shape::kMaxVertices> vertices;
  std::array<Vec2, Shape::kMaxVertices> normals;
  float edge_separation = FLT_MAX;
  for (int i = 0; i < shape.count; ++i) {
    vertices[i] = to_world(to_edge, shape.vertices[i]);
    normals[i] = rotate(to_edge.rotation, shape.normals[i]);
    edge_separation = smaller(dot(outward, vertices[i] - edge.start), edge_separation);
  }
  if (edge_separation > reach) return manifold;

  // The polygon's own axes count only if they look against the edge's.
  int side = -1;
  float side_separation = -FLT_MAX;
  for (int i = 0; i < shape.count; ++i) {
    const Vec2 inward = -normals[i];
    const float separation =
        smaller(dot(inward, vertices[i] - edge.start), dot(inward, vertices[i] - edge.end));
    if (separation > reach) return manifold;
    if (dot(inward + outward, outward) < -kAngularSlop) continue;
    if (separation > side_separation) {
      side = i;
      side_separation = separation;
    }
  }

  // A polygon's axis has to be clearly better, or resting contacts would flicker between the two.
  const bool edge_is_face = side < 0 || !(side_separation > 0.98f * edge_separation + 0.001f);

  ReferenceFace face;
  std::array<ClipPoint, 2> incident;
  if (edge_is_face) {
    int first = 0;
    float least = dot(outward, normals[0]);
    for (int i = 1; i < shape.count; ++i) {
      const float value = dot(outward, normals[i]);
      if (value < least) {
        least = value;
        first = i;
      }
    }
    const int second = first + 1 < shape.count ? first + 1 : 0;
    const auto corner = [&vertices](int i) -> ClipPoint {
      return {vertices[i], {0, static_cast<std::uint8_t>(i), PointName::kFace, PointName::kVertex}};
    };
    incident = {corner(first), corner(second)};
    face = front ? ReferenceFace{edge.start, edge.end, outward, 0, 1}
                 : ReferenceFace{edge.end, edge.start, outward, 1, 0};
    manifold.local_normal = face.normal;
    manifold.local_point = face.start;
  } else {
    const int next = side + 1 < shape.count ? side + 1 : 0;
    const PointName name{0, static_cast<std::uint8_t>(side), PointName::kVertex, PointName::kFace};
    incident = {ClipPoint{edge.start, name}, ClipPoint{edge.end, name}};
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
    if (dot(face.normal, point.position - face.start) > reach) continue;
    ManifoldPoint& added = manifold.points[manifold.count++];
    const PointName name = point.name;
    if (edge_is_face) {
      added.local_point = to_local(to_edge, point.position);
      added.name = name;
    } else {
      // Turned round as upstream does it: a point may find its impulses again when the face passes
      // from one shape to the other, and which ones do depends on this.
      added.local_point = point.position;
      added.name = {name.polygon_index, name.edge_index, name.polygon_kind, name.edge_kind};
    }
  }
  return manifold;
}

}  // namespace touchdown

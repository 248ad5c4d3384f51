// When, within a step, a moving polygon first comes close to an edge.
//
// Conservative advancement along separating axes: find the axis between the nearest features, find
// the time at which the deepest corner along it reaches the target distance, look again from there.
#pragma once

#include <cmath>
#include <optional>

#include "bodies.hpp"
#include "distance.hpp"
#include "math.hpp"
#include "terrain.hpp"

namespace touchdown {

namespace detail {

// Separation as a function of time, along an axis fixed to the shape whose feature it is.
class SeparationAxis {
 public:
  SeparationAxis(const SimplexMemory& nearest, const Corners& edge, const Corners& polygon,
                 const Sweep& sweep, Vec2 local_center, float time)
      : edge_(edge), polygon_(polygon), sweep_(sweep), local_center_(local_center) {
    const Transform body = transform_at(sweep, local_center, time);
    const Vec2 edge_corner = edge.vertices[nearest.edge_indices[0]];
    const Vec2 polygon_corner = polygon.vertices[nearest.polygon_indices[0]];
    if (nearest.count == 1) {
      kind_ = Kind::kPoints;
      axis_ = to_world(body, polygon_corner) - to_world(kMoonTransform, edge_corner);
      normalize(axis_);
    } else if (nearest.edge_indices[0] == nearest.edge_indices[1]) {
      kind_ = Kind::kPolygonFace;
      set_face(polygon_corner, polygon.vertices[nearest.polygon_indices[1]]);
      if (along_face(body, to_world(kMoonTransform, edge_corner)) < 0.0f) axis_ = -axis_;
    } else {
      kind_ = Kind::kEdgeFace;
      set_face(edge_corner, edge.vertices[nearest.edge_indices[1]]);
      if (along_face(kMoonTransform, to_world(body, polygon_corner)) < 0.0f) axis_ = -axis_;
    }
  }

  // The corners that are deepest at a time; the one of the face's own shape is not used.
  struct Witness {
    int edge_index;
    int polygon_index;
  };

  Witness deepest(float time) const {
    const Transform body = transform_at(sweep_, local_center_, time);
    Witness witness{-1, -1};
    switch (kind_) {
      case Kind::kPoints:
        witness.edge_index = support(edge_, rotate_back(kMoonTransform.rotation, axis_));
        witness.polygon_index = support(polygon_, rotate_back(body.rotation, -axis_));
        break;
      case Kind::kEdgeFace: {
        const Vec2 normal = rotate(kMoonTransform.rotation, axis_);
        witness.polygon_index = support(polygon_, rotate_back(body.rotation, -normal));
        break;
      }
      case Kind::kPolygonFace: {
        const Vec2 normal = rotate(body.rotation, axis_);
        witness.edge_index = support(edge_, rotate_back(kMoonTransform.rotation, -normal));
        break;
      }
    }
    return witness;
  }

  float separation(Witness witness, float time) const {
    const Transform body = transform_at(sweep_, local_center_, time);
    switch (kind_) {
      case Kind::kPoints:
        return dot(to_world(body, polygon_.vertices[witness.polygon_index]) -
                       to_world(kMoonTransform, edge_.vertices[witness.edge_index]),
                   axis_);
      case Kind::kEdgeFace:
        return along_face(kMoonTransform, to_world(body, polygon_.vertices[witness.polygon_index]));
      case Kind::kPolygonFace:
        break;
    }
    return along_face(body, to_world(kMoonTransform, edge_.vertices[witness.edge_index]));
  }

 private:
  enum class Kind { kPoints, kEdgeFace, kPolygonFace };

  void set_face(Vec2 from, Vec2 to) {
    axis_ = cross(to - from, 1.0f);
    normalize(axis_);
    face_point_ = 0.5f * (from + to);
  }

  // How far a point is in front of the face.
  float along_face(const Transform& owner, Vec2 point) const {
    return dot(point - to_world(owner, face_point_), rotate(owner.rotation, axis_));
  }

  const Corners& edge_;
  const Corners& polygon_;
  const Sweep& sweep_;
  Vec2 local_center_;
  Kind kind_;
  Vec2 face_point_{};
  Vec2 axis_;
};

}  // namespace detail

// The fraction of the sweep at which the polygon is within a skin of the edge; nothing if it passes
// by, overlaps already, or the search fails.
inline std::optional<float> time_of_impact(const Edge& edge, const Shape& shape,
                                           const Sweep& whole_sweep) {
  constexpr int max_axes = 20;
  constexpr int max_push_backs = 16;
  constexpr int max_root_steps = 50;
  constexpr float both_skins = kSkin + kSkin;
  constexpr float target = larger(kLinearSlop, both_skins - 3.0f * kLinearSlop);
  constexpr float tolerance = 0.25f * kLinearSlop;

  // Whole turns are taken off, for the root finder loses digits to them.
  Sweep sweep = whole_sweep;
  constexpr float turn = 2.0f * kPi;
  const float turns = turn * std::floor(sweep.start_angle / turn);
  sweep.start_angle -= turns;
  sweep.angle -= turns;

  const Corners edge_corners = corners(edge);
  const Corners polygon_corners = corners(shape);
  SimplexMemory memory{};
  float safe = 0.0f;  // nothing touches up to here
  for (int axes = 0; axes < max_axes; ++axes) {
    const float gap = distance(edge_corners, polygon_corners,
                               transform_at(sweep, shape.local_center, safe), memory);
    if (gap <= 0.0f) return std::nullopt;
    if (gap < target + tolerance) return safe;

    const detail::SeparationAxis axis(memory, edge_corners, polygon_corners, sweep,
                                      shape.local_center, safe);
    float late = 1.0f;
    for (int push_backs = 0; push_backs < max_push_backs; ++push_backs) {
      const auto witness = axis.deepest(late);
      float late_separation = axis.separation(witness, late);
      if (late_separation > target + tolerance) return std::nullopt;
      if (late_separation > target - tolerance) {
        safe = late;
        break;
      }
      float safe_separation = axis.separation(witness, safe);
      if (safe_separation < target - tolerance) return std::nullopt;
      if (safe_separation <= target + tolerance) return safe;

      float low = safe;
      float high = late;
      for (int step = 0; step < max_root_steps; ++step) {
        // The secant converges faster, halving cannot get stuck: they take turns.
        const bool secant = (step & 1) != 0;
        const float time = secant ? low + (target - safe_separation) * (high - low) /
                                              (late_separation - safe_separation)
                                  : 0.5f * (low + high);
        const float separation = axis.separation(witness, time);
        if (magnitude(separation - target) < tolerance) {
          late = time;
          break;
        }
        if (separation > target) {
          low = time;
          safe_separation = separation;
        } else {
          high = time;
          late_separation = separation;
        }
      }
    }
  }
  return std::nullopt;
}

}  // namespace touchdown

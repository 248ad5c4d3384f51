// The time of impact: when, within a step, a moving polygon first comes close to an edge.
//
// Box2D: b2TimeOfImpact and b2SeparationFunction. Conservative advancement along separating axes:
// find the axis between the nearest features (by GJK), find the time at which the deepest vertex
// along it reaches the target distance, and repeat from there.
#pragma once

#include <cfloat>
#include <cmath>
#include <optional>

#include "engine/distance.hpp"
#include "engine/math.hpp"
#include "engine/settings.hpp"
#include "engine/shapes.hpp"
#include "engine/sweep.hpp"
#include "engine/terrain.hpp"

namespace touchdown::engine {

namespace detail {

// Separation as a function of time, along an axis that is fixed to the shape whose feature it is.
class SeparationFunction {
 public:
  SeparationFunction(const SimplexCache& nearest, const DistanceProxy& edge,
                     const DistanceProxy& polygon, const Sweep& sweep, Vec2 local_center,
                     float time)
      : edge_(edge), polygon_(polygon), sweep_(sweep), local_center_(local_center) {
    const Transform body = transform_at(sweep, local_center, time);
    const Vec2 edge_vertex = edge.vertices[nearest.edge_indices[0]];
    const Vec2 polygon_vertex = polygon.vertices[nearest.polygon_indices[0]];
    if (nearest.count == 1) {
      kind_ = Kind::kPoints;
      axis_ = to_world(body, polygon_vertex) - to_world(kMoonTransform, edge_vertex);
      normalize(axis_);
    } else if (nearest.edge_indices[0] == nearest.edge_indices[1]) {
      kind_ = Kind::kPolygonFace;
      set_face(polygon_vertex, polygon.vertices[nearest.polygon_indices[1]]);
      if (distance_to_face(body, to_world(kMoonTransform, edge_vertex)) < 0.0f) axis_ = -axis_;
    } else {
      kind_ = Kind::kEdgeFace;
      set_face(edge_vertex, edge.vertices[nearest.edge_indices[1]]);
      if (distance_to_face(kMoonTransform, to_world(body, polygon_vertex)) < 0.0f) axis_ = -axis_;
    }
  }

  // The vertices that are deepest at a time; that of the face's own shape is not used.
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
        return distance_to_face(kMoonTransform,
                                to_world(body, polygon_.vertices[witness.polygon_index]));
      case Kind::kPolygonFace:
        break;
    }
    return distance_to_face(body, to_world(kMoonTransform, edge_.vertices[witness.edge_index]));
  }

 private:
  enum class Kind { kPoints, kEdgeFace, kPolygonFace };

  void set_face(Vec2 from, Vec2 to) {
    axis_ = cross(to - from, 1.0f);
    normalize(axis_);
    face_point_ = 0.5f * (from + to);
  }

  // Signed distance of a point in front of the face.
  float distance_to_face(const Transform& owner, Vec2 point) const {
    return dot(point - to_world(owner, face_point_), rotate(owner.rotation, axis_));
  }

  const DistanceProxy& edge_;
  const DistanceProxy& polygon_;
  const Sweep& sweep_;
  Vec2 local_center_;
  Kind kind_;
  Vec2 face_point_{};
  Vec2 axis_;
};

inline constexpr float kTotalRadius = kPolygonRadius + kPolygonRadius;
inline constexpr float kTargetDistance = larger(kLinearSlop, kTotalRadius - 3.0f * kLinearSlop);
inline constexpr float kDistanceTolerance = 0.25f * kLinearSlop;

// Whether the polygon is so far from the edge, compared with its motion, that the search below
// cannot find an impact, whatever it rounds. `end` is the body's transform at the end of the sweep.
inline bool is_out_of_reach(const Edge& edge, const Shape& shape, const Sweep& sweep,
                            const Transform& end) {
  // The search finds an impact only at a distance of at most the target and its tolerance.
  // Roundings are far below the margin: coordinates are some metres, and a float has seven digits.
  constexpr float margin = 0.2f * kLinearSlop;
  constexpr float reach = kTargetDistance + kDistanceTolerance + margin;
  const Vec2 motion = sweep.center - sweep.start_center;
  const float moved = magnitude(motion.x) + magnitude(motion.y) +
                      shape.radius * magnitude(sweep.angle - sweep.start_angle);
  // How far the polygon is in front of the edge's line, behind it, or past one of its ends.
  const Vec2 along{-edge.normal.y, edge.normal.x};
  float front = FLT_MAX, behind = FLT_MAX, before = FLT_MAX, past = FLT_MAX;
  for (int i = 0; i < shape.count; ++i) {
    const Vec2 vertex = to_world(end, shape.vertices[i]);
    const Vec2 from_start = vertex - edge.start;
    const float height = dot(edge.normal, from_start);
    front = smaller(front, height);
    behind = smaller(behind, -height);
    before = smaller(before, -dot(along, from_start));
    past = smaller(past, dot(along, vertex - edge.end));
  }
  return larger(larger(front, behind), larger(before, past)) > reach + moved;
}

}  // namespace detail

// The fraction of the sweep at which the polygon comes within the skins' distance of the edge;
// nothing if it passes by, overlaps from the start, or the search fails.
inline std::optional<float> time_of_impact(const Edge& edge, const Shape& shape,
                                           const Sweep& whole_sweep) {
  constexpr int max_axes = 20;
  constexpr int max_push_backs = 16;
  constexpr int max_root_steps = 50;
  constexpr float target = detail::kTargetDistance;
  constexpr float tolerance = detail::kDistanceTolerance;

  // Whole turns are subtracted (b2Sweep::Normalize), since large angles cost the root finder
  // digits.
  Sweep sweep = whole_sweep;
  constexpr float turn = 2.0f * kPi;
  const float turns = turn * std::floor(sweep.start_angle / turn);
  sweep.start_angle -= turns;
  sweep.angle -= turns;

  const DistanceProxy edge_proxy = distance_proxy(edge);
  const DistanceProxy polygon_proxy = distance_proxy(shape);
  SimplexCache cache{};
  float safe = 0.0f;  // no contact up to this time
  for (int axes = 0; axes < max_axes; ++axes) {
    const float separation_now =
        distance(edge_proxy, polygon_proxy, transform_at(sweep, shape.local_center, safe), cache);
    if (separation_now <= 0.0f) return std::nullopt;
    if (separation_now < target + tolerance) return safe;

    const detail::SeparationFunction axis(cache, edge_proxy, polygon_proxy, sweep,
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
        // The secant method converges faster, bisection cannot get stuck: they alternate.
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

}  // namespace touchdown::engine

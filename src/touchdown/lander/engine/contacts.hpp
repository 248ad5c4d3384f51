// Which bodies touch which edges, from step to step.
//
// Boxes that overlap make a pair; a pair lives until its boxes part, and is looked at every step.
// Order matters to the last bit: pairs begin in the order of their edges, then of their bodies, and
// everything that walks over them starts with the newest.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "bodies.hpp"
#include "manifold.hpp"
#include "terrain.hpp"

namespace touchdown {

struct Contact {
  Manifold manifold;
  float impact_time;  // as a fraction of the step, if `impact_known`
  std::uint8_t body;
  std::uint8_t edge;
  std::uint8_t touching;
  std::uint8_t enabled;  // off for the rest of a step in which its impact came to nothing
  std::uint8_t impact_known;
  std::uint8_t num_impacts;
};

struct Contacts {
  std::int32_t count;
  std::array<Contact, kMaxContacts> items;  // the oldest first
};

// What stock's listener keeps. Its rules are coarser than the truth: a leg that leaves one edge
// counts as flying though it may stand on the next, and a hull that has touched is lost for good.
struct Touches {
  std::array<std::uint8_t, kNumLegs> legs;
  std::uint8_t hull;
};

inline void begin_touch(Touches& touches, int body) {
  if (body == kHull) {
    touches.hull = 1;
  } else {
    touches.legs[body - kLeg0] = 1;
  }
}

inline void end_touch(Touches& touches, int body) {
  if (body != kHull) touches.legs[body - kLeg0] = 0;
}

// Looks at a pair again where its body now is; points that it still has keep their impulses.
inline void update(Contact& contact, const Terrain& terrain, Body& body, Touches& touches) {
  const Manifold before = contact.manifold;
  contact.enabled = 1;
  Manifold& now = contact.manifold;
  now = collide(terrain.edges[contact.edge], kShapes[contact.body], body.transform);
  for (std::uint32_t i = 0; i < now.count; ++i) {
    for (std::uint32_t j = 0; j < before.count; ++j) {
      if (before.points[j].name == now.points[i].name) {
        now.points[i].normal_impulse = before.points[j].normal_impulse;
        now.points[i].tangent_impulse = before.points[j].tangent_impulse;
        break;
      }
    }
  }
  const bool touched = contact.touching != 0;
  const bool touches_now = now.count > 0;
  contact.touching = touches_now ? 1 : 0;
  if (touches_now == touched) return;
  wake(body);
  if (touches_now) {
    begin_touch(touches, contact.body);
  } else {
    end_touch(touches, contact.body);
  }
}

inline bool has_contact(const Contacts& contacts, int edge, int body) {
  for (int i = 0; i < contacts.count; ++i) {
    if (contacts.items[i].edge == edge && contacts.items[i].body == body) return true;
  }
  return false;
}

// Adds the pairs whose boxes have come to overlap.
inline void find_new(Contacts& contacts, const Terrain& terrain,
                     std::array<Body, kNumBodies>& bodies) {
  const bool all_above =
      std::all_of(bodies.begin(), bodies.end(),
                  [&](const Body& body) { return body.fat_box.lower.y > terrain.top; });
  if (all_above) return;
  for (int edge = 0; edge < kNumEdges; ++edge) {
    for (int body = 0; body < kNumBodies; ++body) {
      if (!overlap(terrain.edges[edge].fat_box, bodies[body].fat_box)) continue;
      if (has_contact(contacts, edge, body)) continue;
      Contact& added = contacts.items[contacts.count++];
      added = {};
      added.body = static_cast<std::uint8_t>(body);
      added.edge = static_cast<std::uint8_t>(edge);
      added.enabled = 1;
      wake(bodies[body]);
    }
  }
}

inline void remove(Contacts& contacts, int index, std::array<Body, kNumBodies>& bodies,
                   Touches& touches) {
  const Contact& gone = contacts.items[index];
  if (gone.touching != 0) end_touch(touches, gone.body);
  if (gone.manifold.count > 0) wake(bodies[gone.body]);
  --contacts.count;
  for (int i = index; i < contacts.count; ++i) contacts.items[i] = contacts.items[i + 1];
}

// Looks at all pairs of bodies that are awake, and drops those whose boxes have parted.
inline void update_all(Contacts& contacts, const Terrain& terrain,
                       std::array<Body, kNumBodies>& bodies, Touches& touches) {
  for (int i = contacts.count - 1; i >= 0; --i) {
    Contact& contact = contacts.items[i];
    Body& body = bodies[contact.body];
    if (body.awake == 0) continue;
    if (overlap(terrain.edges[contact.edge].fat_box, body.fat_box)) {
      update(contact, terrain, body, touches);
    } else {
      remove(contacts, i, bodies, touches);
    }
  }
}

// Stretches a body's box over its way from `start`, and ahead of it, once it has left the box.
inline void move_box(Body& body, const Shape& shape, const Transform& start) {
  const Box swept = around(bounding_box(shape, start), bounding_box(shape, body.transform));
  if (contains(body.fat_box, swept)) return;
  body.fat_box = grown(swept, kBoxMargin);
  const Vec2 ahead = 2.0f * (body.transform.origin - start.origin);
  (ahead.x < 0.0f ? body.fat_box.lower.x : body.fat_box.upper.x) += ahead.x;
  (ahead.y < 0.0f ? body.fat_box.lower.y : body.fat_box.upper.y) += ahead.y;
}

}  // namespace touchdown

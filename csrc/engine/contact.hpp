// A contact: a body and an edge whose fat boxes overlap, with the manifold where they touch.
//
// Box2D: b2Contact and b2Contact::Update. The flags are those of Gymnasium's ContactDetector, a
// b2ContactListener.
#pragma once

#include <array>
#include <cstdint>

#include "engine/body.hpp"
#include "engine/manifold.hpp"
#include "engine/terrain.hpp"

namespace touchdown::engine {

struct Contact {
  Manifold manifold;
  float toi;  // time of impact as a fraction of the step, valid if `toi_known`
  std::uint8_t body;
  std::uint8_t edge;
  std::uint8_t touching;
  std::uint8_t enabled;  // off for the rest of a step after an event that led to no touch
  std::uint8_t toi_known;
  std::uint8_t toi_count;  // time-of-impact events in this step
};

struct Contacts {
  std::int32_t count;
  std::array<Contact, kMaxContacts> items;  // oldest first
};

// What stock's listener keeps. It is coarser than the truth: a leg that leaves one edge counts as
// off the ground though it may stand on the next, and the hull's flag is never cleared.
struct ContactFlags {
  std::array<std::uint8_t, kNumLegs> legs;
  std::uint8_t hull;
};

inline void begin_contact(ContactFlags& flags, int body) {
  if (body == kHull) {
    flags.hull = 1;
  } else {
    flags.legs[body - kLeg0] = 1;
  }
}

inline void end_contact(ContactFlags& flags, int body) {
  if (body != kHull) flags.legs[body - kLeg0] = 0;
}

// Computes the manifold anew. Points whose feature was there before keep their impulses, for warm
// starting.
inline void update_contact(Contact& contact, const Terrain& terrain, Body& body,
                           ContactFlags& flags) {
  const Manifold before = contact.manifold;
  contact.enabled = 1;
  Manifold& now = contact.manifold;
  now = collide(terrain.edges[contact.edge], kShapes[contact.body], body.transform);
  for (std::uint32_t i = 0; i < now.count; ++i) {
    for (std::uint32_t j = 0; j < before.count; ++j) {
      if (before.points[j].feature == now.points[i].feature) {
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
    begin_contact(flags, contact.body);
  } else {
    end_contact(flags, contact.body);
  }
}

}  // namespace touchdown::engine

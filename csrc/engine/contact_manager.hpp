// The broad phase: which bodies and edges are close enough to be a contact.
//
// Box2D: b2ContactManager, with the fat boxes of b2BroadPhase. Order matters to the last bit:
// contacts are created in the order of their edges, then of their bodies, and every walk over them
// starts with the newest.
#pragma once

#include <array>
#include <cstdint>

#include "engine/aabb.hpp"
#include "engine/body.hpp"
#include "engine/contact.hpp"
#include "engine/terrain.hpp"

namespace touchdown::engine {

inline bool has_contact(const Contacts& contacts, int edge, int body) {
  for (int i = 0; i < contacts.count; ++i) {
    if (contacts.items[i].edge == edge && contacts.items[i].body == body) return true;
  }
  return false;
}

// Adds the pairs whose boxes have begun to overlap (b2ContactManager::FindNewContacts).
inline void find_new_contacts(Contacts& contacts, const Terrain& terrain,
                              std::array<Body, kNumBodies>& bodies) {
  Aabb all = bodies[kHull].fat_aabb;
  for (int leg = kLeg0; leg <= kLeg1; ++leg) all = combined(all, bodies[leg].fat_aabb);
  if (all.lower.y > terrain.top) return;
  for (int edge = 0; edge < kNumEdges; ++edge) {
    if (!overlap(terrain.edges[edge].fat_aabb, all)) continue;
    for (int body = 0; body < kNumBodies; ++body) {
      if (!overlap(terrain.edges[edge].fat_aabb, bodies[body].fat_aabb)) continue;
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

// b2ContactManager::Destroy.
inline void destroy_contact(Contacts& contacts, int index, std::array<Body, kNumBodies>& bodies,
                            ContactFlags& flags) {
  const Contact& gone = contacts.items[index];
  if (gone.touching != 0) end_contact(flags, gone.body);
  if (gone.manifold.count > 0) wake(bodies[gone.body]);
  --contacts.count;
  for (int i = index; i < contacts.count; ++i) contacts.items[i] = contacts.items[i + 1];
}

// Updates the contacts of awake bodies and removes those whose boxes have separated
// (b2ContactManager::Collide).
inline void update_contacts(Contacts& contacts, const Terrain& terrain,
                            std::array<Body, kNumBodies>& bodies, ContactFlags& flags) {
  for (int i = contacts.count - 1; i >= 0; --i) {
    Contact& contact = contacts.items[i];
    Body& body = bodies[contact.body];
    if (body.awake == 0) continue;
    if (overlap(terrain.edges[contact.edge].fat_aabb, body.fat_aabb)) {
      update_contact(contact, terrain, body, flags);
    } else {
      destroy_contact(contacts, i, bodies, flags);
    }
  }
}

}  // namespace touchdown::engine

// One step of the physics: update contacts, solve the island, then continuous collision.
//
// Box2D: b2World::Step, split at the velocity iterations so that many environments can share them.
#pragma once

#include <algorithm>
#include <cstdint>

#include "engine/body.hpp"
#include "engine/contact_manager.hpp"
#include "engine/continuous_collision.hpp"
#include "engine/coverage.hpp"
#include "engine/island.hpp"
#include "engine/world.hpp"

namespace touchdown::engine {

// Everything before the velocity iterations. Returns whether there are any: a sleeping world has
// none.
inline bool begin_step(World& world, StepState& state, Coverage& coverage) {
  update_contacts(world.contacts, world.terrain, world.bodies, world.contact_flags);
  bool any_awake = false;
  for (const Body& body : world.bodies) any_awake = any_awake || body.awake != 0;
  if (any_awake) begin_solve(world, state, coverage);
  return any_awake;
}

// Everything after `finish_solve`, or after `begin_step` if there was nothing to solve.
inline void end_step(World& world, Coverage& coverage) {
  solve_continuous(world, coverage);
  for (Body& body : world.bodies) {
    body.force = {0.0f, 0.0f};
    body.torque = 0.0f;
  }
  ++coverage.steps;
  coverage.most_pairs =
      std::max(coverage.most_pairs, static_cast<std::uint64_t>(world.contacts.count));
}

}  // namespace touchdown::engine

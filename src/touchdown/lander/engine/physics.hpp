// One step of the physics: look at the contacts, solve, see what hits the moon on the way.
#pragma once

#include <algorithm>
#include <cstdint>

#include "bodies.hpp"
#include "contacts.hpp"
#include "coverage.hpp"
#include "impacts.hpp"
#include "island.hpp"
#include "world.hpp"

namespace touchdown {

// Up to the velocity iterations. Says whether there are any: a world asleep has none.
inline bool begin_step(World& world, Solving& solving, Coverage& coverage) {
  update_all(world.contacts, world.terrain, world.bodies, world.touches);
  bool any_awake = false;
  for (const Body& body : world.bodies) any_awake = any_awake || body.awake != 0;
  if (any_awake) begin_solve(world, solving, coverage);
  return any_awake;
}

inline void finish_step(World& world, bool solved, Solving& solving, Coverage& coverage) {
  if (solved) finish_solve(world, solving, coverage);
  solve_impacts(world, coverage);
  for (Body& body : world.bodies) {
    body.force = {0.0f, 0.0f};
    body.torque = 0.0f;
  }
  ++coverage.steps;
  coverage.most_pairs =
      std::max(coverage.most_pairs, static_cast<std::uint64_t>(world.contacts.count));
}

}  // namespace touchdown

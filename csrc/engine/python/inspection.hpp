// What Python can read of a batch and copy within it: snapshots, states, terrain, coverage.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/coverage.hpp"
#include "engine/lander.hpp"
#include "engine/python/batch.hpp"
#include "engine/snapshot.hpp"

namespace touchdown::engine {

inline nb::bytes snapshot_one(Batch& batch, std::int64_t index) {
  const auto bytes = snapshot(lander_at(batch, index));
  return nb::bytes(bytes.data(), bytes.size());
}

inline void restore_one(Batch& batch, std::int64_t index, const nb::bytes& bytes) {
  Lander& lander = lander_at(batch, index);
  lander = restored({static_cast<const std::byte*>(bytes.data()), bytes.size()}, lander.config);
}

inline void copy_to(Batch& batch, std::int64_t from, const std::vector<std::int64_t>& to) {
  const Lander source = lander_at(batch, from);
  for (const std::int64_t index : to) lander_at(batch, index);
  for (const std::int64_t index : to) lander_at(batch, index) = source;
}

inline constexpr std::size_t kBodyFloats = 6;

inline void read_states(const Batch& batch,
                        const Array<float, nb::shape<-1, kNumBodies, 6>>& bodies,
                        const Array<bool, nb::shape<-1, kNumLegs>>& leg_contacts,
                        const Vector<bool>& awake, const Array<double, nb::shape<-1, 3>>& engines) {
  need_idle(batch);
  need_rows(batch, bodies.shape(0), "bodies");
  need_rows(batch, leg_contacts.shape(0), "leg_contacts");
  need_rows(batch, awake.shape(0), "awake");
  need_rows(batch, engines.shape(0), "engines");
  for (std::size_t i = 0; i < batch.landers.size(); ++i) {
    const Lander& lander = batch.landers[i];
    for (std::size_t j = 0; j < kNumBodies; ++j) {
      const Body& body = lander.world.bodies[j];
      const std::array<float, kBodyFloats> row{body.transform.origin.x, body.transform.origin.y,
                                               body.sweep.angle,        body.linear_velocity.x,
                                               body.linear_velocity.y,  body.angular_velocity};
      std::copy(row.begin(), row.end(), &bodies(i, j, 0));
    }
    for (std::size_t j = 0; j < kNumLegs; ++j) {
      leg_contacts(i, j) = lander.world.contact_flags.legs[j] != 0;
    }
    awake(i) = lander.world.bodies[kHull].awake != 0;
    engines(i, 0) = lander.throttle.main;
    engines(i, 1) = lander.throttle.side * lander.throttle.direction;
    engines(i, 2) = lander.fuel;
  }
}

inline void read_terrain(Batch& batch, std::int64_t index,
                         const Array<double, nb::shape<kNumHeights, 2>>& points) {
  const Lander& lander = lander_at(batch, index);
  for (std::size_t i = 0; i < kNumHeights; ++i) {
    points(i, 0) = kChunk * static_cast<double>(i);
    points(i, 1) = lander.world.terrain.heights[i];
  }
}

template <std::size_t N>
nb::tuple counts(const std::array<std::uint64_t, N>& values) {
  nb::list list;
  for (const std::uint64_t value : values) list.append(value);
  return nb::tuple(list);
}

inline nb::dict coverage_of(const Batch& batch) {
  need_idle(batch);
  Coverage c{};
  for (const Workspace& workspace : batch.workspaces) c += workspace.coverage;
  nb::dict d;
  d["steps"] = c.steps;
  d["steps_with_impacts"] = counts(c.steps_with_impacts);
  d["steps_with_contacts"] = counts(c.steps_with_contacts);
  d["impacts_undone"] = c.impacts_undone;
  d["all_position_iterations"] = c.all_position_iterations;
  d["one_point_manifolds"] = c.one_point_manifolds;
  d["two_point_manifolds"] = c.two_point_manifolds;
  d["redundant_points"] = c.redundant_points;
  d["block_cases"] = counts(c.block_cases);
  d["limit_switches"] = c.limit_switches;
  d["fell_asleep"] = c.fell_asleep;
  d["woke_up"] = c.woke_up;
  d["one_leg_steps"] = c.one_leg_steps;
  d["most_pairs"] = c.most_pairs;
  return d;
}

}  // namespace touchdown::engine

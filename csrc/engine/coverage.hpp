// Counts of the rare paths that flights took: an exactness test that never met them proves nothing.
//
// Here an impact is one of Box2D's time-of-impact events.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "engine/velocity_constraints.hpp"

namespace touchdown::engine {

inline constexpr int kMaxImpactsCounted = 5;
inline constexpr int kMaxContactsCounted = 7;

struct Coverage {
  std::uint64_t steps;
  // Steps by the number of impacts, and of contacts in the island; the last entry counts more, too.
  std::array<std::uint64_t, kMaxImpactsCounted> steps_with_impacts;
  std::array<std::uint64_t, kMaxContactsCounted> steps_with_contacts;
  std::uint64_t impacts_undone;           // impacts after which the shapes did not touch
  std::uint64_t all_position_iterations;  // steps that used all 60
  std::uint64_t one_point_manifolds;
  std::uint64_t two_point_manifolds;
  std::uint64_t redundant_points;  // two points too close together to be solved at once
  std::array<std::uint64_t, kNumBlockCases> block_cases;  // contacts that met the case in a step
  std::uint64_t limit_switches;
  std::uint64_t fell_asleep;
  std::uint64_t woke_up;
  std::uint64_t one_leg_steps;
  std::uint64_t most_pairs;

  Coverage& operator+=(const Coverage& other) {
    const std::uint64_t most = std::max(most_pairs, other.most_pairs);
    std::array<std::uint64_t, sizeof(Coverage) / sizeof(std::uint64_t)> mine;
    auto theirs = mine;
    std::memcpy(&mine, this, sizeof(mine));
    std::memcpy(&theirs, &other, sizeof(theirs));
    for (std::size_t i = 0; i < mine.size(); ++i) mine[i] += theirs[i];
    std::memcpy(static_cast<void*>(this), &mine, sizeof(mine));
    most_pairs = most;
    return *this;
  }
};

}  // namespace touchdown::engine

// Counts of the rare paths a flight took: an exactness test that never went there proves nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "rows.hpp"

namespace touchdown {

inline constexpr int kMaxImpactsCounted = 5;
inline constexpr int kMaxContactsCounted = 7;

struct Coverage {
  std::uint64_t steps;
  std::array<std::uint64_t, kMaxImpactsCounted> steps_with_impacts;    // the last: as many or more
  std::array<std::uint64_t, kMaxContactsCounted> steps_with_contacts;  // solved ones; as above
  std::uint64_t impacts_undone;                                        // ended without touching
  std::uint64_t all_position_iterations;                               // steps that used them all
  std::uint64_t one_point_manifolds;
  std::uint64_t two_point_manifolds;
  std::uint64_t redundant_points;  // two points too close together to be solved at once
  std::array<std::uint64_t, kNumBlockCases> block_cases;  // rows that met the case in a step
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

}  // namespace touchdown

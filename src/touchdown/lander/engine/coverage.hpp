// Counts of the rare paths a flight took: an exactness test that never went there proves nothing.
#pragma once

#include <array>
#include <cstdint>

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
};

}  // namespace touchdown

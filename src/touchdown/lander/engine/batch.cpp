#include "batch.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "lane_solver.hpp"

namespace touchdown {

namespace {

// Small enough to stay in the second-level cache, large enough to fill lanes with rows alike.
constexpr std::size_t kBlock = 128;

// Says all that has to be alike to be solved in lanes; 0 for rows that have too many contacts.
std::uint64_t layout_of(const VelocityRows& rows) {
  if (rows.num_contacts > kMostLaneContacts) return 0;
  std::uint64_t layout = 1;
  for (const auto& joint : rows.joints) {
    layout = layout << 3 | static_cast<std::uint64_t>(joint.leg) << 1 |
             static_cast<std::uint64_t>(joint.at_stop);
  }
  for (int i = 0; i < rows.num_contacts; ++i) {
    const auto& contact = rows.contacts[static_cast<std::size_t>(i)];
    layout = layout << 4 | static_cast<std::uint64_t>(contact.body) << 2 |
             static_cast<std::uint64_t>(contact.num_points);
  }
  return layout;
}

struct Ordered {
  std::uint64_t layout;
  VelocityRows* rows;
};

void solve(std::span<Ordered> all) {
  std::sort(all.begin(), all.end(), [](const Ordered& a, const Ordered& b) {
    return a.layout != b.layout ? a.layout < b.layout : a.rows < b.rows;
  });
  const Kernel& lanes = kernel();
  std::array<VelocityRows*, kBlock> alike;
  for (std::size_t first = 0; first < all.size();) {
    if (all[first].layout == 0) {
      iterate_velocities(*all[first++].rows);
      continue;
    }
    std::size_t count = 0;
    const std::uint64_t layout = all[first].layout;
    while (first < all.size() && all[first].layout == layout &&
           count < static_cast<std::size_t>(lanes.lanes)) {
      alike[count++] = all[first++].rows;
    }
    lanes.solve({alike.data(), count});
  }
}

void step_block(std::span<Lander> landers, std::span<const Throttle> throttles,
                std::span<const unsigned char> active, const Results& results,
                std::vector<Solving>& solving) {
  std::array<bool, kBlock> solves;
  std::array<Ordered, kBlock> ordered;
  std::size_t count = 0;
  for (std::size_t i = 0; i < landers.size(); ++i) {
    if (active[i] == 0) continue;
    solves[i] = begin_step(landers[i], throttles[i], solving[i]);
    if (solves[i]) ordered[count++] = {layout_of(solving[i].rows), &solving[i].rows};
  }
  solve({ordered.data(), count});
  for (std::size_t i = 0; i < landers.size(); ++i) {
    if (active[i] == 0) continue;
    const Transition transition = finish_step(landers[i], solves[i], solving[i]);
    std::copy(transition.observation.begin(), transition.observation.end(),
              results.observations + i * kObservationSize);
    results.rewards[i] = transition.reward;
    results.terminated[i] = transition.terminated;
  }
}

}  // namespace

void step(std::span<Lander> landers, std::span<const Throttle> throttles,
          std::span<const unsigned char> active, const Results& results) {
  thread_local std::vector<Solving> solving(kBlock);
  for (std::size_t first = 0; first < landers.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, landers.size() - first);
    step_block(landers.subspan(first, count), throttles.subspan(first, count),
               active.subspan(first, count),
               {results.observations + first * kObservationSize, results.rewards + first,
                results.terminated + first},
               solving);
  }
}

}  // namespace touchdown

// The kernel: solves constraints and moves bodies in lanes. It is compiled once per instruction set
// (see simd/kernel_target.hpp).
#include <array>
#include <cstddef>
#include <cstring>
#include <span>

#include "engine/contact_velocity_solver.hpp"
#include "engine/joint_velocity_solver.hpp"
#include "engine/kernel.hpp"
#include "engine/lane_groups.hpp"
#include "engine/lane_motion.hpp"
#include "engine/lanes.hpp"
#include "engine/velocity_constraints.hpp"
#include "simd/kernel_target.hpp"

namespace touchdown::engine::TOUCHDOWN_KERNEL {
namespace {

// Two groups of lanes take turns, so that the work of one hides the latency of the other's results.
constexpr std::size_t kGroups = 4;

template <int W>
struct Groups {
  alignas(W * 4) std::array<Group<W>, kGroups> all;
  std::size_t used;
  int max_slots;
};

// Fills the groups with the first of `items`, as many as fit, and returns their number.
template <int W>
std::size_t load(Groups<W>& groups, std::span<VelocityConstraints* const> items) {
  std::size_t taken = 0;
  groups.used = 0;
  groups.max_slots = 0;
  while (taken < items.size() && groups.used < kGroups) {
    Group<W>& group = groups.all[groups.used++];
    load(group, items.subspan(taken));
    taken += group.items.size();
    if (groups.max_slots < group.slots.count) groups.max_slots = group.slots.count;
  }
  return taken;
}

template <int W>
void solve_contacts(Groups<W>& groups) {
  for (int i = 0; i < groups.max_slots; ++i) {
    for (std::size_t g = 0; g < groups.used; ++g) {
      Group<W>& group = groups.all[g];
      if (i >= group.slots.count) continue;
      solve_velocity_constraint(group.contacts[static_cast<std::size_t>(i)], group.velocities);
    }
  }
}

template <int W>
void run(Groups<W>& groups, int iterations) {
  for (int iteration = 0; iteration < iterations; ++iteration) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      for (std::size_t g = 0; g < groups.used; ++g) {
        Group<W>& group = groups.all[g];
        solve_velocity_constraint(group.joints[i], group.velocities);
      }
    }
    solve_contacts(groups);
  }
}

// All that an iteration in flight reads of what earlier iterations have changed.
template <int W>
struct CycleState {
  BasicVelocities<Floats<W>> velocities;
  std::array<Floats<W>, kNumLegs> motor_impulses;
  std::array<Floats<W>, kNumLegs> limit_impulses;
};

template <int W>
CycleState<W> cycle_state(const Group<W>& group) {
  return {group.velocities,
          {group.joints[0].motor_impulse, group.joints[1].motor_impulse},
          {group.joints[0].limit_impulse, group.joints[1].limit_impulse}};
}

// Which lanes hold the same bits; comparing floats would not tell the two zeros apart.
template <int W>
std::array<bool, W> same(const CycleState<W>& a, const CycleState<W>& b) {
  using Bits = typename Lanes<W>::Bits;
  constexpr std::size_t count = sizeof(CycleState<W>) / sizeof(Bits);
  std::array<Bits, count> bits_a;
  std::array<Bits, count> bits_b;
  std::memcpy(&bits_a, &a, sizeof(a));
  std::memcpy(&bits_b, &b, sizeof(b));
  Bits differ{};
  for (std::size_t i = 0; i < count; ++i) differ |= bits_a[i] ^ bits_b[i];
  std::array<bool, W> equal;
  for (std::size_t lane = 0; lane < W; ++lane) equal[lane] = differ[lane] == 0;
  return equal;
}

// The impulses of the joints' points in each iteration of a window.
template <int W>
using Window = std::array<std::array<std::array<Vec<Floats<W>>, kGroups>, kNumLegs>, kWindow>;

template <int W>
void record_window(Groups<W>& groups, Window<W>& window) {
  for (auto& impulses : window) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      for (std::size_t g = 0; g < groups.used; ++g) {
        Group<W>& group = groups.all[g];
        impulses[i][g] = solve_velocity_constraint(group.joints[i], group.velocities);
      }
    }
    solve_contacts(groups);
  }
}

template <int W>
void repeat_window(Groups<W>& groups, const Window<W>& window) {
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    for (const auto& impulses : window) {
      for (std::size_t i = 0; i < kNumLegs; ++i) {
        for (std::size_t g = 0; g < groups.used; ++g) {
          groups.all[g].joints[i].impulse += impulses[i][g];
        }
      }
    }
  }
}

template <int W>
void iterate(std::span<VelocityConstraints* const> items, int iterations) {
  Groups<W> groups;
  while (!items.empty()) {
    items = items.subspan(load(groups, items));
    run(groups, iterations);
    for (std::size_t g = 0; g < groups.used; ++g) {
      Group<W>& group = groups.all[g];
      for (std::size_t lane = 0; lane < group.items.size(); ++lane) {
        store(group, static_cast<int>(lane));
      }
    }
  }
}

// Stores the lanes of which `done` is `wanted`.
template <int W>
void store_those(Groups<W>& groups, std::span<const bool> done, bool wanted) {
  std::size_t index = 0;
  for (std::size_t g = 0; g < groups.used; ++g) {
    Group<W>& group = groups.all[g];
    for (std::size_t lane = 0; lane < group.items.size(); ++lane) {
      if (done[index++] == wanted) store(group, static_cast<int>(lane));
    }
  }
}

template <int W>
void start(std::span<VelocityConstraints* const> items, std::span<bool> done) {
  Groups<W> groups;
  alignas(W * 4) Window<W> window;
  while (!items.empty()) {
    const std::size_t taken = load(groups, items);
    run(groups, kWindow);
    std::array<CycleState<W>, kGroups> before;
    for (std::size_t g = 0; g < groups.used; ++g) before[g] = cycle_state(groups.all[g]);
    record_window(groups, window);

    std::size_t index = 0;
    bool any_done = false;
    for (std::size_t g = 0; g < groups.used; ++g) {
      const Group<W>& group = groups.all[g];
      const auto equal = same<W>(before[g], cycle_state(group));
      for (std::size_t lane = 0; lane < group.items.size(); ++lane) {
        const bool cycles = equal[lane] && group.items[lane]->num_contacts == 0;
        any_done = any_done || cycles;
        done[index++] = cycles;
      }
    }
    store_those(groups, done, false);
    if (any_done) {
      repeat_window(groups, window);
      store_those(groups, done, true);
    }
    items = items.subspan(taken);
    done = done.subspan(taken);
  }
}

}  // namespace

extern const SolverKernel kKernel{2 * TOUCHDOWN_WIDTH, &iterate<TOUCHDOWN_WIDTH>,
                                  &start<TOUCHDOWN_WIDTH>, &integrate<TOUCHDOWN_WIDTH>,
                                  &place<TOUCHDOWN_WIDTH>};

}  // namespace touchdown::engine::TOUCHDOWN_KERNEL

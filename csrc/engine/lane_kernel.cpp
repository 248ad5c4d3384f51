// The kernel: solves constraints and moves bodies in lanes. It is compiled once per instruction set
// (see simd/kernel_target.hpp).
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "engine/contact_velocity_solver.hpp"
#include "engine/joint_velocity_solver.hpp"
#include "engine/kernel.hpp"
#include "engine/lane_groups.hpp"
#include "engine/lane_motion.hpp"
#include "engine/lane_pair.hpp"
#include "engine/lanes.hpp"
#include "engine/velocity_constraints.hpp"
#include "simd/kernel_target.hpp"

namespace touchdown::engine::TOUCHDOWN_KERNEL {
namespace {

template <typename F>
void solve_contacts(Group<F>& group) {
  for (int i = 0; i < group.slots.count; ++i) {
    solve_velocity_constraint(group.contacts[static_cast<std::size_t>(i)], group.velocities);
  }
}

template <typename F>
void run(Group<F>& group, int iterations) {
  if (group.slots.count == 0 && group.joints[0].leg == kUsualLegs[0]) {
    // Known legs and no contacts: the velocities stay in registers.
    BasicVelocities<F> velocities = group.velocities;
    for (int iteration = 0; iteration < iterations; ++iteration) {
      solve_velocity_constraint(group.joints[0], velocities, kUsualLegs[0]);
      solve_velocity_constraint(group.joints[1], velocities, kUsualLegs[1]);
    }
    group.velocities = velocities;
    return;
  }
  for (int iteration = 0; iteration < iterations; ++iteration) {
    for (auto& joint : group.joints) solve_velocity_constraint(joint, group.velocities);
    solve_contacts(group);
  }
}

// All that an iteration in flight reads of what earlier iterations have changed.
template <typename F>
struct CycleState {
  BasicVelocities<F> velocities;
  std::array<F, kNumLegs> motor_impulses;
  std::array<F, kNumLegs> limit_impulses;
};

template <typename F>
CycleState<F> cycle_state(const Group<F>& group) {
  return {group.velocities,
          {group.joints[0].motor_impulse, group.joints[1].motor_impulse},
          {group.joints[0].limit_impulse, group.joints[1].limit_impulse}};
}

// Which lanes hold the same bits; comparing floats would not tell the two zeros apart.
template <typename F>
std::array<bool, kLanes<F>> same(const CycleState<F>& a, const CycleState<F>& b) {
  using Bits = std::array<std::array<std::uint32_t, kLanes<F>>, sizeof(CycleState<F>) / sizeof(F)>;
  Bits bits_a, bits_b;
  std::memcpy(&bits_a, &a, sizeof(a));
  std::memcpy(&bits_b, &b, sizeof(b));
  std::array<std::uint32_t, kLanes<F>> differ{};
  for (std::size_t i = 0; i < bits_a.size(); ++i) {
    for (std::size_t lane = 0; lane < kLanes<F>; ++lane) {
      differ[lane] |= bits_a[i][lane] ^ bits_b[i][lane];
    }
  }
  std::array<bool, kLanes<F>> equal;
  for (std::size_t lane = 0; lane < kLanes<F>; ++lane) equal[lane] = differ[lane] == 0;
  return equal;
}

// The impulses of the joints' points in each iteration of a window.
template <typename F>
using Window = std::array<std::array<Vec<F>, kNumLegs>, kWindow>;

template <typename F>
void record_window(Group<F>& group, Window<F>& window) {
  for (auto& impulses : window) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      impulses[i] = solve_velocity_constraint(group.joints[i], group.velocities);
    }
    solve_contacts(group);
  }
}

// The joints' sums of impulses once the window has been repeated to the end.
template <typename F>
using Sums = std::array<Vec<F>, kNumLegs>;

template <typename F>
Sums<F> repeat_window(const Group<F>& group, const Window<F>& window) {
  Sums<F> sums{group.joints[0].impulse, group.joints[1].impulse};
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    for (const auto& impulses : window) {
      for (std::size_t i = 0; i < kNumLegs; ++i) sums[i] += impulses[i];
    }
  }
  return sums;
}

template <typename F>
void copy_lane(const Sums<F>& sums, Group<F>& group, std::size_t lane) {
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    for (std::size_t coordinate = 0; coordinate < 2; ++coordinate) {
      const std::size_t at = (coordinate * kLanes<F> + lane) * sizeof(float);
      std::memcpy(reinterpret_cast<std::byte*>(&group.joints[i].impulse) + at,
                  reinterpret_cast<const std::byte*>(&sums[i]) + at, sizeof(float));
    }
  }
}

// Both return how many of `items` they have taken: the first ones, as many as fit.
template <typename F>
std::size_t iterate_few(std::span<VelocityConstraints* const> items, bool begins,
                        const Model& model) {
  Group<F> group;
  load(group, items, begins, model);
  run(group, begins ? kVelocityIterations : kVelocityIterations - 2 * kWindow);
  store(group);
  return group.items.size();
}

template <typename F>
std::size_t start_few(std::span<VelocityConstraints* const> items, std::span<bool> done,
                      const Model& model) {
  Group<F> group;
  load(group, items, true, model);
  run(group, kWindow);
  const CycleState<F> before = cycle_state(group);
  Window<F> window;
  record_window(group, window);
  const auto equal = same(before, cycle_state(group));
  const auto sums = repeat_window(group, window);
  for (std::size_t lane = 0; lane < group.items.size(); ++lane) {
    done[lane] = equal[lane] && group.items[lane]->num_contacts == 0;
    if (done[lane]) copy_lane<F>(sums, group, lane);
  }
  store(group);
  return group.items.size();
}

template <int W>
void iterate(std::span<VelocityConstraints* const> items, bool begins, const Model& model) {
  while (!items.empty()) {
    items = items.subspan(items.size() > W ? iterate_few<Pair<Floats<W>>>(items, begins, model)
                                           : iterate_few<Floats<W>>(items, begins, model));
  }
}

template <int W>
void solve(std::span<VelocityConstraints* const> items, const Model& model) {
  iterate<W>(items, true, model);
}

template <int W>
void resume(std::span<VelocityConstraints* const> items, const Model& model) {
  iterate<W>(items, false, model);
}

template <int W>
void start(std::span<VelocityConstraints* const> items, std::span<bool> done, const Model& model) {
  while (!items.empty()) {
    const std::size_t taken = items.size() > W ? start_few<Pair<Floats<W>>>(items, done, model)
                                               : start_few<Floats<W>>(items, done, model);
    items = items.subspan(taken);
    done = done.subspan(taken);
  }
}

}  // namespace

extern const SolverKernel kKernel{2 * TOUCHDOWN_WIDTH,         &solve<TOUCHDOWN_WIDTH>,
                                  &start<TOUCHDOWN_WIDTH>,     &resume<TOUCHDOWN_WIDTH>,
                                  &integrate<TOUCHDOWN_WIDTH>, &place<TOUCHDOWN_WIDTH>};

}  // namespace touchdown::engine::TOUCHDOWN_KERNEL

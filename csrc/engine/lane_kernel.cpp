// The kernel: puts constraints into lanes, iterates them, and takes the results out. It is compiled
// once per instruction set (see simd/kernel_target.hpp).
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "engine/contact_velocity_solver.hpp"
#include "engine/joint_velocity_solver.hpp"
#include "engine/kernel.hpp"
#include "engine/lanes.hpp"
#include "engine/velocity_constraints.hpp"
#include "simd/kernel_target.hpp"

namespace touchdown::engine::TOUCHDOWN_KERNEL {
namespace {

// Two groups of lanes take turns, so that the work of one hides the latency of the other's results.
constexpr int kGroups = 2;

template <int W>
struct Group {
  BasicVelocities<Floats<W>> velocities;
  std::array<BasicJointConstraint<Floats<W>>, kNumLegs> joints;
  std::array<BasicContactConstraint<Floats<W>>, kMaxContacts> contacts;
};

template <int W>
struct Groups {
  alignas(W * 4) std::array<Group<W>, kGroups> all;
  int used;
  int num_contacts;
};

// Float number `i` of one lane, in a struct seen as an array of vectors.
template <int W>
float* at(void* lanes, std::size_t i, int lane) {
  return static_cast<float*>(lanes) + i * W + static_cast<std::size_t>(lane);
}

template <int W>
void put_in_lane(void* lanes, const void* floats, std::size_t count, int lane) {
  for (std::size_t i = 0; i < count; ++i) {
    *at<W>(lanes, i, lane) = static_cast<const float*>(floats)[i];
  }
}

template <int W>
void take_from_lane(void* lanes, void* floats, std::size_t count, int lane) {
  for (std::size_t i = 0; i < count; ++i) static_cast<float*>(floats)[i] = *at<W>(lanes, i, lane);
}

template <int W>
void load(Groups<W>& groups, std::span<VelocityConstraints* const> alike) {
  const VelocityConstraints& first = *alike.front();
  groups.num_contacts = first.num_contacts;
  groups.used = static_cast<int>(alike.size()) > W ? 2 : 1;

  // Spare lanes repeat the first one's numbers, and their results are ignored.
  for (int slot = 0; slot < groups.used * W; ++slot) {
    const auto index = static_cast<std::size_t>(slot);
    const VelocityConstraints& constraints = index < alike.size() ? *alike[index] : first;
    Group<W>& group = groups.all[index / W];
    const int lane = slot % W;
    put_in_lane<W>(&group.velocities, &constraints.velocities, kVelocityFloats, lane);
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      put_in_lane<W>(&group.joints[i], &constraints.joints[i], kJointFloats, lane);
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(groups.num_contacts); ++i) {
      put_in_lane<W>(&group.contacts[i], &constraints.contacts[i], kContactFloats, lane);
      group.contacts[i].cases_seen[lane] = constraints.contacts[i].cases_seen;
    }
  }
  for (Group<W>& group : groups.all) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      group.joints[i].leg = first.joints[i].leg;
      group.joints[i].at_limit = first.joints[i].at_limit;
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(groups.num_contacts); ++i) {
      group.contacts[i].body = first.contacts[i].body;
      group.contacts[i].num_points = first.contacts[i].num_points;
    }
  }
}

// Writes back only what iterations change.
template <int W>
void store(Groups<W>& groups, VelocityConstraints& constraints, std::size_t slot) {
  Group<W>& group = groups.all[slot / W];
  const auto lane = static_cast<int>(slot % W);
  take_from_lane<W>(&group.velocities, &constraints.velocities, kVelocityFloats, lane);
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    auto& joint = group.joints[i];
    take_from_lane<W>(&joint.impulse, &constraints.joints[i].impulse, 2, lane);
    take_from_lane<W>(&joint.limit_impulse, &constraints.joints[i].limit_impulse, 1, lane);
    take_from_lane<W>(&joint.motor_impulse, &constraints.joints[i].motor_impulse, 1, lane);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(groups.num_contacts); ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      auto& point = group.contacts[i].points[j];
      auto& to = constraints.contacts[i].points[j];
      take_from_lane<W>(&point.normal_impulse, &to.normal_impulse, 1, lane);
      take_from_lane<W>(&point.tangent_impulse, &to.tangent_impulse, 1, lane);
    }
    constraints.contacts[i].cases_seen = group.contacts[i].cases_seen[lane];
  }
}

template <int W>
void run(Groups<W>& groups, int iterations) {
  const auto used = static_cast<std::size_t>(groups.used);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      for (std::size_t g = 0; g < used; ++g) {
        Group<W>& group = groups.all[g];
        solve_velocity_constraint(group.joints[i], group.velocities);
      }
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(groups.num_contacts); ++i) {
      for (std::size_t g = 0; g < used; ++g) {
        Group<W>& group = groups.all[g];
        solve_velocity_constraint(group.contacts[i], group.velocities);
      }
    }
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

template <int W>
void iterate(std::span<VelocityConstraints* const> alike, int iterations) {
  Groups<W> groups;
  load<W>(groups, alike);
  run(groups, iterations);
  for (std::size_t slot = 0; slot < alike.size(); ++slot) store(groups, *alike[slot], slot);
}

template <int W>
void run_cycle(std::span<VelocityConstraints* const> alike, std::span<bool> done) {
  Groups<W> groups;
  load<W>(groups, alike);
  const auto used = static_cast<std::size_t>(groups.used);
  run(groups, kWindow);
  std::array<CycleState<W>, kGroups> before;
  for (std::size_t g = 0; g < used; ++g) before[g] = cycle_state(groups.all[g]);

  alignas(W * 4) Vec<Floats<W>> impulses[kWindow][kNumLegs][kGroups];
  for (auto& window : impulses) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      for (std::size_t g = 0; g < used; ++g) {
        Group<W>& group = groups.all[g];
        window[i][g] = solve_velocity_constraint(group.joints[i], group.velocities);
      }
    }
  }

  std::array<std::array<bool, W>, kGroups> same_lanes;
  for (std::size_t g = 0; g < used; ++g) {
    same_lanes[g] = same<W>(before[g], cycle_state(groups.all[g]));
  }
  for (std::size_t slot = 0; slot < alike.size(); ++slot) {
    done[slot] = same_lanes[slot / W][slot % W];
    if (!done[slot]) store(groups, *alike[slot], slot);
  }
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    for (const auto& window : impulses) {
      for (std::size_t i = 0; i < kNumLegs; ++i) {
        for (std::size_t g = 0; g < used; ++g) groups.all[g].joints[i].impulse += window[i][g];
      }
    }
  }
  for (std::size_t slot = 0; slot < alike.size(); ++slot) {
    if (done[slot]) store(groups, *alike[slot], slot);
  }
}

}  // namespace

extern const SolverKernel kKernel{kGroups * TOUCHDOWN_WIDTH, &iterate<TOUCHDOWN_WIDTH>,
                                  &run_cycle<TOUCHDOWN_WIDTH>};

}  // namespace touchdown::engine::TOUCHDOWN_KERNEL

// One kernel: rows to lanes, 180 iterations, lanes to rows. Compiled once for each instruction set,
// in a namespace of its own, so that no function of a wider set is ever linked into a narrower one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "lane_solver.hpp"
#include "lanes.hpp"
#include "rows.hpp"

namespace touchdown::TOUCHDOWN_KERNEL {
namespace {

// Two groups take turns: while the results of one are on their way, the other's work fills the time.
constexpr int kGroups = 2;

template <int W>
struct Group {
  BasicVelocities<Floats<W>> velocities;
  std::array<BasicJointRow<Floats<W>>, kNumLegs> joints;
  std::array<BasicContactRow<Floats<W>>, kMaxContacts> contacts;
};

template <int W>
struct Groups {
  alignas(W * 4) std::array<Group<W>, kGroups> all;
  int used;
  int num_contacts;
};

// Number `i` of one lane of a row, both taken as plain floats.
template <int W>
float* at(void* row, std::size_t i, int lane) {
  return static_cast<float*>(row) + i * W + static_cast<std::size_t>(lane);
}

template <int W>
void gather(void* lanes, const void* row, std::size_t count, int lane) {
  for (std::size_t i = 0; i < count; ++i) {
    *at<W>(lanes, i, lane) = static_cast<const float*>(row)[i];
  }
}

template <int W>
void scatter(void* lanes, void* row, std::size_t count, int lane) {
  for (std::size_t i = 0; i < count; ++i) static_cast<float*>(row)[i] = *at<W>(lanes, i, lane);
}

template <int W>
void load(Groups<W>& groups, std::span<VelocityRows* const> alike) {
  const VelocityRows& first = *alike.front();
  groups.num_contacts = first.num_contacts;
  groups.used = static_cast<int>(alike.size()) > W ? 2 : 1;

  // Lanes without a row of their own work along with the first one's numbers, for nothing.
  for (int slot = 0; slot < groups.used * W; ++slot) {
    const auto index = static_cast<std::size_t>(slot);
    const VelocityRows& rows = index < alike.size() ? *alike[index] : first;
    Group<W>& group = groups.all[index / W];
    const int lane = slot % W;
    gather<W>(&group.velocities, &rows.velocities, kVelocityFloats, lane);
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      gather<W>(&group.joints[i], &rows.joints[i], kJointFloats, lane);
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(groups.num_contacts); ++i) {
      gather<W>(&group.contacts[i], &rows.contacts[i], kContactFloats, lane);
      group.contacts[i].cases_seen[lane] = rows.contacts[i].cases_seen;
    }
  }
  for (Group<W>& group : groups.all) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      group.joints[i].leg = first.joints[i].leg;
      group.joints[i].at_stop = first.joints[i].at_stop;
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(groups.num_contacts); ++i) {
      group.contacts[i].body = first.contacts[i].body;
      group.contacts[i].num_points = first.contacts[i].num_points;
    }
  }
}

// Only what iterations change goes back.
template <int W>
void store(Groups<W>& groups, VelocityRows& rows, std::size_t slot) {
  Group<W>& group = groups.all[slot / W];
  const auto lane = static_cast<int>(slot % W);
  scatter<W>(&group.velocities, &rows.velocities, kVelocityFloats, lane);
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    auto& joint = group.joints[i];
    scatter<W>(&joint.impulse, &rows.joints[i].impulse, 2, lane);
    scatter<W>(&joint.limit_impulse, &rows.joints[i].limit_impulse, 1, lane);
    scatter<W>(&joint.motor_impulse, &rows.joints[i].motor_impulse, 1, lane);
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(groups.num_contacts); ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      auto& point = group.contacts[i].points[j];
      auto& to = rows.contacts[i].points[j];
      scatter<W>(&point.normal_impulse, &to.normal_impulse, 1, lane);
      scatter<W>(&point.tangent_impulse, &to.tangent_impulse, 1, lane);
    }
    rows.contacts[i].cases_seen = group.contacts[i].cases_seen[lane];
  }
}

template <int W>
void run(Groups<W>& groups, int iterations) {
  const auto used = static_cast<std::size_t>(groups.used);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      for (std::size_t g = 0; g < used; ++g) {
        Group<W>& group = groups.all[g];
        iterate_velocity(group.joints[i], group.velocities);
      }
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(groups.num_contacts); ++i) {
      for (std::size_t g = 0; g < used; ++g) {
        Group<W>& group = groups.all[g];
        iterate_velocity(group.contacts[i], group.velocities);
      }
    }
  }
}

// All that an iteration of a flight reads of what another has changed.
template <int W>
struct Feedback {
  BasicVelocities<Floats<W>> velocities;
  std::array<Floats<W>, kNumLegs> motor_impulses;
  std::array<Floats<W>, kNumLegs> limit_impulses;
};

template <int W>
Feedback<W> feedback(const Group<W>& group) {
  return {group.velocities,
          {group.joints[0].motor_impulse, group.joints[1].motor_impulse},
          {group.joints[0].limit_impulse, group.joints[1].limit_impulse}};
}

// Which lanes hold the same bits; a comparison of floats would not tell the zeros apart.
template <int W>
std::array<bool, W> same(const Feedback<W>& a, const Feedback<W>& b) {
  using Bits = typename Lanes<W>::Bits;
  constexpr std::size_t count = sizeof(Feedback<W>) / sizeof(Bits);
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
void iterate(std::span<VelocityRows* const> alike, int iterations) {
  Groups<W> groups;
  load<W>(groups, alike);
  run(groups, iterations);
  for (std::size_t slot = 0; slot < alike.size(); ++slot) store(groups, *alike[slot], slot);
}

template <int W>
void circle(std::span<VelocityRows* const> alike, std::span<bool> done) {
  Groups<W> groups;
  load<W>(groups, alike);
  const auto used = static_cast<std::size_t>(groups.used);
  run(groups, kWindow);
  std::array<Feedback<W>, kGroups> before;
  for (std::size_t g = 0; g < used; ++g) before[g] = feedback(groups.all[g]);

  alignas(W * 4) Vec<Floats<W>> impulses[kWindow][kNumLegs][kGroups];
  for (auto& window : impulses) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      for (std::size_t g = 0; g < used; ++g) {
        Group<W>& group = groups.all[g];
        window[i][g] = iterate_velocity(group.joints[i], group.velocities);
      }
    }
  }

  std::array<std::array<bool, W>, kGroups> same_lanes;
  for (std::size_t g = 0; g < used; ++g) same_lanes[g] = same<W>(before[g], feedback(groups.all[g]));
  for (std::size_t slot = 0; slot < alike.size(); ++slot) {
    done[slot] = same_lanes[slot / W][slot % W];
    if (!done[slot]) store(groups, *alike[slot], slot);
  }
  for (int round = 0; round < kRounds; ++round) {
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
}  // namespace touchdown::TOUCHDOWN_KERNEL

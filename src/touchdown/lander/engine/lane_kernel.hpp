// One kernel: rows to lanes, 180 iterations, lanes to rows. Compiled once for each instruction set,
// in a namespace of its own, so that no function of a wider set is ever linked into a narrower one.
#pragma once

#include <array>
#include <cstddef>
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
  std::array<BasicContactRow<Floats<W>>, kMostLaneContacts> contacts;
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
void solve(std::span<VelocityRows* const> alike) {
  const VelocityRows& first = *alike.front();
  const int num_contacts = first.num_contacts;
  const int num_groups = static_cast<int>(alike.size()) > W ? 2 : 1;
  alignas(W * 4) std::array<Group<W>, kGroups> groups;

  // Lanes without a row of their own work along with the first one's numbers, for nothing.
  for (int slot = 0; slot < num_groups * W; ++slot) {
    const auto index = static_cast<std::size_t>(slot);
    const VelocityRows& rows = index < alike.size() ? *alike[index] : first;
    Group<W>& group = groups[static_cast<std::size_t>(slot / W)];
    const int lane = slot % W;
    gather<W>(&group.velocities, &rows.velocities, kVelocityFloats, lane);
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      gather<W>(&group.joints[i], &rows.joints[i], kJointFloats, lane);
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(num_contacts); ++i) {
      gather<W>(&group.contacts[i], &rows.contacts[i], kContactFloats, lane);
    }
  }
  for (Group<W>& group : groups) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      group.joints[i].leg = first.joints[i].leg;
      group.joints[i].at_stop = first.joints[i].at_stop;
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(num_contacts); ++i) {
      group.contacts[i].body = first.contacts[i].body;
      group.contacts[i].num_points = first.contacts[i].num_points;
    }
  }

  for (int iteration = 0; iteration < kVelocityIterations; ++iteration) {
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      for (int g = 0; g < num_groups; ++g) {
        Group<W>& group = groups[static_cast<std::size_t>(g)];
        iterate_velocity(group.joints[i], group.velocities);
      }
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(num_contacts); ++i) {
      for (int g = 0; g < num_groups; ++g) {
        Group<W>& group = groups[static_cast<std::size_t>(g)];
        iterate_velocity(group.contacts[i], group.velocities);
      }
    }
  }

  for (std::size_t index = 0; index < alike.size(); ++index) {
    VelocityRows& rows = *alike[index];
    Group<W>& group = groups[index / W];
    const int lane = static_cast<int>(index % W);
    scatter<W>(&group.velocities, &rows.velocities, kVelocityFloats, lane);
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      scatter<W>(&group.joints[i], &rows.joints[i], kJointFloats, lane);
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(num_contacts); ++i) {
      scatter<W>(&group.contacts[i], &rows.contacts[i], kContactFloats, lane);
    }
  }
}

}  // namespace
}  // namespace touchdown::TOUCHDOWN_KERNEL

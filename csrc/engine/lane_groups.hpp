// Constraints of several environments in lanes: filling the lanes, and taking the results out.
//
// Environments whose contacts differ can share a vector. It has a slot for each contact that one of
// them has, and lanes without that contact get one that does nothing. All of this is compiled once
// per instruction set (see simd/kernel_target.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include "engine/kernel.hpp"
#include "engine/lanes.hpp"
#include "engine/velocity_constraints.hpp"
#include "simd/kernel_target.hpp"

namespace touchdown::engine::TOUCHDOWN_KERNEL {
namespace {

// What is the same in every lane of a contact.
struct Slot {
  int body;
  int num_points;
  bool operator==(const Slot&) const = default;
};

struct Slots {
  int count;
  std::array<Slot, kMaxContacts> all;
};

// A vector with more slots than this takes no further environment that needs another one.
constexpr int kMaxSharedSlots = 8;

template <int W>
struct Group {
  BasicVelocities<Floats<W>> velocities;
  std::array<BasicJointConstraint<Floats<W>>, kNumLegs> joints;
  std::array<BasicContactConstraint<Floats<W>>, kMaxContacts> contacts;
  Slots slots;
  std::span<VelocityConstraints* const> items;  // one per lane, from the first lane on
};

inline Slot slot_of(const VelocityConstraints& constraints, int contact) {
  const auto& of = constraints.contacts[static_cast<std::size_t>(contact)];
  return {of.body, of.num_points};
}

// Adds the slots that these constraints need, so that their contacts are a subsequence of the
// slots. Returns whether there was room.
inline bool add_slots(Slots& slots, const VelocityConstraints& constraints) {
  // The usual order of the bodies: a good guess where to insert.
  constexpr std::array<int, kNumBodies> rank{1, 2, 0};
  const int most = slots.count == 0 ? kMaxContacts : kMaxSharedSlots;
  int next = 0;
  for (int i = 0; i < constraints.num_contacts; ++i) {
    const Slot wanted = slot_of(constraints, i);
    int found = next;
    while (found < slots.count && !(slots.all[found] == wanted)) ++found;
    if (found == slots.count) {
      if (slots.count >= most) return false;
      found = next;
      while (found < slots.count && rank[slots.all[found].body] < rank[wanted.body]) ++found;
      for (int j = slots.count; j > found; --j) slots.all[j] = slots.all[j - 1];
      slots.all[found] = wanted;
      ++slots.count;
    }
    next = found + 1;
  }
  return true;
}

// A contact that changes no bit of a velocity: it adds -0. In its solution for two points, no case
// is valid.
inline BasicContactConstraint<float> idle_contact() {
  constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
  BasicContactConstraint<float> idle{};
  idle.inverse_mass = idle.inverse_inertia = -0.0f;
  idle.normal = idle.tangent = {1.0f, 1.0f};
  for (auto& point : idle.points) point.arm = {1.0f, 0.0f};
  idle.k11 = idle.k12 = idle.k22 = not_a_number;
  return idle;
}

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
void put_in_lane(Group<W>& group, const VelocityConstraints& constraints, int lane) {
  put_in_lane<W>(&group.velocities, &constraints.velocities, kVelocityFloats, lane);
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    put_in_lane<W>(&group.joints[i], &constraints.joints[i], kJointFloats, lane);
  }
  int next = 0;
  for (int slot = 0; slot < group.slots.count; ++slot) {
    const auto s = static_cast<std::size_t>(slot);
    const bool has =
        next < constraints.num_contacts && slot_of(constraints, next) == group.slots.all[s];
    const auto idle = idle_contact();
    const auto& contact = has ? constraints.contacts[static_cast<std::size_t>(next++)] : idle;
    put_in_lane<W>(&group.contacts[s], &contact, kContactFloats, lane);
    group.contacts[s].cases_seen[lane] = contact.cases_seen;
  }
}

// Fills the lanes with the first of `items`, as many as fit together.
template <int W>
void load(Group<W>& group, std::span<VelocityConstraints* const> items) {
  const VelocityConstraints& first = *items.front();
  group.slots.count = 0;
  std::size_t count = 0;
  while (count < items.size() && count < W && items[count]->joints[0].leg == first.joints[0].leg &&
         add_slots(group.slots, *items[count])) {
    ++count;
  }
  group.items = items.first(count);

  // Spare lanes repeat the first one's numbers, and their results are ignored.
  for (int lane = 0; lane < W; ++lane) {
    const auto index = static_cast<std::size_t>(lane);
    put_in_lane(group, index < count ? *items[index] : first, lane);
  }
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    group.joints[i].leg = first.joints[i].leg;
    group.joints[i].at_limit = false;
    for (const VelocityConstraints* item : group.items) {
      group.joints[i].at_limit = group.joints[i].at_limit || item->joints[i].at_limit;
    }
  }
  for (int i = 0; i < group.slots.count; ++i) {
    const auto s = static_cast<std::size_t>(i);
    group.contacts[s].body = group.slots.all[s].body;
    group.contacts[s].num_points = group.slots.all[s].num_points;
  }
}

// Writes back what iterations change.
template <int W>
void store(Group<W>& group, int lane) {
  VelocityConstraints& constraints = *group.items[static_cast<std::size_t>(lane)];
  take_from_lane<W>(&group.velocities, &constraints.velocities, kVelocityFloats, lane);
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    auto& joint = group.joints[i];
    take_from_lane<W>(&joint.impulse, &constraints.joints[i].impulse, 2, lane);
    take_from_lane<W>(&joint.limit_impulse, &constraints.joints[i].limit_impulse, 1, lane);
    take_from_lane<W>(&joint.motor_impulse, &constraints.joints[i].motor_impulse, 1, lane);
  }
  int next = 0;
  for (int slot = 0; slot < group.slots.count && next < constraints.num_contacts; ++slot) {
    const auto s = static_cast<std::size_t>(slot);
    if (!(slot_of(constraints, next) == group.slots.all[s])) continue;
    auto& contact = constraints.contacts[static_cast<std::size_t>(next++)];
    for (std::size_t j = 0; j < 2; ++j) {
      auto& point = group.contacts[s].points[j];
      take_from_lane<W>(&point.normal_impulse, &contact.points[j].normal_impulse, 1, lane);
      take_from_lane<W>(&point.tangent_impulse, &contact.points[j].tangent_impulse, 1, lane);
    }
    contact.cases_seen = group.contacts[s].cases_seen[lane];
  }
}

}  // namespace
}  // namespace touchdown::engine::TOUCHDOWN_KERNEL

// Constraints of several environments in lanes: filling the lanes, and taking the results out.
//
// Environments whose contacts differ can share a vector. It has a slot for each contact that one of
// them has, and lanes without that contact get one that does nothing. All of this is compiled once
// per instruction set (see simd/kernel_target.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>

#include "engine/joint_constants.hpp"
#include "engine/kernel.hpp"
#include "engine/lane_rows.hpp"
#include "engine/lanes.hpp"
#include "engine/motion.hpp"
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

constexpr int kWidth = TOUCHDOWN_WIDTH;

// `F` is a vector, or a pair of vectors.
template <typename F>
constexpr std::size_t kLanes = sizeof(F) / sizeof(float);
template <typename F>
constexpr std::size_t kVectors = kLanes<F> / kWidth;

template <typename F>
struct Group {
  BasicVelocities<F> velocities;
  std::array<BasicJointConstraint<F>, kNumLegs> joints;
  std::array<BasicContactConstraint<F>, kMaxContacts> contacts;
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
// is valid. The padding is read, and ignored.
struct IdleContact {
  BasicContactConstraint<float> contact;
  std::array<float, kWidth> padding;
};

constexpr IdleContact idle_contact() {
  constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
  IdleContact idle{};
  BasicContactConstraint<float>& contact = idle.contact;
  contact.inverse_mass = contact.inverse_inertia = -0.0f;
  contact.normal = contact.tangent = {1.0f, 1.0f};
  for (auto& point : contact.points) point.arm = {1.0f, 0.0f};
  contact.k11 = contact.k12 = contact.k22 = not_a_number;
  return idle;
}
constexpr IdleContact kIdleContact = idle_contact();

// One part of each lander, in the lanes of one of the group's vectors. Spare lanes repeat the first
// lander's numbers.
template <typename F, typename Part>
auto rows_of(const Group<F>& group, std::size_t vector, const Part& part) {
  Rows<kWidth, std::remove_reference_t<decltype(*part(0))>> rows;
  for (std::size_t i = 0; i < kWidth; ++i) {
    const std::size_t lane = vector * kWidth + i;
    rows[i] = part(lane < group.items.size() ? lane : 0);
  }
  return rows;
}

// The contact of each lander that belongs into a slot, or -1. `next` is where to look for it.
template <typename F>
std::array<int, kLanes<F>> contacts_in(const Group<F>& group, std::array<int, kLanes<F>>& next,
                                       Slot slot) {
  std::array<int, kLanes<F>> found;
  for (std::size_t lane = 0; lane < group.items.size(); ++lane) {
    const VelocityConstraints& constraints = *group.items[lane];
    const bool has =
        next[lane] < constraints.num_contacts && slot_of(constraints, next[lane]) == slot;
    found[lane] = has ? next[lane]++ : -1;
  }
  return found;
}

// The address of `vector` in a member that all vectors of a group have.
template <typename T>
auto* part_of(T& lanes, std::size_t vector) {
  using Vector = std::conditional_t<std::is_const_v<T>, const Floats<kWidth>, Floats<kWidth>>;
  return reinterpret_cast<Vector*>(&lanes) + vector;
}

template <typename F>
void load_contacts(Group<F>& group) {
  // The cases seen follow the floats.
  constexpr std::size_t count = kContactFloats + 1;
  std::array<int, kLanes<F>> next{};
  for (int i = 0; i < group.slots.count; ++i) {
    auto& contact = group.contacts[static_cast<std::size_t>(i)];
    const Slot slot = group.slots.all[static_cast<std::size_t>(i)];
    const auto found = contacts_in(group, next, slot);
    contact.body = slot.body;
    contact.num_points = slot.num_points;
    for (std::size_t v = 0; v < kVectors<F>; ++v) {
      const auto rows = rows_of(group, v, [&](std::size_t lane) {
        const auto* const from =
            found[lane] < 0 ? &kIdleContact.contact
                            : &group.items[lane]->contacts[static_cast<std::size_t>(found[lane])];
        return reinterpret_cast<const float*>(from);
      });
      load_rows<count, kWidth>(part_of(contact, v), rows, kVectors<F>);
    }
  }
}

// Copies vectors into the places of one of the group's vectors.
template <typename F>
void spread(const void* from, std::size_t count, Floats<kWidth>* to) {
  const auto* const vectors = static_cast<const Floats<kWidth>*>(from);
  for (std::size_t i = 0; i < count; ++i) to[i * kVectors<F>] = vectors[i];
}

// Loads velocities and makes the joints' constraints; warm starts them if the iterations begin.
template <typename F>
void load_vector(Group<F>& group, std::size_t v, bool begins, const Model& model) {
  using V = Floats<kWidth>;
  BasicVelocities<V> velocities;
  BasicPoses<V> poses;
  const auto velocity_rows = rows_of(group, v, [&](std::size_t lane) {
    return reinterpret_cast<const float*>(&group.items[lane]->velocities);
  });
  load_rows<kVelocityFloats, kWidth>(&velocities, velocity_rows);
  const auto pose_rows = rows_of(group, v, [&](std::size_t lane) {
    return reinterpret_cast<const float*>(&group.items[lane]->poses);
  });
  load_rows<kPoseFloats, kWidth>(&poses, pose_rows);
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    BasicJointConstraint<V> joint;
    joint.leg = group.items[0]->joints[i].leg;
    const auto joint_rows = rows_of(group, v, [&](std::size_t lane) {
      return static_cast<const float*>(changing_floats(group.items[lane]->joints[i]));
    });
    load_rows<kChangingFloats, kWidth>(changing_floats(joint), joint_rows);
    set_masses(joint, model.shapes[kHull], model.shapes[static_cast<std::size_t>(joint.leg)]);
    set_constants(joint, model.joints[static_cast<std::size_t>(joint.leg - kLeg0)], poses);
    if (begins) warm_start(joint, velocities);
    spread<F>(&joint, kJointFloats, part_of(group.joints[i], v));
  }
  spread<F>(&velocities, kVelocityFloats, part_of(group.velocities, v));
}

// Fills the lanes with the first of `items`, as many as fit together.
template <typename F>
void load(Group<F>& group, std::span<VelocityConstraints* const> items, bool begins,
          const Model& model) {
  const VelocityConstraints& first = *items.front();
  group.slots.count = 0;
  std::size_t count = 0;
  while (count < items.size() && count < kLanes<F> &&
         items[count]->joints[0].leg == first.joints[0].leg &&
         add_slots(group.slots, *items[count])) {
    ++count;
  }
  group.items = items.first(count);

  for (std::size_t v = 0; v < kVectors<F>; ++v) load_vector(group, v, begins, model);
  for (std::size_t i = 0; i < kNumLegs; ++i) {
    group.joints[i].leg = first.joints[i].leg;
    group.joints[i].at_limit = false;
    for (const VelocityConstraints* item : group.items) {
      group.joints[i].at_limit = group.joints[i].at_limit || item->joints[i].at_limit;
    }
  }
  load_contacts(group);
}

// How many of the group's landers are in one of its vectors.
template <typename F>
std::size_t used_lanes(const Group<F>& group, std::size_t vector) {
  const std::size_t before = vector * kWidth;
  const std::size_t count = group.items.size();
  return count < before ? 0 : count - before < kWidth ? count - before : kWidth;
}

// Writes back what iterations change, and of a contact's points also their constants.
template <typename F>
void store_contacts(const Group<F>& group) {
  constexpr std::size_t count = sizeof(BasicContactConstraint<float>::points) / sizeof(float);
  std::array<int, kLanes<F>> next{};
  for (int i = 0; i < group.slots.count; ++i) {
    const auto& contact = group.contacts[static_cast<std::size_t>(i)];
    const auto found = contacts_in(group, next, group.slots.all[static_cast<std::size_t>(i)]);
    std::array<float, count> nowhere;
    std::uint32_t no_cases;
    const auto of = [&](std::size_t lane) -> BasicContactConstraint<float>& {
      return group.items[lane]->contacts[static_cast<std::size_t>(found[lane])];
    };
    for (std::size_t v = 0; v < kVectors<F>; ++v) {
      const auto points = rows_of(group, v, [&](std::size_t lane) {
        return found[lane] < 0 ? nowhere.data() : reinterpret_cast<float*>(&of(lane).points);
      });
      const auto cases = rows_of(group, v, [&](std::size_t lane) {
        return found[lane] < 0 ? reinterpret_cast<float*>(&no_cases)
                               : reinterpret_cast<float*>(&of(lane).cases_seen);
      });
      const std::size_t used = used_lanes(group, v);
      store_rows<count, kWidth>(part_of(contact.points, v), points, used, kVectors<F>);
      store_rows<1, kWidth>(part_of(contact.cases_seen, v), cases, used, kVectors<F>);
    }
  }
}

template <typename F>
void store(const Group<F>& group) {
  constexpr std::size_t joint_floats = 4;  // the impulses follow each other
  for (std::size_t v = 0; v < kVectors<F>; ++v) {
    const std::size_t used = used_lanes(group, v);
    const auto velocities = rows_of(group, v, [&](std::size_t lane) {
      return reinterpret_cast<float*>(&group.items[lane]->velocities);
    });
    store_rows<kVelocityFloats, kWidth>(part_of(group.velocities, v), velocities, used,
                                        kVectors<F>);
    for (std::size_t i = 0; i < kNumLegs; ++i) {
      const auto impulses = rows_of(group, v, [&](std::size_t lane) {
        return reinterpret_cast<float*>(&group.items[lane]->joints[i].impulse);
      });
      store_rows<joint_floats, kWidth>(part_of(group.joints[i].impulse, v), impulses, used,
                                       kVectors<F>);
    }
  }
  store_contacts(group);
}

}  // namespace
}  // namespace touchdown::engine::TOUCHDOWN_KERNEL

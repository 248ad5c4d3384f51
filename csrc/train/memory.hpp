// The ring of packed transitions that Python owns, as touchdown.replay.ring fills it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "fused/transition.hpp"
#include "train/mirror.hpp"

namespace touchdown::train {

// One step of one environment, as it is stored.
struct Step {
  const float* o_tm1;  // [D]
  std::int32_t a_tm1;
  float r_t;
  float discount_t;
  bool terminated;
  std::int32_t a_t;  // the action after it, which only SARSA knows; else 0
  const float* o_t;  // [D]
};

struct Memory {
  float* records;  // [capacity][W], packed transitions
  std::int64_t capacity;
  std::size_t num_observations;  // D

  // The number of transitions that are stored after `added` were.
  std::int64_t size(std::int64_t added) const { return std::min(added, capacity); }

  // Stores a transition as the one that follows `added` others.
  void store(const Step& step, std::int64_t added) const {
    const fused::TransitionFields at = fused::transition_fields(num_observations);
    float* const record = records + static_cast<std::size_t>(added % capacity) * at.size;
    const std::int32_t terminated = step.terminated ? 1 : 0;
    std::copy_n(step.o_tm1, num_observations, record + at.o_tm1);
    std::memcpy(record + at.a_tm1, &step.a_tm1, sizeof(std::int32_t));
    record[at.r_t] = step.r_t;
    record[at.discount_t] = step.discount_t;
    std::memcpy(record + at.terminated, &terminated, sizeof(std::int32_t));
    std::memcpy(record + at.a_t, &step.a_t, sizeof(std::int32_t));
    std::copy_n(step.o_t, num_observations, record + at.o_t);
  }

  // Stores the mirror image of a transition as the one that follows `added` others.
  void store_image(const Step& step, const Mirror& mirror, std::int64_t added) const {
    store(step, added);
    const fused::TransitionFields at = fused::transition_fields(num_observations);
    float* const record = records + static_cast<std::size_t>(added % capacity) * at.size;
    mirror.reflect(step.o_tm1, record + at.o_tm1);
    mirror.reflect(step.o_t, record + at.o_t);
    const std::int32_t image[] = {mirror.actions[static_cast<std::size_t>(step.a_tm1)],
                                  mirror.actions[static_cast<std::size_t>(step.a_t)]};
    std::memcpy(record + at.a_tm1, &image[0], sizeof(std::int32_t));
    std::memcpy(record + at.a_t, &image[1], sizeof(std::int32_t));
  }
};

}  // namespace touchdown::train

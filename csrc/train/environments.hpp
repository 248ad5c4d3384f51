// Landers with the results of their latest step, and their episodes, in arrays that Python owns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/batch.hpp"

namespace touchdown::train {

// The environments and the results of their latest step.
struct Environments {
  std::span<engine::Lander> landers;
  std::span<engine::Throttle> throttles;
  std::span<const engine::Task> tasks;  // all kStep
  std::span<engine::Workspace> workspaces;
  engine::Workers& workers;
  std::int64_t* actions;  // [N]
  engine::Results results;
  std::int64_t* steps;  // [N], since each episode's start
};

// The current episode of each environment, as touchdown.envs.episodes records it.
struct Episodes {
  float* observations;    // [N][D], the latest
  double* returns;        // [N]
  std::int64_t* steps;    // [N]
  std::int32_t* actions;  // [N][room]
  std::size_t room;
};

}  // namespace touchdown::train

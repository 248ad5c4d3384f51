// Many landers stepped together, in lanes where most of the work is.
// Box2D has no counterpart: each lander has a b2World of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/lander.hpp"
#include "engine/lane_queue.hpp"
#include "engine/workers.hpp"

namespace touchdown::engine {

// What a step of the batch does with a lander.
enum class Task : std::uint8_t { kNothing, kStep, kBegin };
inline constexpr std::uint8_t kNumTasks = 3;

// Where a batch's results go, one row per environment. An episode that begins has a reward of 0;
// the rows of landers with nothing to do are left as they are.
struct Results {
  float* observations;  // [N, 8]
  double* rewards;      // [N]
  bool* terminated;     // [N]
};

// What one thread needs from step to step. Aligned so that no two threads write to one cache line.
struct alignas(128) Workspace {
  explicit Workspace(const SolverKernel& kernel = engine::kernel()) : queue(kernel) {}

  LaneQueue queue;
  Coverage coverage{};
  std::vector<Moving> moving;  // its elements are used during one call only
};

// Carries out each lander's task. `throttles` and `tasks` have one entry per lander, and there is
// one workspace per worker. A lander's results depend neither on the others in the batch nor on the
// workers.
void step(std::span<Lander> landers, std::span<const Throttle> throttles,
          std::span<const Task> tasks, const Results& results, std::span<Workspace> workspaces,
          Workers& workers);

}  // namespace touchdown::engine

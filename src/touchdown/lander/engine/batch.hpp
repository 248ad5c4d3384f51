// Many landers stepped together: everything scalar, save the velocity iterations, which go in lanes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "lander.hpp"
#include "lane_queue.hpp"
#include "workers.hpp"

namespace touchdown {

// What to do with a lander in a step of the batch.
enum class Task : std::uint8_t { kNothing, kStep, kBegin };
inline constexpr std::uint8_t kNumTasks = 3;

// Where a batch's results go: one row an environment, each written in place. An episode that begins
// has a reward of 0; the rows of landers with nothing to do stay as they are.
struct Results {
  float* observations;  // [N, 8]
  double* rewards;      // [N]
  bool* terminated;     // [N]
};

// What one thread needs from step to step.
struct alignas(128) Workspace {  // two threads must not write to one cache line
  LaneQueue queue;
  Coverage coverage{};
};

// Gives each lander its task. `throttles` and `tasks` have one entry a lander, and there is a
// workspace for each worker. Results depend neither on who else is in the batch nor on the workers.
void step(std::span<Lander> landers, std::span<const Throttle> throttles,
          std::span<const Task> tasks, const Results& results, std::span<Workspace> workspaces,
          Workers& workers);

}  // namespace touchdown

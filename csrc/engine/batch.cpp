#include "engine/batch.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <vector>

namespace touchdown::engine {

namespace {

// Loads what the first half of a step reads into the cache, without the terrain and
// most contacts.
void prefetch(const Lander& lander) {
  constexpr std::size_t line = 64;
  const auto* const bytes = reinterpret_cast<const char*>(&lander);
  for (std::size_t i = 0; i < offsetof(Lander, world) + offsetof(World, terrain); i += line) {
    __builtin_prefetch(bytes + i);
  }
  __builtin_prefetch(&lander.world.contacts);
}

// One thread's share of a step of the batch.
class Worker {
 public:
  Worker(std::span<Lander> landers, std::span<const Throttle> throttles,
         std::span<const Task> tasks, const Results& results, Workspace& workspace)
      : landers_(landers),
        throttles_(throttles),
        tasks_(tasks),
        results_(results),
        queue_(workspace.queue),
        coverage_(workspace.coverage),
        moving_(workspace.moving) {}
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void begin(std::size_t i) {
    if (i + 1 < landers_.size()) prefetch(landers_[i + 1]);
    if (tasks_[i] == Task::kNothing) return;
    Pending& pending = queue_.take();
    pending.index = i;
    StepState& state = pending.state;
    const bool solves = tasks_[i] == Task::kBegin
                            ? begin_episode(landers_[i], state, coverage_)
                            : begin_step(landers_[i], throttles_[i], state, coverage_);
    if (solves) {
      queue_.add(pending, finish_);
    } else {
      end_step(i);
      queue_.give_back(pending);
    }
  }

  void end(LaneQueue::Shared& shared, std::size_t threads) {
    if (threads == 1) {
      queue_.flush(finish_);
    } else {
      queue_.flush(shared, threads, finish_);
    }
  }

 private:
  // `finish_solve`, then the end of the step, for each.
  void finish(std::span<Pending* const> solved) {
    if (solved.size() <= queue_.kernel().lanes / 8) {
      // Too few for lanes.
      for (Pending* const pending : solved) {
        finish_solve(landers_[pending->index].world, pending->state, coverage_);
      }
    } else {
      finish_in_lanes(solved);
    }
    for (const Pending* const pending : solved) end_step(pending->index);
  }

  void finish_in_lanes(std::span<Pending* const> solved) {
    moving_.clear();
    for (Pending* const pending : solved) {
      std::array<Body, kNumBodies>& bodies = landers_[pending->index].world.bodies;
      moving_.push_back({&pending->state.constraints, &bodies, 0, false});
    }
    const SolverKernel& kernel = queue_.kernel();
    kernel.integrate(moving_, model());
    for (std::size_t i = 0; i < solved.size(); ++i) {
      if (moving_[i].corrected) continue;
      moving_[i].iterations =
          solve_position_constraints(solved[i]->state.constraints, moving_[i].iterations);
    }
    kernel.place(moving_, model());
    for (std::size_t i = 0; i < solved.size(); ++i) {
      conclude_solve(landers_[solved[i]->index].world, solved[i]->state, moving_[i].iterations,
                     coverage_);
    }
  }

  void end_step(std::size_t i) {
    const bool begins = tasks_[i] == Task::kBegin;
    const Transition transition = engine::end_step(landers_[i], coverage_);
    std::copy(transition.observation.begin(), transition.observation.end(),
              results_.observations + i * kObservationSize);
    results_.rewards[i] = begins ? 0.0 : transition.reward;
    results_.terminated[i] = !begins && transition.terminated;
  }

  std::span<Lander> landers_;
  std::span<const Throttle> throttles_;
  std::span<const Task> tasks_;
  const Results& results_;
  LaneQueue& queue_;
  Coverage& coverage_;
  std::vector<Moving>& moving_;
  struct {
    Worker& worker;
    void operator()(std::span<Pending* const> solved) const { worker.finish(solved); }
  } finish_{*this};
};

}  // namespace

void step(std::span<Lander> landers, std::span<const Throttle> throttles,
          std::span<const Task> tasks, const Results& results, std::span<Workspace> workspaces,
          Workers& workers) {
  constexpr std::size_t fewest = 16, most = 64;
  std::atomic<std::size_t> next{0};
  LaneQueue::Shared shared(workspaces.front().queue.kernel());
  const std::size_t threads = workers.used_for((landers.size() + fewest - 1) / fewest);
  // Landers that a thread takes at a time: few enough that every thread gets some.
  const std::size_t chunk = std::clamp(landers.size() / (2 * threads), fewest, most);
  workers.run(threads, landers.size(), [&](std::size_t number) {
    Worker worker(landers, throttles, tasks, results, workspaces[number]);
    for (std::size_t first = next.fetch_add(chunk); first < landers.size();
         first = next.fetch_add(chunk)) {
      const std::size_t last = std::min(first + chunk, landers.size());
      for (std::size_t i = first; i < last; ++i) worker.begin(i);
    }
    worker.end(shared, threads);
  });
  if (threads > 1) {
    for (Workspace& workspace : workspaces) workspace.queue.reclaim();
  }
}

}  // namespace touchdown::engine

#include "batch.hpp"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace touchdown {

void step(std::span<Lander> landers, std::span<const Throttle> throttles,
          std::span<const Task> tasks, const Results& results, std::span<LaneQueue> queues) {
  constexpr std::size_t chunk = 64;  // landers that a thread takes at a time
  std::atomic<std::size_t> next{0};

  const auto finish = [&](std::size_t i, bool solved, Solving& solving) {
    const bool begins = tasks[i] == Task::kBegin;
    const Transition transition = finish_step(landers[i], solved, solving);
    std::copy(transition.observation.begin(), transition.observation.end(),
              results.observations + i * kObservationSize);
    results.rewards[i] = begins ? 0.0 : transition.reward;
    results.terminated[i] = !begins && transition.terminated;
  };
  const auto finish_pending = [&](Pending& pending) {
    finish(pending.index, true, pending.solving);
  };
  const auto begin = [&](std::size_t i, LaneQueue& queue) {
    if (tasks[i] == Task::kNothing) return;
    Pending& pending = queue.take();
    pending.index = i;
    Solving& solving = pending.solving;
    const bool solves = tasks[i] == Task::kBegin ? begin_episode(landers[i], solving)
                                                 : begin_step(landers[i], throttles[i], solving);
    if (solves) {
      queue.add(pending, finish_pending);
    } else {
      finish(i, false, solving);
      queue.give_back(pending);
    }
  };
  const auto work = [&](LaneQueue& queue) {
    for (std::size_t first = next.fetch_add(chunk); first < landers.size();
         first = next.fetch_add(chunk)) {
      const std::size_t end = std::min(first + chunk, landers.size());
      for (std::size_t i = first; i < end; ++i) begin(i, queue);
    }
    queue.flush(finish_pending);
  };

  const std::size_t num_threads = std::min(queues.size(), (landers.size() + chunk - 1) / chunk);
  std::vector<std::jthread> others;
  for (std::size_t i = 1; i < num_threads; ++i) {
    others.emplace_back([&work, &queue = queues[i]] { work(queue); });
  }
  work(queues.front());
}

}  // namespace touchdown

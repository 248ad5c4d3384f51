// A queue in which steps wait for others of the same layout, to be solved together in lanes. Box2D
// has no counterpart.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "engine/island.hpp"
#include "engine/kernel.hpp"
#include "engine/spin.hpp"

namespace touchdown::engine {

// A step that waits for its velocity iterations.
struct Pending {
  std::size_t index;  // of the lander
  StepState state;
};

class LaneQueue {
 public:
  explicit LaneQueue(const SolverKernel& kernel) : kernel_(kernel) {}

  const SolverKernel& kernel() const { return kernel_; }

  // Storage for the next step; it is free again once that step has been handed to `finish`.
  Pending& take() {
    if (free_.empty()) {
      all_.push_back(std::make_unique<Pending>());
      free_.push_back(all_.back().get());
    }
    Pending* const pending = free_.back();
    free_.pop_back();
    return *pending;
  }

  void give_back(Pending& pending) { free_.push_back(&pending); }

  // Takes back the storage that other queues have freed. No step may be pending.
  void reclaim() {
    free_.clear();
    for (const auto& pending : all_) free_.push_back(pending.get());
  }

  // Adds a step. If its bucket is now full, solves the bucket. `finish`
  // takes a span of solved steps.
  template <typename Finish>
  void add(Pending& pending, const Finish& finish) {
    const VelocityConstraints& constraints = pending.state.constraints;
    put(pending, {layout_of(constraints), may_cycle(constraints) ? Stage::kStart : Stage::kAll},
        finish);
  }

  // Solves all steps that still wait here. Those of different layouts share a pass, as there are
  // too few of each.
  template <typename Finish>
  void flush(const Finish& finish) {
    empty_buckets_into(*this);
    while (has_left()) {
      const Bucket bucket = pop();
      solve(bucket, finish, [this](Pending& pending) { leave(pending, Stage::kRest); });
    }
    finish_some(solved_.size(), finish);
  }

  // The same for several threads at the end of their shares: what is left in their queues is
  // merged, so that it is solved together. All threads call it once, with the same `shared`, which
  // has the kernel of their queues; `threads` is their number.
  struct Shared;
  template <typename Finish>
  void flush(Shared& shared, std::size_t threads, const Finish& finish);

 private:
  static constexpr std::size_t kMaxLanes = 64;

  // What is to be done: all iterations, or only the first ones and a check for cycles, or the rest
  // after that.
  enum class Stage : std::uint8_t { kAll, kStart, kRest };

  // What all steps in a bucket have in common.
  struct Kind {
    std::uint64_t layout;
    Stage stage;
    bool operator==(const Kind&) const = default;
  };

  struct Bucket {
    Kind kind;
    std::size_t count;
    std::array<Pending*, kMaxLanes> items;
  };

  // Steps left over when all buckets that were filled are solved, to be sorted by layout.
  struct Left {
    std::uint64_t layout;
    Pending* pending;
  };
  struct Leftovers {
    std::vector<Left> items;
    bool sorted = true;
  };

  // Encodes all that has to be alike; 0 stands for all layouts with too many contacts to encode.
  static std::uint64_t layout_of(const VelocityConstraints& constraints) {
    constexpr int bits_per_joint = 3;
    constexpr int bits_per_contact = 4;
    constexpr int max_contacts = (64 - 1 - kNumLegs * bits_per_joint) / bits_per_contact;
    if (constraints.num_contacts > max_contacts) return 0;
    std::uint64_t layout = 1;
    for (const auto& joint : constraints.joints) {
      layout = layout << bits_per_joint | static_cast<std::uint64_t>(joint.leg) << 1 |
               static_cast<std::uint64_t>(joint.at_limit);
    }
    for (int i = 0; i < constraints.num_contacts; ++i) {
      const auto& contact = constraints.contacts[static_cast<std::size_t>(i)];
      layout = layout << bits_per_contact | static_cast<std::uint64_t>(contact.body) << 2 |
               static_cast<std::uint64_t>(contact.num_points);
    }
    return layout;
  }

  template <typename Finish>
  void put(Pending& pending, Kind kind, const Finish& finish) {
    auto bucket = std::find_if(buckets_.begin(), buckets_.end(),
                               [&](const Bucket& each) { return each.kind == kind; });
    if (bucket == buckets_.end()) bucket = buckets_.insert(bucket, {kind, 0, {}});
    bucket->items[bucket->count++] = &pending;
    if (bucket->count < kernel_.lanes) return;
    // A copy: steps that wait again may add a bucket, which moves all buckets.
    const Bucket full = *bucket;
    bucket->count = 0;
    solve(full, finish,
          [&](Pending& left) { put(left, {full.kind.layout, Stage::kRest}, finish); });
  }

  // Moves the steps that wait in buckets to the leftovers of a queue.
  void empty_buckets_into(LaneQueue& queue) {
    for (const Bucket& bucket : buckets_) {
      for (std::size_t i = 0; i < bucket.count; ++i) {
        queue.leave(*bucket.items[i], bucket.kind.stage);
      }
    }
    buckets_.clear();
  }

  void leave(Pending& pending, Stage stage) {
    // All stages but the rest begin alike, so that they can share a pass.
    Leftovers& left = stage == Stage::kRest ? resuming_ : starting_;
    left.items.push_back({layout_of(pending.state.constraints), &pending});
    left.sorted = false;
  }

  bool has_left() const { return !starting_.items.empty() || !resuming_.items.empty(); }

  // Takes out leftovers that fill the lanes as well as any. Those that have not started come first,
  // as some of their steps may have to wait again.
  Bucket pop() {
    const bool starts = !starting_.items.empty();
    Leftovers& left = starts ? starting_ : resuming_;
    if (!left.sorted) {
      // Similar layouts next to each other; the most contacts, or too many to encode, last.
      std::sort(left.items.begin(), left.items.end(),
                [](const Left& a, const Left& b) { return a.layout - 1 < b.layout - 1; });
      left.sorted = true;
    }
    Bucket bucket{{0, starts ? Stage::kStart : Stage::kRest}, 0, {}};
    while (bucket.count < 2 * kernel_.lanes && !left.items.empty()) {
      bucket.items[bucket.count++] = left.items.back().pending;
      left.items.pop_back();
    }
    return bucket;
  }

  // Hands the steps that turned out not to cycle to `wait_again`, and those that are done to
  // `finish` as soon as they fill the lanes.
  template <typename Finish, typename WaitAgain>
  void solve(const Bucket& bucket, const Finish& finish, const WaitAgain& wait_again) {
    std::array<VelocityConstraints*, kMaxLanes> constraints;
    for (std::size_t i = 0; i < bucket.count; ++i) {
      constraints[i] = &bucket.items[i]->state.constraints;
    }
    std::array<bool, kMaxLanes> done;
    done.fill(true);
    const std::span<VelocityConstraints* const> items{constraints.data(), bucket.count};
    if (bucket.kind.stage == Stage::kStart) {
      kernel_.start(items, {done.data(), bucket.count}, model());
    } else if (bucket.kind.stage == Stage::kAll) {
      kernel_.solve(items, model());
    } else {
      kernel_.resume(items, model());
    }
    for (std::size_t i = 0; i < bucket.count; ++i) {
      if (done[i]) {
        solved_.push_back(bucket.items[i]);
      } else {
        wait_again(*bucket.items[i]);
      }
    }
    while (solved_.size() >= kernel_.lanes) finish_some(kernel_.lanes, finish);
  }

  template <typename Finish>
  void finish_some(std::size_t count, const Finish& finish) {
    const std::span<Pending* const> some = std::span(solved_).last(count);
    finish(some);
    for (Pending* const pending : some) give_back(*pending);
    solved_.resize(solved_.size() - count);
  }

  const SolverKernel& kernel_;
  std::vector<std::unique_ptr<Pending>> all_;
  std::vector<Pending*> free_;
  std::vector<Bucket> buckets_;
  Leftovers starting_;
  Leftovers resuming_;
  std::vector<Pending*> solved_;
};

struct LaneQueue::Shared {
  explicit Shared(const SolverKernel& kernel) : queue(kernel) {}

  std::mutex mutex;
  LaneQueue queue;  // its buckets are solved by whichever thread takes them
  std::atomic<std::size_t> arrived{0};
};

template <typename Finish>
void LaneQueue::flush(Shared& shared, std::size_t threads, const Finish& finish) {
  {
    const std::lock_guard lock(shared.mutex);
    empty_buckets_into(shared.queue);
  }
  ++shared.arrived;
  while (spin_until(shared.arrived, [&](std::size_t n) { return n == threads; }) != threads) {
    std::this_thread::yield();
  }
  for (;;) {
    std::unique_lock lock(shared.mutex);
    if (!shared.queue.has_left()) break;
    const Bucket bucket = shared.queue.pop();
    lock.unlock();
    solve(bucket, finish, [&](Pending& pending) {
      const std::lock_guard relock(shared.mutex);
      shared.queue.leave(pending, Stage::kRest);
    });
  }
  finish_some(solved_.size(), finish);
}

}  // namespace touchdown::engine

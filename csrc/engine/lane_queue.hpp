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

  // Adds a step. If its bucket is now full, solves the bucket and hands the steps to `finish`.
  template <typename Finish>
  void add(Pending& pending, const Finish& finish) {
    const VelocityConstraints& constraints = pending.state.constraints;
    put(pending, {layout_of(constraints), may_cycle(constraints) ? kCycling : kVelocityIterations},
        finish);
  }

  // Solves all steps that still wait here.
  template <typename Finish>
  void flush(const Finish& finish) {
    while (!buckets_.empty()) {
      const Bucket bucket = pop();
      solve(bucket, finish, [&](Pending& left, Kind kind) { put(left, kind, finish); });
    }
  }

  // The same for several threads at the end of their shares: what is left in their queues is
  // merged, so that steps of the same layout are solved together. All threads call it once, with
  // the same `shared`, which has the kernel of their queues; `threads` is their number.
  struct Shared;
  template <typename Finish>
  void flush(Shared& shared, std::size_t threads, const Finish& finish);

 private:
  static constexpr int kCycling = -1;
  static constexpr std::size_t kMaxLanes = 32;

  // What all steps in a bucket have in common.
  struct Kind {
    std::uint64_t layout;
    int iterations;  // iterations still to do, or `kCycling`
    bool operator==(const Kind&) const = default;
  };

  struct Bucket {
    Kind kind;
    std::size_t count;
    std::array<Pending*, kMaxLanes> items;
  };

  // Takes a bucket out; those that may cycle come first, as some of their steps may have to wait
  // again.
  Bucket pop() {
    const auto cycling = std::find_if(buckets_.begin(), buckets_.end(), [](const Bucket& bucket) {
      return bucket.kind.iterations == kCycling;
    });
    const auto chosen = cycling == buckets_.end() ? std::prev(buckets_.end()) : cycling;
    const Bucket bucket = *chosen;
    *chosen = buckets_.back();
    buckets_.pop_back();
    return bucket;
  }

  // Encodes all that has to be alike. 0 for too many contacts to encode: such a step is solved
  // alone.
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

  // Adds a step to the bucket of its kind, and returns the bucket.
  Bucket& wait(Pending& pending, Kind kind) {
    auto bucket = std::find_if(buckets_.begin(), buckets_.end(), [&](const Bucket& each) {
      return each.kind == kind && each.count < kernel_.lanes;
    });
    if (bucket == buckets_.end()) bucket = buckets_.insert(bucket, {kind, 0, {}});
    bucket->items[bucket->count++] = &pending;
    return *bucket;
  }

  template <typename Finish>
  void put(Pending& pending, Kind kind, const Finish& finish) {
    Bucket& bucket = wait(pending, kind);
    if (bucket.count < kernel_.lanes && kind.layout != 0) return;
    // A copy: steps that wait again may add a bucket, which moves all buckets.
    const Bucket full = bucket;
    bucket.count = 0;
    solve(full, finish, [&](Pending& left, Kind remaining) { put(left, remaining, finish); });
  }

  // Hands the steps that are done to `finish`, and those that turned out not to cycle to
  // `wait_again`.
  template <typename Finish, typename WaitAgain>
  void solve(const Bucket& bucket, const Finish& finish, const WaitAgain& wait_again) {
    std::array<VelocityConstraints*, kMaxLanes> constraints;
    for (std::size_t i = 0; i < bucket.count; ++i) {
      constraints[i] = &bucket.items[i]->state.constraints;
    }
    std::array<bool, kMaxLanes> done;
    if (bucket.count == 0) return;
    if (bucket.kind.iterations == kCycling) {
      kernel_.run_cycle({constraints.data(), bucket.count}, {done.data(), bucket.count});
    } else {
      kernel_.iterate({constraints.data(), bucket.count}, bucket.kind.iterations);
      done.fill(true);
    }
    for (std::size_t i = 0; i < bucket.count; ++i) {
      if (done[i]) {
        finish(*bucket.items[i]);
        give_back(*bucket.items[i]);
      } else {
        wait_again(*bucket.items[i], {bucket.kind.layout, kVelocityIterations - 2 * kWindow});
      }
    }
  }

  const SolverKernel& kernel_;
  std::vector<std::unique_ptr<Pending>> all_;
  std::vector<Pending*> free_;
  std::vector<Bucket> buckets_;
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
    for (const Bucket& bucket : buckets_) {
      for (std::size_t i = 0; i < bucket.count; ++i) {
        shared.queue.wait(*bucket.items[i], bucket.kind);
      }
    }
  }
  buckets_.clear();
  ++shared.arrived;
  while (spin_until(shared.arrived, [&](std::size_t n) { return n == threads; }) != threads) {
    std::this_thread::yield();
  }
  for (;;) {
    std::unique_lock lock(shared.mutex);
    if (shared.queue.buckets_.empty()) return;
    const Bucket bucket = shared.queue.pop();
    lock.unlock();
    solve(bucket, finish, [&](Pending& left, Kind kind) {
      const std::lock_guard relock(shared.mutex);
      shared.queue.wait(left, kind);
    });
  }
}

}  // namespace touchdown::engine

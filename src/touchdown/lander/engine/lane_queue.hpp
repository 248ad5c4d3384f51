// Where steps under way wait for others that can be solved beside them.
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

#include "island.hpp"
#include "lane_solver.hpp"
#include "workers.hpp"

namespace touchdown {

// A step between its two halves.
struct Pending {
  std::size_t index;  // of the lander
  Solving solving;
};

class LaneQueue {
 public:
  // A place for the next step; it comes back once that step is handed to `finish`.
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

  // To be called when no step is under way: takes back the places that other queues have freed.
  void settle() {
    free_.clear();
    for (const auto& pending : all_) free_.push_back(pending.get());
  }

  // Solves the rows at once if that makes enough that are alike, and hands those done to `finish`.
  template <typename Finish>
  void add(Pending& pending, const Finish& finish) {
    const VelocityRows& rows = pending.solving.rows;
    put(pending, {layout_of(rows), may_circle(rows) ? kCircling : kVelocityIterations}, finish);
  }

  // Solves all that still wait here.
  template <typename Finish>
  void flush(const Finish& finish) {
    while (!buckets_.empty()) {
      const Bucket bucket = pop();
      solve(bucket, finish, [&](Pending& left, Kind kind) { put(left, kind, finish); });
    }
  }

  // The same for several queues whose threads have come to their ends, so that what is alike in them
  // is solved together. `Rest` is shared by them; each calls this once, and `threads` is how many do.
  struct Rest;
  template <typename Finish>
  void flush(Rest& rest, std::size_t threads, const Finish& finish);

 private:
  static constexpr int kCircling = -1;
  static constexpr std::size_t kMostLanes = 32;

  // What all in a bucket have in common.
  struct Kind {
    std::uint64_t layout;
    int iterations;  // still to do; or `kCircling`
    bool operator==(const Kind&) const = default;
  };

  struct Bucket {
    Kind kind;
    std::size_t count;
    std::array<Pending*, kMostLanes> items;
  };

  // Takes a bucket out; first those that circle, for they may leave some to wait anew.
  Bucket pop() {
    const auto circling = std::find_if(buckets_.begin(), buckets_.end(), [](const Bucket& bucket) {
      return bucket.kind.iterations == kCircling;
    });
    const auto chosen = circling == buckets_.end() ? std::prev(buckets_.end()) : circling;
    const Bucket bucket = *chosen;
    *chosen = buckets_.back();
    buckets_.pop_back();
    return bucket;
  }

  // Says all that has to be alike; 0 for rows with so many contacts that they are solved alone.
  static std::uint64_t layout_of(const VelocityRows& rows) {
    constexpr int bits_of_a_joint = 3;
    constexpr int bits_of_a_contact = 4;
    constexpr int most = (64 - 1 - kNumLegs * bits_of_a_joint) / bits_of_a_contact;
    if (rows.num_contacts > most) return 0;
    std::uint64_t layout = 1;
    for (const auto& joint : rows.joints) {
      layout = layout << bits_of_a_joint | static_cast<std::uint64_t>(joint.leg) << 1 |
               static_cast<std::uint64_t>(joint.at_stop);
    }
    for (int i = 0; i < rows.num_contacts; ++i) {
      const auto& contact = rows.contacts[static_cast<std::size_t>(i)];
      layout = layout << bits_of_a_contact | static_cast<std::uint64_t>(contact.body) << 2 |
               static_cast<std::uint64_t>(contact.num_points);
    }
    return layout;
  }

  // Puts a step to those like it, and gives their bucket.
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
    // A copy: what is left over may go to a new bucket, and move them all.
    const Bucket full = bucket;
    bucket.count = 0;
    solve(full, finish, [&](Pending& left, Kind rest) { put(left, rest, finish); });
  }

  // Hands those that are done to `finish` and those that have only not circled to `go_on`.
  template <typename Finish, typename GoOn>
  void solve(const Bucket& bucket, const Finish& finish, const GoOn& go_on) {
    std::array<VelocityRows*, kMostLanes> rows;
    for (std::size_t i = 0; i < bucket.count; ++i) rows[i] = &bucket.items[i]->solving.rows;
    std::array<bool, kMostLanes> done;
    if (bucket.count == 0) return;
    if (bucket.kind.iterations == kCircling) {
      kernel_.circle({rows.data(), bucket.count}, {done.data(), bucket.count});
    } else {
      kernel_.iterate({rows.data(), bucket.count}, bucket.kind.iterations);
      done.fill(true);
    }
    for (std::size_t i = 0; i < bucket.count; ++i) {
      if (done[i]) {
        finish(*bucket.items[i]);
        give_back(*bucket.items[i]);
      } else {
        go_on(*bucket.items[i], {bucket.kind.layout, kVelocityIterations - 2 * kWindow});
      }
    }
  }

  const Kernel& kernel_ = kernel();
  std::vector<std::unique_ptr<Pending>> all_;
  std::vector<Pending*> free_;
  std::vector<Bucket> buckets_;
};

struct LaneQueue::Rest {
  std::mutex mutex;
  LaneQueue queue;
  std::atomic<std::size_t> arrived{0};
};

template <typename Finish>
void LaneQueue::flush(Rest& rest, std::size_t threads, const Finish& finish) {
  {
    const std::lock_guard lock(rest.mutex);
    for (const Bucket& bucket : buckets_) {
      for (std::size_t i = 0; i < bucket.count; ++i) {
        rest.queue.wait(*bucket.items[i], bucket.kind);
      }
    }
  }
  buckets_.clear();
  ++rest.arrived;
  while (wait_a_little(rest.arrived, [&](std::size_t n) { return n == threads; }) != threads) {
    std::this_thread::yield();
  }
  for (;;) {
    std::unique_lock lock(rest.mutex);
    if (rest.queue.buckets_.empty()) return;
    const Bucket bucket = rest.queue.pop();
    lock.unlock();
    solve(bucket, finish, [&](Pending& left, Kind kind) {
      const std::lock_guard relock(rest.mutex);
      rest.queue.wait(left, kind);
    });
  }
}

}  // namespace touchdown

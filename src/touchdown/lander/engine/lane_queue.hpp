// Where steps under way wait for others that can be solved beside them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "island.hpp"
#include "lane_solver.hpp"

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

  // Solves the rows at once if that makes enough that are alike, and hands those done to `finish`.
  template <typename Finish>
  void add(Pending& pending, const Finish& finish) {
    const VelocityRows& rows = pending.solving.rows;
    put(pending, {layout_of(rows), may_circle(rows) ? kCircling : kVelocityIterations}, finish);
  }

  // Solves all that still wait.
  template <typename Finish>
  void flush(const Finish& finish) {
    // What circles goes first, for it may leave some to wait anew.
    for (const bool circling : {true, false}) {
      for (std::size_t i = 0; i < buckets_.size(); ++i) {
        if (buckets_[i].count > 0 && (buckets_[i].kind.iterations == kCircling) == circling) {
          solve(i, finish);
        }
      }
    }
    buckets_.clear();
  }

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

  std::size_t bucket_of(Kind kind) {
    for (std::size_t i = 0; i < buckets_.size(); ++i) {
      if (buckets_[i].kind == kind) return i;
    }
    buckets_.push_back({kind, 0, {}});
    return buckets_.size() - 1;
  }

  template <typename Finish>
  void put(Pending& pending, Kind kind, const Finish& finish) {
    const std::size_t index = bucket_of(kind);
    Bucket& bucket = buckets_[index];
    bucket.items[bucket.count++] = &pending;
    if (bucket.count == kernel_.lanes || kind.layout == 0) solve(index, finish);
  }

  template <typename Finish>
  void solve(std::size_t index, const Finish& finish) {
    // A copy: what is left over may go to a new bucket, and move them all.
    const Bucket bucket = buckets_[index];
    buckets_[index].count = 0;
    std::array<VelocityRows*, kMostLanes> rows;
    for (std::size_t i = 0; i < bucket.count; ++i) rows[i] = &bucket.items[i]->solving.rows;
    std::array<bool, kMostLanes> done;
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
        put(*bucket.items[i], {bucket.kind.layout, kVelocityIterations - 2 * kWindow}, finish);
      }
    }
  }

  const Kernel& kernel_ = kernel();
  std::vector<std::unique_ptr<Pending>> all_;
  std::vector<Pending*> free_;
  std::vector<Bucket> buckets_;
};

}  // namespace touchdown

// A pool of threads that wait for work, so that a step need not start any.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <system_error>
#include <thread>
#include <vector>

#include "engine/pace.hpp"
#include "engine/spin.hpp"

namespace touchdown::engine {

class Workers {
 public:
  // The calling thread works too, so one thread fewer is started, and only when there is work.
  explicit Workers(std::size_t count) : count_(count) {}
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  ~Workers() {
    if (threads_.empty()) return;
    if (forked()) {
      // A fork copies the threads' handles but not the threads.
      for (std::thread& thread : threads_) thread.detach();
      return;
    }
    stopping_ = true;
    announce();
    for (std::thread& thread : threads_) thread.join();
  }

  // How many threads `run` may use for this many pieces of work: fewer than `count` if the system
  // grants no more, or if others use its cores.
  std::size_t used_for(std::size_t pieces) {
    can_share_ = !forked() && pieces > 1 && count_ > 1;
    if (!can_share_ || pace_.is_better_alone()) return 1;
    start();
    return std::min(pieces, threads_.size() + 1);
  }

  // Calls `work` with each number below `used`, in parallel, and returns when all calls have.
  // `used` is at most what `used_for` returned, `size` is the amount of work in all, and `work`
  // must not throw.
  void run(std::size_t used, std::size_t size, const std::function<void(std::size_t)>& work) {
    const auto began = Pace::Clock::now();
    if (used == 1) {
      work(0);
    } else {
      run_together(used, work);
    }
    if (can_share_) pace_.took(Pace::Clock::now() - began, size, used);
  }

 private:
  void run_together(std::size_t used, const std::function<void(std::size_t)>& work) {
    work_ = &work;
    helpers_ = used - 1;
    busy_.store(threads_.size(), std::memory_order_relaxed);
    announce();
    work(0);
    const auto is_zero = [](std::size_t left) { return left == 0; };
    for (std::size_t left = spin_until(busy_, is_zero); left > 0; left = busy_.load()) {
      busy_.wait(left);
    }
  }

  bool forked() const { return !threads_.empty() && owner_ != getpid(); }

  void announce() {
    ++round_;
    round_.notify_all();
  }

  void start() {
    if (!threads_.empty()) return;
    owner_ = getpid();
    try {
      while (threads_.size() + 1 < count_) {
        threads_.emplace_back(&Workers::help, this, threads_.size() + 1, round_.load());
      }
    } catch (const std::system_error&) {
      count_ = threads_.size() + 1;
    }
  }

  void help(std::size_t number, std::uint32_t seen) {
    for (;;) {
      const auto is_new = [seen](std::uint32_t round) { return round != seen; };
      if (!is_new(spin_until(round_, is_new))) round_.wait(seen);
      seen = round_.load();
      if (stopping_) return;
      if (number <= helpers_) (*work_)(number);
      if (--busy_ == 0) busy_.notify_one();
    }
  }

  std::size_t count_;
  Pace pace_;
  bool can_share_ = false;
  std::vector<std::thread> threads_;
  pid_t owner_ = 0;
  const std::function<void(std::size_t)>* work_ = nullptr;
  std::size_t helpers_ = 0;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint32_t> round_{0};
  std::atomic<std::size_t> busy_{0};
};

}  // namespace touchdown::engine

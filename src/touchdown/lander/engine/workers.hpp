// Threads that wait for work, so that a step does not have to start any.
#pragma once

#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace touchdown {

class Workers {
 public:
  // The calling thread works too: one less is started, and only when there is work.
  explicit Workers(std::size_t count) : count_(count) {}
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  ~Workers() {
    if (threads_.empty()) return;
    if (forked()) {
      // A fork copies their handles but not the threads.
      for (std::thread& thread : threads_) thread.detach();
      return;
    }
    stopping_ = true;
    announce();
    for (std::thread& thread : threads_) thread.join();
  }

  // Calls `work` with 0, 1, ... each on a thread of its own, with fewer than `most` if that is less
  // than there are threads, and returns when all have. `work` must not throw.
  void run(std::size_t most, const std::function<void(std::size_t)>& work) {
    const std::size_t helpers = (most < count_ ? most : count_) - 1;
    if (helpers == 0 || forked()) {
      work(0);
      return;
    }
    start();
    work_ = &work;
    helpers_ = helpers;
    busy_.store(threads_.size(), std::memory_order_relaxed);
    announce();
    work(0);
    for (std::size_t left = busy_.load(); left > 0; left = busy_.load()) busy_.wait(left);
  }

 private:
  bool forked() const { return !threads_.empty() && owner_ != getpid(); }

  void announce() {
    ++round_;
    round_.notify_all();
  }

  void start() {
    if (!threads_.empty()) return;
    owner_ = getpid();
    for (std::size_t i = 1; i < count_; ++i) {
      threads_.emplace_back([this, i, seen = round_.load()]() mutable {
        for (;;) {
          round_.wait(seen);
          seen = round_.load();
          if (stopping_) return;
          if (i <= helpers_) (*work_)(i);
          if (--busy_ == 0) busy_.notify_one();
        }
      });
    }
  }

  std::size_t count_;
  std::vector<std::thread> threads_;
  pid_t owner_ = 0;
  const std::function<void(std::size_t)>* work_ = nullptr;
  std::size_t helpers_ = 0;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint32_t> round_{0};
  std::atomic<std::size_t> busy_{0};
};

}  // namespace touchdown

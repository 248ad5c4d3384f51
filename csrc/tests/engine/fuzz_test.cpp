// Random use of a batch of landers, and of snapshots that were changed by accident or on purpose.
// What it looks for is found by the sanitizers that it is built with (`make sanitize`).
//
// The number of rounds is TOUCHDOWN_FUZZ_ROUNDS.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/batch.hpp"
#include "engine/snapshot.hpp"
#include "tests/check.hpp"
#include "tests/engine/flying.hpp"

namespace {

using namespace touchdown::engine;

using Bytes = std::vector<std::byte>;

int rounds() {
  const char* const given = std::getenv("TOUCHDOWN_FUZZ_ROUNDS");
  return given == nullptr ? 5 : std::stoi(given);
}

// The standard's distributions differ between libraries; this does not.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : generator_(seed) {}
  std::size_t below(std::size_t count) { return generator_() % count; }
  bool one_in(std::size_t count) { return below(count) == 0; }

 private:
  std::mt19937 generator_;
};

Config any_config(Dice& dice) {
  Config config;
  config.continuous = dice.one_in(2) ? 1 : 0;
  config.enable_wind = dice.one_in(2) ? 1 : 0;
  config.gravity = dice.one_in(4) ? -0.5 : -10.0;
  config.wind_power = dice.one_in(4) ? 1e6 : 15.0;
  return config;
}

Throttle any_throttle(Dice& dice, const Config& config) {
  if (config.continuous == 0) return discrete_throttle(static_cast<int>(dice.below(kNumActions)));
  const auto coordinate = [&] { return static_cast<float>(dice.below(41)) / 10.0f - 2.0f; };
  const float main = coordinate();
  return continuous_throttle(main, coordinate());
}

struct Fleet {
  Fleet(std::size_t count, std::size_t num_threads, const Config& config)
      : landers(count, make_lander(config)),
        throttles(count),
        tasks(count),
        workspaces(num_threads),
        workers(num_threads),
        observations(count * kObservationSize),
        rewards(count),
        terminated(new bool[count]) {}

  void advance() {
    step(landers, throttles, tasks, {observations.data(), rewards.data(), terminated.get()},
         workspaces, workers);
  }

  std::vector<Lander> landers;
  std::vector<Throttle> throttles;
  std::vector<Task> tasks;
  std::vector<Workspace> workspaces;
  Workers workers;
  std::vector<float> observations;
  std::vector<double> rewards;
  std::unique_ptr<bool[]> terminated;
};

void any_step(Fleet& fleet, Dice& dice) {
  const bool all = dice.one_in(2);
  for (std::size_t i = 0; i < fleet.landers.size(); ++i) {
    Lander& lander = fleet.landers[i];
    if (lander.seeded == 0) {
      seed(lander, std::vector<std::uint32_t>{static_cast<std::uint32_t>(dice.below(1'000))});
    }
    fleet.throttles[i] = any_throttle(dice, lander.config);
    fleet.tasks[i] = lander.started == 0 || dice.one_in(200) ? Task::kBegin
                     : all || !dice.one_in(3)                ? Task::kStep
                                                             : Task::kNothing;
  }
  fleet.advance();
}

// Changes some bits or bytes of the lander in a snapshot.
void mutate(Bytes& bytes, Dice& dice, std::size_t first) {
  const std::size_t changes = 1 + dice.below(4);
  for (std::size_t i = 0; i < changes; ++i) {
    std::byte* const at = bytes.data() + first + dice.below(bytes.size() - first);
    switch (dice.below(3)) {
      case 0:
        *at ^= std::byte{1} << dice.below(8);
        break;
      case 1:
        *at = static_cast<std::byte>(dice.below(256));
        break;
      default: {  // a word: zero, all ones (a NaN), infinity
        constexpr std::uint32_t words[] = {0, 0xffffffffu, 0x7f800000u, 0x7f7fffffu};
        const std::size_t room = bytes.size() - static_cast<std::size_t>(at - bytes.data());
        std::memcpy(at, &words[dice.below(4)], room < 4 ? room : 4);
      }
    }
  }
}

void sign_again(Bytes& bytes) {
  const std::uint64_t sum =
      checksum(std::span<const std::byte>(bytes).subspan(sizeof(SnapshotHeader)));
  std::memcpy(bytes.data() + offsetof(SnapshotHeader, checksum), &sum, sizeof(sum));
}

TEST("any use of a batch ends well, and every accidental change of a snapshot is refused") {
  int refused = 0;
  for (int round = 0; round < rounds(); ++round) {
    Dice dice(static_cast<std::uint32_t>(round));
    const Config config = any_config(dice);
    Fleet fleet(1 + dice.below(40), 1 + dice.below(3), config);
    for (int operation = 0; operation < 150; ++operation) {
      any_step(fleet, dice);
      if (!dice.one_in(10)) continue;
      Lander& from = fleet.landers[dice.below(fleet.landers.size())];
      Lander& to = fleet.landers[dice.below(fleet.landers.size())];
      const Bytes good = snapshot(from);
      Bytes bad = good;
      mutate(bad, dice, 0);
      if (bad != good) {
        CHECK_THROWS(std::invalid_argument, restored(bad, config));
        ++refused;
      }
      bad.resize(dice.below(good.size()));
      CHECK_THROWS(std::invalid_argument, restored(bad, config));
      to = restored(good, config);
      CHECK(std::memcmp(&to, &from, sizeof(Lander)) == 0);
    }
  }
  CHECK(refused > 0);
}

TEST("a snapshot that was changed on purpose is refused, or flies on within its memory") {
  int flown = 0;
  for (int round = 0; round < 20 * rounds(); ++round) {
    Dice dice(static_cast<std::uint32_t>(round));
    const Config config = any_config(dice);
    Fleet fleet(1, 1, config);
    const std::size_t steps = 1 + dice.below(120);  // in flight, or on the ground
    for (std::size_t i = 0; i < steps; ++i) any_step(fleet, dice);
    Bytes bytes = snapshot(fleet.landers.front());
    Fleet strangers(4, 1, config);
    std::size_t accepted = 0;
    for (Lander& stranger : strangers.landers) {
      Bytes changed = bytes;
      mutate(changed, dice, sizeof(SnapshotHeader));
      sign_again(changed);
      try {
        stranger = restored(changed, config);
        ++accepted;
      } catch (const std::invalid_argument&) {
        stranger = fleet.landers.front();
      }
    }
    for (int i = 0; i < 60; ++i) any_step(strangers, dice);
    flown += static_cast<int>(accepted);
  }
  CHECK(flown > 0);
}

}  // namespace

int main() { return touchdown::check::run_all(); }
